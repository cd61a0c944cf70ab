/* The shell's own data: what an exported model is (constant tables, generated) and what an instance is (one relocatable block).
 *
 * Everything that changes during a run lies in the block behind fmu_state, so that saving a state is copying that block. There are
 * no global variables: a process can have any number of instances, in any threads. */
#ifndef FMU_H
#define FMU_H
#include <stddef.h>
#include "tr.h"

#define FMU_STACK 256 /* values an expression may keep (STACK of fmu/tables.py) */

/* How a call ended, as numbers of either standard; a handle of a variable. */
typedef int fmu_status;
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR };
typedef unsigned fmu_reference;

/* What a parameter of the FMU stands for. Its `index` counts engine parameters, coordinates, rates or inputs, as the kind says. */
enum fmu_setting_kind { FMU_NUMBER, FMU_START_Q, FMU_START_QD, FMU_BANDWIDTH, FMU_TOLERANCE, FMU_STEP, FMU_MAX_STEPS, FMU_HOST_TOLERANCE,
                        FMU_MOST_EVENTS, FMU_MOST_EVALUATIONS, FMU_MOST_ITERATIONS, FMU_ERRORS, FMU_PARAMETER };

/* What becomes of a tolerance that the host gives: it is left aside; it counts where it is the tighter one; it counts. */
enum { FMU_HOST_ASIDE, FMU_HOST_TIGHTER, FMU_HOST_COUNTS };

/* Words of an expression, for a stack: FMU_VALUE and FMU_SETTING are followed by a number and by the place of a parameter. */
enum fmu_operation {
  FMU_VALUE, FMU_SETTING, FMU_ADD, FMU_SUBTRACT, FMU_MULTIPLY, FMU_DIVIDE, FMU_POWER, FMU_NEGATE, FMU_SIN, FMU_COS, FMU_TAN, FMU_ASIN,
  FMU_ACOS, FMU_ATAN, FMU_ATAN2, FMU_SQRT, FMU_ABS, FMU_MIN, FMU_MAX
};

/* A parameter. open: min itself is excluded; nonzero: zero is excluded. above: the place of another parameter that this one must
 * not be below (strict: must exceed), -1 for none. rotation: a quaternion begins here. name: path in the scene; key: the last key
 * of that path; rule: what its value must be, in words. */
typedef struct fmu_setting {
  int kind, index, also, tunable; /* also: another number that has the same value; −1: none */
  double start, min, max;
  int open, nonzero, above, strict, rotation;
  const char *name, *key, *rule;
} fmu_setting;

/* Why a run cannot go on, in the words of engine/simulation/outcome.py. */
typedef struct fmu_outcome {
  int status;
  const char *name, *advice;
} fmu_outcome;

/* A loop by its cut joint: the joint an end of it is told of, and a gimbal; what more is said of it. */
typedef struct fmu_loop {
  const char *joint, *gimbal, *words;
} fmu_loop;

/* A rate of the tree: its place, the unit in which it is compared with others, and its joint. */
typedef struct fmu_rate {
  int index;
  double unit;
  const char *joint;
} fmu_rate;

/* What there is to tell of events apart (FMI 3.0): clocks, one a joint and kind. last: the column that names the joint of the last event by its
 * number, -1: there is none. of: for each pair, then each stop, the clock of each kind of event by its number; -1: none. */
typedef struct fmu_clocks {
  int count, kinds, last;
  const int *of;
} fmu_clocks;

/* How the error of an output is told: whether it has one, jumps at events, is an angle that may be off by whole turns, tells by its size whether
 * errors are small; its unit's size in the scene. */
typedef struct fmu_erring {
  int errs, jumps, wraps, tells;
  double scale;
} fmu_erring;

/* What an FMU, or an instance of it, is for. */
enum { FMU_COSIMULATION = 1, FMU_EXCHANGE = 2 };

