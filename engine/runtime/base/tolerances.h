/* Constants that several files use (runtime, lanes, FMUs; Python by engine/runtime/abi/header_constants.py), with unit and reason.
 * A constant "relative to x" or "in units of x" is a factor on x. A constant that a single file uses is at the top of that file.
 * Thresholds of the stick event are in ``base/stick_rule.h``. */
#ifndef TR_TOLERANCES_H
#define TR_TOLERANCES_H

/* Mathematics and defaults. */
#define TURN 6.283185307179586 /* rad */
#define DEFAULT_RTOL 1e-6      /* default relative tolerance */
#define RUN_ERROR 10.0         /* relative to the tolerance: assumed error of a run's states, in the units of the states */

/* Tiny numbers in place of a zero divisor, so that quotients stay finite. */
#define NO_FORCE 1e-300    /* N: replaces a zero force, capacity or friction */
#define NO_PIVOT 1e-300    /* smallest pivot or determinant that may be a divisor */

/* Times. */
#define JUST_AFTER 1e-12        /* s: at the start of a run, signals with kinks are evaluated at a time later by this */
#define BREAK_REACHED 1e-10     /* relative to max(time, 1 s): a break closer than this counts as reached */
#define TIME_ROUND_OFF 8e-16    /* relative to the time: a smaller step would be lost in round-off */
/* relative to the duration of the run: if the last row precedes the end by more, a row at the end is added */
#define LAST_ROW 1e-9
#define STEP_START 1e-3         /* fraction of a step: an earlier event counts as an event at the step's start */
#define STEP_END 0.999999       /* fraction of a step: a later event counts as an event at the step's end */

/* Step sizes. */
#define GROW_MOST 6.0   /* largest ratio of successive steps */
#define NEAR_LIMIT 0.4 /* relative to h |λ| at the stability limit: stability limits a step whose estimate of h |λ| is larger */
#define SHRINK_MOST 0.2 /* smallest factor on a step; also the factor after a step that could not be evaluated */

/* Rank of loops and of rest conditions. */
/* relative to a row's scale: smallest pivot within the stored rank; small enough that runs pass bifurcations (theory) */
#define KEEP_PIVOT 1e-9
/* relative to a row's scale: smallest pivot that increases the stored rank; above a step's error in a redundant row */
#define GROW_PIVOT 1e-6
/* relative to the response of a row or freedom to its own multiplier. At an accurate state, a smaller pivot shows a dependent row
 * or freedom. */
#define RANK_PIVOT 1e-9

/* Closure of loops. "Length" is the length scale of the run. */
/* relative to the length, or rad; for rates, in units of length · rate: a smaller residual of a loop is round-off */
#define LOOP_CLOSED 4e-15
/* relative to the length scale, or rad: with a larger residual after all iterations, the loops cannot be closed */
#define LOOP_OPEN 1e-8
/* relative to the length scale, or rad: with many loops, the correction of a smaller residual is the last one. (Each correction
 * squares the residual.) */
#define LOOP_NEARLY_CLOSED 1e-8
/* relative to the previous residual: if an iteration leaves a larger residual, the residual is round-off */
#define CLOSURE_SHRINKS 0.2
#define CLOSURE_STEPS 12      /* largest number of iterations on positions, which converge quadratically from any end of a step */
#define CLOSURE_RATE_STEPS 3  /* largest number of iterations on rates, whose equations are linear */

/* Newton's method on the complement equations. */
#define NEWTON_MAX 30         /* iterations; two to five are usual */
#define NEWTON_EXACT 1e-15    /* relative to the largest friction: a smaller step is round-off */
/* relative to the largest friction: a smaller step is the last one, because the next step would be quadratically smaller, and so
 * round-off */
#define NEWTON_QUADRATIC 1e-7
#define NEWTON_SHRINKS 0.1    /* relative to the previous step: NEWTON_QUADRATIC applies only to a smaller step */
#define NO_LOAD 1e-9          /* N or N m: smallest load that serves as a scale for other loads */
#define CREEP_MOVES 1e3       /* relative to the last ε of a creep minimisation: a pair with a larger acceleration slides */
#define BY_CONE 0.25          /* distance s²/|ω|² of a ball from its cone: at a smaller distance, friction may have several roots */
/* relative to the largest friction: a smaller friction is round-off; the round-off friction of unloaded gear teeth reaches this
 * value */
