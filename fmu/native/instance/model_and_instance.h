/* Data of the FMI functions (the shell). An exported model consists of constant, generated tables. An instance has one relocatable
 * block of memory.
 *
 * The block begins with fmu_state and contains all data that change. A state is saved by copying the block. There are no global
 * variables, so a process can have any number of instances in any threads. */
#ifndef FMU_H
#define FMU_H
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include "base/tolerances.h"
#include "hosts/hosts.h"

#define SAME_POINT 1e-9 /* relative to the communication step: times at most this far apart count as the same communication point */
#define LOOKAHEAD_STEPS 1e4 /* internal steps may reach this many communication steps ahead, even beyond a stop time */
#define MANY_STEPS 1e9  /* a limit of this many internal steps in a communication step means no limit */

#define SOURCE_VALUES 3 /* a source of an input has a value and two derivatives */
#define FMU_STACK 256 /* stack depth of expressions (STACK of fmu/c_source/model_tables.py) */

/* Statuses, with the numbers that FMI 2.0 and 3.0 give them, and value references. */
typedef int fmu_status;
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR };
typedef unsigned fmu_reference;

/* Kinds of parameters. Depending on the kind, the `index` of a parameter counts the engine parameters, the coordinates, the rates
 * or the inputs. */
enum fmu_setting_kind { FMU_NUMBER, FMU_START_Q, FMU_START_QD, FMU_BANDWIDTH, FMU_TOLERANCE, FMU_STEP, FMU_MAX_STEPS, FMU_HOST_TOLERANCE,
                        FMU_MOST_EVENTS, FMU_MOST_EVALUATIONS, FMU_MOST_ITERATIONS, FMU_ERRORS, FMU_PARAMETER };

/* When the run uses the host's tolerance: never; only if it is tighter than solver.tolerance; always. */
enum { FMU_HOST_ASIDE, FMU_HOST_TIGHTER, FMU_HOST_COUNTS };

/* Operations in the stack code of expressions. FMU_VALUE is followed by a number, FMU_SETTING by the index of a parameter. */
enum fmu_operation {
  FMU_VALUE, FMU_SETTING, FMU_ADD, FMU_SUBTRACT, FMU_MULTIPLY, FMU_DIVIDE, FMU_POWER, FMU_NEGATE, FMU_SIN, FMU_COS, FMU_TAN, FMU_ASIN,
  FMU_ACOS, FMU_ATAN, FMU_ATAN2, FMU_SQRT, FMU_EXP, FMU_LOG, FMU_TANH, FMU_ABS, FMU_MIN, FMU_MAX
};

/* A parameter. open: whether min is excluded. nonzero: whether zero is excluded. above: index of the parameter whose value is a
 * lower bound of this parameter, -1 if there is none. strict: whether that bound is excluded. rotation: whether this is the first
 * component of a quaternion. name: path in the scene. key: last key of the path. rule: description of the allowed values. */
typedef struct fmu_setting {
  int kind, index, also, tunable; /* also: index of another engine parameter with the same value, or −1 */
  double start, min, max;
  int open, nonzero, above, strict, rotation;
  const char *name, *key, *rule;
} fmu_setting;

/* An outcome of a run, with the texts of engine/simulation/results/outcome.py. */
typedef struct fmu_outcome {
  int status;
  const char *name, *advice;
} fmu_outcome;

/* A loop. joint: joint in the message that the loop cannot close. gimbal: joint in the message about a gimbal lock. words: further
 * text of these messages. */
typedef struct fmu_loop {
  const char *joint, *gimbal, *words;
} fmu_loop;

/* A rate of a tree joint. index: position among the rates. unit: factor that makes rates comparable. joint: name of the joint. */
typedef struct fmu_rate {
  int index;
  double unit;
  const char *joint;
} fmu_rate;

/* Clocks of events (FMI 3.0), one for each joint and kind of event. last: output column with the number of the last event's joint,
 * -1 if there is no such column. of: index of the clock of each kind of event, first for each friction pair, then for each end
 * stop; -1 if there is no clock. */
typedef struct fmu_clocks {
  int count, kinds, last;
  const int *of;
} fmu_clocks;

/* Properties of the error of an output. errs: whether the output has an error estimate. jumps: whether the output jumps at events.
 * wraps: whether the output is an angle modulo 2*pi. tells: whether the estimates of all outputs are valid only while the error of
 * this output is small. scale: size of the output's unit in the scene. */