typedef struct fmu_model {
  const char *guid, *name;
  int types; /* what it is for: bits FMU_COSIMULATION, FMU_EXCHANGE */
  int outputs, inputs, derivatives, settings, followers; /* the last of the settings, the followers, are no variables: expressions give them */
  const int *derivative; /* of inputs that are derivatives of others: twice the place of that one, and 1 more for the second */
  const int *whole;      /* 1 for each variable that is a whole number */
  const int *slope;      /* of outputs: the place of their time derivative among them; −1: there is none; −2: they are discrete */
  const int *integral;   /* of outputs: 1 for those made of works */
  const tr_kernel *kernel;
  const tr_outputs *columns;
  const tr_jacobian *jacobian;
  const tr_linear *linear;
  const double *p;      /* engine parameters */
  int nbreaks, ntables; /* lengths of `breaks` and `tables` */
  const double *breaks, *tables;
  const double *q, *v, *q_given, *v_given; /* start values; q_given, v_given: 1 for each rate whose value the scene gives */
  double length, rate, energy; /* scales of the tolerances */
  int method, bounded, through_jams, events, noutcomes; /* bounded: steps are, for real time; through_jams: a jammed pair stops by an impact and the run goes on */
  const fmu_setting *setting;
  const fmu_outcome *outcome;
  const fmu_outcome *why; /* what becomes of a failure of friction whose reason (TR_WHY_…) is known; behind them status −1 */
  const int *pair_joint, *eta_joint, *row_loop; /* of pairs and multipliers: among `joint`; of constraint rows: among `loop`; −1: none */
  const fmu_loop *loop;
  int rates;
  const fmu_rate *moving;
  const char *const *joint_of; /* of pairs, then of stops */
  const char *const *event;    /* words for events by their number */
  const double *code; /* words of all expressions; that of follower i goes from begin[i] to begin[i + 1] */
  const int *begin;
  int joints;
  const char *const *joint, *const *law; /* names of the joints with friction; what is wrong where a law of the audit is broken */
  const int *width;         /* of each reference: how many numbers begin there, 0 of those inside an array; 0: all are scalars (FMI 2.0) */
  const int *type;          /* of each reference: FMU_FLOAT64, …; 0 in FMI 2.0 */
  const fmu_clocks *clocks; /* 0 in FMI 2.0 */
  const fmu_erring *erring; /* of outputs; 0: their errors are not told */
  double tighter, larger;   /* tolerance over that of the second run, and what the two differ by is multiplied by */
} fmu_model;

extern const fmu_model fmu_the_model;

/* What the host has changed since the simulation last took it over. */
enum { FMU_NEW_INPUTS = 1, FMU_NEW_PARAMETERS = 2, FMU_NEW = FMU_NEW_INPUTS | FMU_NEW_PARAMETERS };

/* What the host says of an input: its value and two derivatives from the present communication point on; told: the derivatives that
 * fmi2SetRealInputDerivatives gives, given: those that come as inputs of their own. Of a motion's input that comes without: its value at
 * the communication point where it last changed, and at the one before that; changes: at how many in a row it did. */
typedef struct fmu_input {
  double value, told[2], given[2];
  double last, last_t, before, before_t;
  double rate, curve;      /* of its last samples: mean rate between two of them, smoothed change of that rate, at the one before that, too: */
  double rate_before, curve_before;
  double changes, derived; /* derived: the highest derivative that has ever come: 0, 1 or 2 */
} fmu_input;

enum fmu_mode { FMU_INSTANTIATED, FMU_INITIALIZATION, FMU_STEPPING, FMU_TERMINATED, FMU_EVENTS, FMU_BETWEEN, FMU_CONTINUOUS, FMU_MODES };

/* Types of variables where they are told apart (FMI 3.0). */
enum fmu_type { FMU_FLOAT64, FMU_INT32, FMU_INT64, FMU_UINT64, FMU_BOOLEAN, FMU_CLOCK, FMU_STRING };

/* How often a clock has ticked, when last, s, and whether it ticks now. */
typedef struct fmu_tick {
  double time, count, active;
} fmu_tick;

typedef struct fmu_state {
  size_t bytes;
  char guid[40];
  int mode;
  int known;   /* model exchange: derivatives and indicators belong to `time` and the state */
  int ready;   /* whether the simulation is at `time` and the row of outputs belongs to it */
  int changed; /* bits FMU_NEW_*: what the host has set and the simulation does not use yet */
  int told;    /* worst verdict of the audit that has been logged */
  int failed;  /* status of the runtime that ended the run, 0 while it goes on, */
  int why;     /* and why, where that is known (TR_WHY_…) */
  int tenths;  /* of the agreed time that have been told of */
  int stepped; /* status of the last communication step */
  int has_stop, has_tolerance, moved;
  double start, stop, tolerance, time, reached;
  double point; /* the communication point before `time` */
  int slower;   /* whether it has been said that a motion follows its input more slowly than asked */
  int ticking;    /* a clock has ticked since the host last handled events */
  int midway;     /* the last step ended before its communication point: at an event, or between */
  int event;      /* an event is at hand: the row of outputs is as it was up to there */
  double seen;    /* up to this time it is known that nothing happens, if nothing is changed; */
  double stride;  /* the longest communication step so far: the run's own steps may reach so many times further than the present one */
  int certified;  /* outputs are the errors of themselves: 1, or -1 where nothing is promised any more */
  double apart;   /* up to this time the second run has had the same number of events, s */
  int settings, trial, inputs, row, ticks, heard, given_up, sim, other, errors, second; /* offsets in doubles behind this struct */
} fmu_state;

