/* Data of the shell: an exported model (constant, generated tables) and an instance (one relocatable block).
 *
 * All changing data lie in the block behind fmu_state; saving a state copies the block. Without global variables, a process can have any number
 * of instances in any threads. */
#ifndef FMU_H
#define FMU_H
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include "base/tolerances.h"
#include "hosts/hosts.h"

#define SAME_POINT 1e-9 /* relative to the communication step: nearer communication points count as the same */
#define FAR 1e4         /* communication steps: the run's own steps may reach so far ahead, even beyond a stop time */
#define MANY_STEPS 1e9  /* internal steps of a communication step: no limit */

#define FMU_STACK 256 /* stack depth of expressions (STACK of fmu/c_source/model_tables.py) */

/* Statuses with the numbers of both standards; value references. */
typedef int fmu_status;
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR };
typedef unsigned fmu_reference;

/* Meaning of a parameter. Its `index` counts engine parameters, coordinates, rates or inputs, by kind. */
enum fmu_setting_kind { FMU_NUMBER, FMU_START_Q, FMU_START_QD, FMU_BANDWIDTH, FMU_TOLERANCE, FMU_STEP, FMU_MAX_STEPS, FMU_HOST_TOLERANCE,
                        FMU_MOST_EVENTS, FMU_MOST_EVALUATIONS, FMU_MOST_ITERATIONS, FMU_ERRORS, FMU_PARAMETER };

/* Treatment of the host's tolerance: ignored; used when tighter; used. */
enum { FMU_HOST_ASIDE, FMU_HOST_TIGHTER, FMU_HOST_COUNTS };

/* Stack code of expressions: FMU_VALUE is followed by a number, FMU_SETTING by the index of a parameter. */
enum fmu_operation {
  FMU_VALUE, FMU_SETTING, FMU_ADD, FMU_SUBTRACT, FMU_MULTIPLY, FMU_DIVIDE, FMU_POWER, FMU_NEGATE, FMU_SIN, FMU_COS, FMU_TAN, FMU_ASIN,
  FMU_ACOS, FMU_ATAN, FMU_ATAN2, FMU_SQRT, FMU_ABS, FMU_MIN, FMU_MAX
};

/* A parameter. open: min is excluded; nonzero: zero is excluded. above: index of a parameter that bounds this one from below (strict: excluded), -1
 * for none. rotation: a quaternion begins here. name: path in the scene; key: last key of the path; rule: allowed values in words. */
typedef struct fmu_setting {
  int kind, index, also, tunable; /* also: another number with the same value; −1: none */
  double start, min, max;
  int open, nonzero, above, strict, rotation;
  const char *name, *key, *rule;
} fmu_setting;

/* An outcome of a run, in the words of engine/simulation/results/outcome.py. */
typedef struct fmu_outcome {
  int status;
  const char *name, *advice;
} fmu_outcome;

/* A loop by its cut joint: joint named for an end of reach, joint named for a gimbal, further text. */
typedef struct fmu_loop {
  const char *joint, *gimbal, *words;
} fmu_loop;

/* A rate of the tree: index, unit for comparison, joint. */
typedef struct fmu_rate {
  int index;
  double unit;
  const char *joint;
} fmu_rate;

/* Clocks of events (FMI 3.0), one for each joint and kind. last: column with the number of the last event's joint, -1 for none. of: for each pair,
 * then each stop, the clock of each kind of event; -1 for none. */
typedef struct fmu_clocks {
  int count, kinds, last;
  const int *of;
} fmu_clocks;

/* Error of an output. errs: it has one; jumps: it jumps at events; wraps: an angle modulo whole turns; tells: its size decides whether errors are
 * small; scale: size of its unit in the scene. */
typedef struct fmu_erring {
  int errs, jumps, wraps, tells;
  double scale;
} fmu_erring;

/* Use of an FMU or an instance. */
enum { FMU_COSIMULATION = 1, FMU_EXCHANGE = 2 };