typedef struct fmu_erring {
  int errs, jumps, wraps, tells;
  double scale;
} fmu_erring;

/* One of the sources of an input: the input is the sum of factor * value + offset over its sources. to: index of the input in the
 * order of value references. start: start value of the source. */
typedef struct fmu_source {
  int to;
  double factor, offset, start;
} fmu_source;

/* FMI type of an FMU or an instance. */
enum { FMU_COSIMULATION = 1, FMU_EXCHANGE = 2 };

typedef struct fmu_model {
  const char *guid, *name;
  int types; /* bits FMU_COSIMULATION, FMU_EXCHANGE */
  int outputs, inputs, derivatives, settings, followers; /* followers: number of last settings, which expressions compute */
  const int *derivative; /* for each derivative input: 2 · index of its input, + 1 for the second derivative */
  const int *whole;      /* for each variable: 1 for an integer variable, else 0 */
  const int *slope;      /* for each output: index of its time derivative among the outputs; −1: none; −2: discrete output */
  const int *integral;   /* for each output: 1 if computed from integrated powers (works), else 0 */
  const tr_kernel *kernel;
  const tr_outputs *columns;
  const tr_jacobian *jacobian;
  const tr_linear *linear;
  const double *p;      /* engine parameters */
  int nbreaks, ntables; /* number of breaks (`tr_break`); length of `tables` */
  const double *breaks, *tables;
  const double *q, *v, *q_given, *v_given; /* start values; …_given: 0 open, 1 given, 2 exact */
  double length, rate, energy; /* scales of the tolerances */
  int method, bounded, through_jams, events, noutcomes; /* bounded: real-time steps; through_jams: an impact stops a jammed pair */
  const fmu_setting *setting;
  const fmu_outcome *outcome;
  const fmu_outcome *why; /* outcomes of friction failures by reason (TR_WHY_…); the last record has the status −1 */
  const int *pair_joint, *eta_joint, *row_loop; /* by pair or multiplier: index in `joint`; by row: index in `loop`; −1: none */
  const fmu_loop *loop;
  int rates;
  const fmu_rate *moving;
  const char *const *joint_of; /* name of the joint of each friction pair, then of each end stop */
  const char *const *event;    /* names of events by kind */
  const double *code; /* stack code of all expressions; the code of follower i is from begin[i] to begin[i + 1] */
  const int *begin;
  int joints;
  const char *const *joint, *const *law; /* joint: names of the joints with friction; law: texts about violated laws of the audit */
  const int *width;         /* for each reference: number of values, 0 inside an array; NULL in FMI 2.0, which has no arrays */
  const int *type;          /* for each reference: type, such as FMU_FLOAT64; NULL in FMI 2.0 */
  const fmu_clocks *clocks; /* NULL in FMI 2.0 */
  const fmu_erring *erring; /* for each output; NULL without error estimates */
  double tighter, larger;   /* tolerance of the run / tolerance of the second run; error / difference of the two runs */
  int sources;
  const fmu_source *source; /* the sources of inputs that are sums */
  const int *costly;        /* for each output: 1 if rows may omit it, else 0 */
} fmu_model;

extern const fmu_model fmu_the_model;
#define MODEL (&fmu_the_model)

/* Changes by the host that the simulation has not applied. */
enum { FMU_NEW_INPUTS = 1, FMU_NEW_PARAMETERS = 2, FMU_NEW = FMU_NEW_INPUTS | FMU_NEW_PARAMETERS };

/* Outputs that a host has not read yet: all outputs, and the costly outputs, which rows may omit. */
enum { FMU_ROW = 1, FMU_COSTLY = 2 };

/* An input, valid from the present communication point on. told: derivatives from fmi2SetRealInputDerivatives. given: derivatives
 * from derivative inputs. A motion that follows the input uses the other fields. last, before: values at the last two changes.
 * last_t, before_t: times of these changes, s. changes: number of consecutive communication points with changes. */
typedef struct fmu_input {
  double value, told[2], given[2];
  double last, last_t, before, before_t;
  double rate, curve;      /* mean rate between the last two samples; smoothed derivative of the rate */
  double rate_before, curve_before; /* rate and curve one sample before */
  double changes, derived; /* derived: highest order of a received derivative, 0 for none */
  double swing, swings;    /* the last acceleration; number of consecutive samples at which it grew and changed its sign */
} fmu_input;