#define ROUND_OFF_FRICTION 1e-11
#define NO_CAPACITY 1e-12     /* N or N m: smallest capacity; keeps ratios finite */

/* Largest violation of a mode by a pair or stop at the end of a step. The order TOL_SPEED (stick_rule.h) < REST_SPEED = TOL_RESOLVE
 * < TOL_RELEASE prevents a decision that causes a new event at once. */
/* relative to the friction ratio; for accelerations, in units of length · rate²: tolerance of decisions */
#define TOL_RESOLVE 1e-11
#define TOL_RELEASE 1e-10 /* relative to the friction ratio: excess over the capacity at which a held pair is released */
/* relative to the distance of a maximum from release: if an iteration changes the maximum by less, the maximum does not reach
 * release */
#define TOP_SURE 0.01
#define TOL_CONE 1e-10    /* tolerance of the distance s²/|ω|² at the border between a sliding and a spinning ball */
#define TOL_KINK 1e-9     /* relative to the kink speed: tolerance of the speed at which a pair crosses its kink */
#define TOL_STOP 1e-12    /* m or rad: tolerance of the depth at which a stop touches */
/* in units of energy over length: at a larger pull, a joint that only pushes opens; above the round-off of normal forces */
#define TOL_LIFT 1e-12
/* relative to the event's tolerance: largest distance from the event after its time is refined with closed loops */
#define EVENT_CLOSE 10.0

/* Rest. */
/* relative to the sum of absolute terms of an acceleration: a pair at rest with a larger acceleration moves, although loops should
 * hold it */
#define REST_BROKEN 1e-7
#define HELD_SPEED 1e-12   /* relative to the speed unit: largest speed of a held pair that round-off of loop closure causes */
/* in units of friction · speed: if friction drives a pair with a larger power, this power is an error, not round-off */
#define POWER_GIVEN 1e-6
#define FAINT_RATIO 1e-5   /* relative to the acceleration by friction: the direction of a smaller acceleration has no meaning */
/* relative to the capacity: least reserve of a stuck pair after loads are shared again; with a smaller reserve, sharing would
 * repeat without end */
#define KEPT_GAIN 1e-7
#define DECISION_STEPS 40  /* largest number of mode changes from one start; a longer search repeats earlier modes */
/* largest margin of an event; also the margin of a pair without load, or of a threshold exceeded by far */
#define CLEAR_MARGIN 1.0

/* Norms of frozen sliding directions. */
/* norm of a direction frozen in the first step: so large that adding a velocity to the direction changes the direction only by
 * round-off */
#define TR_FROZEN 1e126
#define STILL_FROZEN 1e-6 /* relative to TR_FROZEN: every frozen direction has a larger norm, whatever the levers */
#define ON_LINE 1e144     /* norm that marks motion along a line: above TR_LINE, whatever the levers */
#define LINE_WIDTH 1e-9   /* relative to the speed: smaller components perpendicular to the line are round-off */
/* relative to the speed: with a larger component perpendicular to the line, the pair has left the line */
#define LINE_LEFT POWER_GIVEN
#define TURN_TRIED 1e-6   /* rad: step of finite differences; keeps about half of the digits of a double */

/* Folds of friction. */
#define FOLD_JUMP 0.02 /* relative to a pair's friction before and after an event: a smaller change is not caused by a fold */

/* Derivatives by finite differences. */
/* relative to the scales of the state: central differences then have an error of 1e-12 and round-off of 1e-10 */
#define DIFFERENCE_STEP 1e-6
#define NO_DIRECTION 1e-12   /* relative to the scales of the state: a smaller direction counts as zero */

/* Steps for real time. */
#define SWEEPS 6              /* sweeps over all pairs in a relaxed step; each costs as much as a Newton iteration */
#define IMPULSE_EVALUATIONS 4 /* additional evaluations for an impulse step or a row */
#define ROW_ITERATIONS 8      /* additional iterations for a row; usually one or two suffice directly after a solution */
#endif