typedef struct fmu_model {
  const char *guid, *name;
  int types; /* use: bits FMU_COSIMULATION, FMU_EXCHANGE */
  int outputs, inputs, derivatives, settings, followers; /* followers: the last settings, computed by expressions */
  const int *derivative; /* for derivative inputs: 2 · index of the input, + 1 for the second derivative */
  const int *whole;      /* 1 for each integer variable */
  const int *slope;      /* for outputs: index of the time derivative; −1: none; −2: discrete */
  const int *integral;   /* for outputs: 1 when made of works */
  const tr_kernel *kernel;
  const tr_outputs *columns;
  const tr_jacobian *jacobian;
  const tr_linear *linear;
  const double *p;      /* engine parameters */
  int nbreaks, ntables; /* lengths of `breaks` and `tables` */
  const double *breaks, *tables;
  const double *q, *v, *q_given, *v_given; /* start values; q_given, v_given: per freedom, 1 where the scene gives one */
  double length, rate, energy; /* scales of the tolerances */
  int method, bounded, through_jams, events, noutcomes; /* bounded: real-time steps; through_jams: a jammed pair stops by an impact */
  const fmu_setting *setting;
  const fmu_outcome *outcome;
  const fmu_outcome *why; /* outcomes of friction failures by reason (TR_WHY_…); ends with status −1 */
  const int *pair_joint, *eta_joint, *row_loop; /* index in `joint` for pairs and multipliers, in `loop` for constraint rows; −1: none */
  const fmu_loop *loop;
  int rates;
  const fmu_rate *moving;
  const char *const *joint_of; /* for pairs, then stops */
  const char *const *event;    /* words for events by kind */
  const double *code; /* stack code of all expressions; follower i: begin[i] to begin[i + 1] */
  const int *begin;
  int joints;
  const char *const *joint, *const *law; /* names of the joints with friction; texts of broken laws of the audit */
  const int *width;         /* for each reference: number of values, 0 inside an array; NULL: all scalar (FMI 2.0) */
  const int *type;          /* for each reference: FMU_FLOAT64, …; NULL in FMI 2.0 */
  const fmu_clocks *clocks; /* NULL in FMI 2.0 */
  const fmu_erring *erring; /* for outputs; NULL without errors */
  double tighter, larger;   /* tolerance / that of the second run; factor of the difference */
} fmu_model;

extern const fmu_model fmu_the_model;
#define MODEL (&fmu_the_model)

/* Changes of the host that the simulation has not applied. */
enum { FMU_NEW_INPUTS = 1, FMU_NEW_PARAMETERS = 2, FMU_NEW = FMU_NEW_INPUTS | FMU_NEW_PARAMETERS };

/* An input from the present communication point on: value; told: derivatives from fmi2SetRealInputDerivatives; given: derivatives as inputs. For
 * inputs of motions: last and before: values of the last changes; changes: number of consecutive communication points with changes. */
typedef struct fmu_input {
  double value, told[2], given[2];
  double last, last_t, before, before_t;
  double rate, curve;      /* mean rate between the last samples and its smoothed change, now and one sample before: */
  double rate_before, curve_before;
  double changes, derived; /* derived: highest derivative received: 0, 1 or 2 */
} fmu_input;

enum fmu_mode { FMU_INSTANTIATED, FMU_INITIALIZATION, FMU_STEPPING, FMU_TERMINATED, FMU_EVENTS, FMU_BETWEEN, FMU_CONTINUOUS, FMU_MODES };

/* Types of variables (FMI 3.0). */
enum fmu_type { FMU_FLOAT64, FMU_INT32, FMU_INT64, FMU_UINT64, FMU_BOOLEAN, FMU_CLOCK, FMU_STRING };

/* A clock: time of the last tick, s, number of ticks, whether it ticks now. */
typedef struct fmu_tick {
  double time, count, active;
} fmu_tick;

typedef struct fmu_state {
  size_t bytes;
  char guid[40];
  int mode;
  int known;   /* model exchange: derivatives and indicators are valid */
  int ready;   /* the row of outputs is valid at `time` */
  int changed; /* bits FMU_NEW_*: changes not yet applied */
  int told;    /* worst logged verdict of the audit */
  int failed;  /* status of the runtime that ended the run, 0 while it runs */
  int why;     /* its reason, if known (TR_WHY_…) */
  int tenths;  /* tenths of the agreed time that were logged */
  int stepped; /* status of the last communication step */
  int has_stop, has_tolerance, moved;
  double start, stop, tolerance, time, reached;
  double point; /* the communication point before `time` */
  int slower;   /* logged that a motion follows its input more slowly */
  int ticking;    /* a clock ticked since the host last handled events */
  int midway;     /* the last step ended before its communication point */
  int event;      /* at an event: the row of outputs is the one before it */
  double seen;    /* no event up to this time, without changes */
  double stride;  /* longest communication step so far */
  int certified;  /* outputs are their own errors: 1; -1: no longer valid */
  double apart;   /* last time at which both runs had the same number of events, s */
  int settings, trial, inputs, row, ticks, heard, given_up, sim, other, errors, second; /* offsets in doubles behind this struct */
} fmu_state;

/* Functions of the host: memory (NULL: the C library), logger (NULL: none), which `say` calls. */
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
  int exchange;     /* model exchange: the host makes the steps */
  fmu_state *ahead; /* memory for a look ahead, */
  double *before;   /* and for the row before an event; NULL: the host does not stop at events */
  int events, early; /* the host handles events; the host accepts early returns */
  void (*between)(void); /* callback between communication points, or NULL */
} fmu_instance;

/* First lines of a function of the standard. */
#define FMU_ENTER(c) \
  fmu_instance *m = c; \
  if (!m) return (int)FMU_ERROR
#define FMU_CALL(c, call) \
  FMU_ENTER(c); \
  return call
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
#endif
