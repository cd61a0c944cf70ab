/* Constants that several files use (runtime, lanes, FMUs; Python by engine/runtime/abi/header_constants.py), with unit and reason.
 * "× x" means that the constant is a factor on x. A constant of a single file is at the top of this file. Thresholds of the stick
 * event are in ``base/stick_rule.h``. */
#ifndef TR_TOLERANCES_H
#define TR_TOLERANCES_H

/* Mathematics and defaults. */
#define TURN 6.283185307179586 /* rad */
#define DEFAULT_RTOL 1e-6      /* default relative tolerance */
#define RUN_ERROR 10.0         /* × the tolerance: assumed error of a run's states, in the units of the states */

/* Tiny numbers in place of a zero divisor, so that quotients stay finite. */
#define NO_FORCE 1e-300    /* N: replaces a zero force, capacity or friction */
#define NO_PIVOT 1e-300    /* smallest pivot or determinant that may be a divisor */

/* Times. */
#define JUST_AFTER 1e-12        /* s: after a start, signals with kinks are evaluated this much later */
#define BREAK_REACHED 1e-10     /* × max(time, 1 s): a break closer than this counts as reached */
#define TIME_ROUND_OFF 8e-16    /* × the time: a smaller step would be lost in round-off */
#define LAST_ROW 1e-9           /* × the duration of the run: the run adds a row at its end if the last row is earlier by more */
#define STEP_START 1e-3         /* × a step: an event before this fraction counts as at the start */
#define STEP_END 0.999999       /* × a step: an event after this fraction counts as at the end */

/* Step sizes. */
#define GROW_MOST 6.0   /* largest ratio of successive steps */
#define NEAR_LIMIT 0.4 /* × h |λ| at the stability limit: accuracy of estimates of h |λ| at this limit */
#define SHRINK_MOST 0.2 /* smallest factor on a step; also the factor after a step that could not be evaluated */

/* Rank of loops and of rest conditions. */
#define KEEP_PIVOT 1e-9 /* × a row's scale: smallest pivot within the stored rank; so small that runs pass bifurcations (theory) */
/* × a row's scale: smallest pivot that increases the stored rank; above a step's error in a redundant row */
#define GROW_PIVOT 1e-6
#define RANK_PIVOT 1e-9 /* × the response of a row or freedom to itself: at accurate states, a smaller pivot means dependence */

/* Closure of loops. "Length" is the length scale of the run. */
#define LOOP_CLOSED 4e-15     /* × the length, or rad; for rates × length · rate: round-off of a closed loop */
#define LOOP_OPEN 1e-8        /* × the length, or rad: with a larger residual after all iterations, the loops cannot be closed */
/* × the length, or rad: in mechanisms with many loops, a correction of a smaller residual is the last one, because it squares the
 * residual */
#define LOOP_NEARLY_CLOSED 1e-8
#define CLOSURE_SHRINKS 0.2   /* × the previous residual: an iteration that leaves more has reached round-off */
#define CLOSURE_STEPS 12      /* largest number of iterations on positions, which converge quadratically from any end of a step */
#define CLOSURE_RATE_STEPS 3  /* largest number of iterations on rates, whose equations are linear */

/* Newton's method on the complement equations. */
#define NEWTON_MAX 30         /* iterations; two to five are usual */
#define NEWTON_EXACT 1e-15    /* × the largest friction: a smaller step is round-off */
/* × the largest friction: a step below this is the last, because the next (quadratic) step would be round-off */
#define NEWTON_QUADRATIC 1e-7
#define NEWTON_SHRINKS 0.1    /* × the previous step: NEWTON_QUADRATIC applies only to a step that shrank to this */
#define NO_LOAD 1e-9          /* N or N m: smallest load that serves as a scale for other loads */
#define CREEP_MOVES 1e3       /* × the last ε of a creep minimisation: a pair with a larger acceleration slides */
#define BY_CONE 0.25          /* × s²/|ω|²: within this distance from its cone, a ball may have several roots */
/* × the largest friction: a smaller friction is round-off; friction of unloaded gear teeth reaches this value */
#define ROUND_OFF_FRICTION 1e-11
#define NO_CAPACITY 1e-12     /* N or N m: smallest capacity; keeps ratios finite */