enum fmu_mode { FMU_INSTANTIATED, FMU_INITIALIZATION, FMU_STEPPING, FMU_TERMINATED, FMU_EVENTS, FMU_BETWEEN, FMU_CONTINUOUS, FMU_MODES };

/* Types of variables (FMI 3.0). */
enum fmu_type { FMU_FLOAT64, FMU_INT32, FMU_INT64, FMU_UINT64, FMU_BOOLEAN, FMU_CLOCK, FMU_STRING };

/* A clock. time: time of the last tick, s. count: number of ticks. active: whether the clock ticks now. */
typedef struct fmu_tick {
  double time, count, active;
} fmu_tick;

typedef struct fmu_state {
  size_t bytes;
  char guid[40];
  int mode;
  int known;   /* model exchange: state derivatives and event indicators are valid */
  int ready;   /* the row of outputs is valid at `time`, or deferred */
  int deferred; /* bits FMU_ROW, FMU_COSTLY: outputs that are computed when the host reads one of them */
  int changed; /* bits FMU_NEW_*: changes not yet applied */
  int told;    /* worst audit verdict that has been logged */
  int failed;  /* status with which the runtime ended the run, 0 while the run continues */
  int why;     /* reason of the status `failed`, if known (TR_WHY_…) */
  int tenths;  /* number of tenths of the run whose progress has been logged */
  int stepped; /* status of the last communication step */
  int has_stop, has_tolerance, moved;
  double start, stop, tolerance, time, reached;
  double point; /* the communication point before `time` */
  int slower;   /* whether the message that a motion follows its input more slowly has been logged */
  int ticking;    /* whether a clock ticked since the host last handled events */
  int midway;     /* whether the last step ended before its communication point */
  int event;      /* whether the run is at an event; the outputs are then the values just before the event */
  double seen;    /* no event happens up to this time, s, unless the host changes something */
  double stride;  /* longest communication step so far */
  int certified;  /* the number that a host reads as an output. 1: error estimate; -1: NaN (the estimates are invalid); 0: value */
  double apart;   /* last time at which both runs had the same number of events, s */
  int settings, trial, inputs, sources, row, ticks, heard, given_up, sim, other, errors, second; /* offsets behind this struct, doubles */
} fmu_state;

/* Functions of the host. say: function that formats a message for
 * `logger`. */
typedef struct fmu_host {
  void (*say)(const struct fmu_host *host, const char *name, fmu_status status, const char *category, char *text);
  void (*logger)(void);
  void *environment;
} fmu_host;

typedef struct fmu_instance {
  fmu_host host;
  fmu_state *state;
  char *name;
  int logging;
  int exchange;     /* whether the instance is for model exchange, in which the host makes the steps */
  fmu_state *ahead; /* memory for the copy of the run in a look-ahead; NULL if the host does not stop at events */
  double *before;   /* memory for the row just before an event; NULL if the host does not stop at events */
  int events, early; /* whether the host handles events; whether the host accepts early returns */
  void (*between)(void); /* callback between communication points, or NULL */
} fmu_instance;

/* First lines of an FMI function. */
#define FMU_ENTER(c) \
  fmu_instance *m = c; \
  if (!m) return (int)FMU_ERROR
#define FMU_CALL(c, call) \
  FMU_ENTER(c); \
  return call
#define FMU_NEED(condition, ...) \
  if (!(condition)) return fmu_log(m, FMU_ERROR, __VA_ARGS__)
#define FMU_ARRAYS(n, ...) FMU_NEED((n) == 0 || (__VA_ARGS__), "an array argument is NULL, but its length is not 0")
#define FMU_NONE(n, what) FMU_NEED((n) == 0, "this FMU has no variables of type " what)

#define FMU_A(s, field) ((double *)((char *)(s) + sizeof(fmu_state)) + (s)->field)
#define FMU_INPUTS(s) ((fmu_input *)FMU_A(s, inputs))
#define FMU_SIM(s) ((tr_sim *)FMU_A(s, sim))
#define FMU_TICKS(s) ((fmu_tick *)FMU_A(s, ticks))
#endif