/* What the host lends: memory (0: that of the C library), and a function that hears messages (0: none), which `say` calls. */
typedef struct fmu_host {
  void *(*allocate)(size_t count, size_t bytes);
  void (*release)(void *);
  void (*say)(const struct fmu_host *host, const char *name, fmu_status status, const char *category, char *text);
  void (*logger)(void);
  void *environment;
} fmu_host;

typedef struct fmu_instance {
  fmu_host host;
  fmu_state *state;
  char *name;
  int logging;
  int exchange;     /* the host makes the steps (model exchange) */
  fmu_state *ahead; /* room for a look ahead, */
  double *before;   /* and for the row up to an event; 0: the host does not stop at events */
  int events, early; /* whether the host handles events, and lets steps return early */
  void (*between)(void); /* what it is told between communication points; 0: nothing */
} fmu_instance;

/* What a function of the standard begins with. */
#define FMU_ENTER(c) \
  fmu_instance *m = c; \
  if (!m) return (int)FMU_ERROR
#define FMU_NEED(condition, ...) \
  if (!(condition)) return fmu_log(m, FMU_ERROR, __VA_ARGS__)
#define FMU_ARRAYS(n, ...) FMU_NEED((n) == 0 || (__VA_ARGS__), "a NULL array was passed")
#define FMU_NONE(n, what) FMU_NEED((n) == 0, "there is no variable of type " what)
#if defined _WIN32
#define FMU_EXPORT __declspec(dllexport)
#else
#define FMU_EXPORT __attribute__((visibility("default")))
#endif

#define FMU_A(s, field) ((double *)((char *)(s) + sizeof(fmu_state)) + (s)->field)
#define FMU_INPUTS(s) ((fmu_input *)FMU_A(s, inputs))
#define FMU_SIM(s) ((tr_sim *)FMU_A(s, sim))
#define FMU_TICKS(s) ((fmu_tick *)FMU_A(s, ticks))

/* Entry points of the runtime. */
int tr_init(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int events);
int tr_refit(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int events);
double *tr_array(tr_sim *s, int which);
void tr_set_parameters(tr_sim *s);
void tr_configure(tr_sim *s, const tr_settings *set);
int tr_assemble(tr_sim *s, double t, const double *qgiven, const double *vgiven);
int tr_start(tr_sim *s, double t, double t_stop, double every, double *row);
int tr_row(tr_sim *s, double *row);
int tr_reach(tr_sim *s, double t, double limit, long max_steps, double *row);
int tr_reach_event(tr_sim *s, double t, double limit, long max_steps, double *row, double *before);
double tr_next_end(tr_sim *s, double limit);
int tr_within_zone(const tr_sim *s, int pair, double *turned);
int tr_cut(tr_sim *s, double t);
int tr_resume(tr_sim *s, int anew);
int tr_events_take(tr_sim *s);
int tr_why(tr_sim *s, int *pair);
int tr_fail_row(const tr_sim *s, double *number);
void tr_judge(const tr_sim *s, tr_judgement *out);
double tr_time(const tr_sim *s);
int tr_directional(tr_sim *s, const tr_linear *l, const tr_signal *inputs, const double *dy, double *rates, double *columns);
int tr_directional_in_modes(tr_sim *s, const tr_linear *l, const int *integral, const tr_signal *inputs, const double *dy, double *rates,
                            double *columns);
int tr_row_in_modes(tr_sim *s, double *row);
void tr_place(tr_sim *s, double t, const double *y);
const double *tr_rates_in_modes(tr_sim *s);
const double *tr_rates_known(const tr_sim *s);
const double *tr_arm_here(tr_sim *s);
const double *tr_told(const tr_sim *s);
double tr_nominal(const tr_sim *s, int i);
void tr_follow(tr_sim *s);
int tr_completed(tr_sim *s);
int tr_update(tr_sim *s, int jumped, int *changed);
double tr_next_break(const tr_sim *s);
double tr_break_after(const tr_sim *s, double t);
tr_input *tr_input_record(tr_sim *s, int input);
void tr_input_value(const tr_input *record, double t, tr_signal *value);
#endif