/* Largest violation of a mode by a pair or stop at the end of a step. The order TOL_SPEED (stick_rule.h) < REST_SPEED = TOL_RESOLVE
 * < TOL_RELEASE prevents a decision that causes a new event at once. */
#define TOL_RESOLVE 1e-11 /* × the friction ratio; for accelerations × length · rate²: tolerance of decisions */
#define TOL_RELEASE 1e-10 /* × the friction ratio: excess over the capacity at which a held pair is released */
/* × the distance of a maximum from release: if an iteration changes the maximum by less, it does not reach release */
#define TOP_SURE 0.01
#define TOL_CONE 1e-10    /* s²/|ω|²: tolerance of the border between a sliding and a spinning ball */
#define TOL_KINK 1e-9     /* × the kink speed: tolerance of the crossing of the kink */
#define TOL_STOP 1e-12    /* m or rad: depth tolerance of the contact of a stop */
/* × energy over length: larger pull at which a joint that only pushes opens; above round-off of normal forces */
#define TOL_LIFT 1e-12
#define EVENT_CLOSE 10.0  /* × the event's tolerance: largest distance from the event after its time is refined with closed loops */

/* Rest. */
/* × the sum of absolute terms of an acceleration: a pair at rest with a larger acceleration moves, although loops should hold it */
#define REST_BROKEN 1e-7
#define HELD_SPEED 1e-12   /* × the speed unit: largest speed of a held pair by round-off of loop closure */
#define POWER_GIVEN 1e-6   /* × friction · speed: a larger power of friction that drives a pair is an error, not round-off */
#define FAINT_RATIO 1e-5   /* × the acceleration by friction: the direction of a smaller acceleration has no meaning */
/* × the capacity: least reserve of a stuck pair after loads are shared again; with less, sharing would repeat without end */
#define KEPT_GAIN 1e-7
#define DECISION_STEPS 40  /* largest number of mode changes from one start; a longer search repeats earlier modes */
/* largest margin of an event; also the margin of a pair without load, or of a threshold exceeded by far */
#define CLEAR_MARGIN 1.0

/* Norms of frozen sliding directions. */
/* norm of a direction frozen in the first step: so large that adding a velocity changes nothing but round-off */
#define TR_FROZEN 1e126
#define STILL_FROZEN 1e-6 /* × TR_FROZEN: smallest norm of a frozen direction, for any unit vector and any levers */
#define ON_LINE 1e144     /* norm that marks motion along a line: above TR_LINE for any unit vector and any levers */
#define LINE_WIDTH 1e-9   /* × the speed: smaller components perpendicular to the line are round-off */
#define LINE_LEFT POWER_GIVEN /* × the speed: with a larger component perpendicular to the line, the pair has left the line */
#define TURN_TRIED 1e-6   /* rad: step of finite differences; keeps about half of the digits of a double */

/* Folds of friction. */
#define FOLD_JUMP 0.02 /* × a pair's friction before and after an event: a smaller change is not caused by a fold */

/* Derivatives by finite differences. */
#define DIFFERENCE_STEP 1e-6 /* × the scales of the state: central differences then have an error of 1e-12 and round-off of 1e-10 */
#define NO_DIRECTION 1e-12   /* × the scales of the state: a smaller direction counts as zero */

/* Steps for real time. */
#define SWEEPS 6              /* sweeps over all pairs in a relaxed step; each costs as much as a Newton iteration */
#define IMPULSE_EVALUATIONS 4 /* additional evaluations for an impulse step or a row */
#define ROW_ITERATIONS 8      /* additional iterations for a row; usually one or two suffice directly after a solution */
#endif
