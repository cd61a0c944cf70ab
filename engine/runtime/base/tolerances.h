/* Constants that several files use (runtime, lanes, FMUs, Python: engine/runtime/abi/tolerances.py), with unit and reason. "×
 * x" means a factor on x. A constant of one file stands at the top of that file. Thresholds of the stick event stand in
 * ``base/stick_rule.h``. */
#ifndef TR_TOLERANCES_H
#define TR_TOLERANCES_H

/* Mathematics and defaults. */
#define TURN 6.283185307179586 /* rad */
#define DEFAULT_RTOL 1e-6      /* relative tolerance without a choice of the host */
#define RUN_ERROR 10.0         /* × the tolerance: error of a run's states in their units */

/* Tiny numbers that replace a zero divisor, so that quotients stay finite. */
#define NO_FORCE 1e-300    /* N: replaces a zero force, capacity or size */
#define NO_PIVOT 1e-300    /* smallest pivot or determinant to divide by */

/* Times. */
#define JUST_AFTER 1e-12        /* s: signals with kinks are read this much after a start */
#define BREAK_REACHED 1e-10     /* s, × the time: distance from a break that counts as reached */
#define TIME_ROUND_OFF 8e-16    /* × the time: a smaller step has no effect */
#define LAST_ROW 1e-9           /* × the run: a larger distance of the last row from the end requires a row at the end */
#define STEP_START 1e-3         /* × a step: an earlier event belongs to its start */
#define STEP_END 0.999999       /* × a step: a later event belongs to its end */

/* Step sizes. */
#define GROW_MOST 6.0   /* largest ratio of successive steps */
#define SHRINK_MOST 0.2 /* smallest factor on a step; the factor itself if the step could not be evaluated */

/* Rank of loops and of rest conditions. */
#define KEEP_PIVOT 1e-9 /* × a row's scale, within the remembered rank: passes bifurcations at every tolerance (theory, "Redundant loops") */
#define GROW_PIVOT 1e-6 /* × a row's scale, beyond that rank: above the step's error in a redundant row */
#define RANK_PIVOT 1e-9 /* × the own response of a row or freedom, at accurate states: dependent below */

/* Closure of loops. */
#define LOOP_CLOSED 4e-15     /* × the length (rad), × length · rate: round-off of a closed loop */
#define LOOP_OPEN 1e-8        /* × the length (rad): residual after all iterations of loops that cannot be closed */
#define LOOP_NEARLY_CLOSED 1e-8 /* × the length (rad), many loops: one more correction leaves its square, round-off; maps also serve for the rates */
#define CLOSURE_SHRINKS 0.2   /* × the last residual: an iteration that leaves more has reached round-off */
#define CLOSURE_STEPS 12      /* iterations on positions; quadratic from any end of a step */
#define CLOSURE_RATE_STEPS 3  /* iterations on rates, which are linear */

/* Newton's method on the complement equations. */
#define NEWTON_MAX 30         /* iterations; two to five are usual */
#define NEWTON_EXACT 1e-15    /* × the largest friction: a step of round-off */
#define NEWTON_QUADRATIC 1e-7 /* × the largest friction: the next step would be its square, round-off */
#define NEWTON_SHRINKS 0.1    /* × the last step: required for NEWTON_QUADRATIC */
#define NO_LOAD 1e-9          /* N or N m: smallest load that scales others */
#define CREEP_MOVES 1e3       /* × the last ε of a creep: a pair with a larger acceleration slides */
#define NO_CAPACITY 1e-12     /* N or N m: smallest capacity, so that shares exist */

/* Largest violation of a mode by a pair or stop at the end of a step. TOL_SPEED (stick_rule.h) < REST_SPEED = TOL_RESOLVE <
 * TOL_RELEASE, so that a decision is not an event again at once. */
#define TOL_RESOLVE 1e-11 /* × the friction ratio, × length · rate²: in decisions */
#define TOL_RELEASE 1e-10 /* × the friction ratio */
#define TOL_CONE 1e-10    /* × s²/|ω|²: border between sliding and spinning of a ball */
#define TOL_KINK 1e-9     /* × the kink speed */
#define TOL_STOP 1e-12    /* m (rotations: rad) */
#define EVENT_CLOSE 10.0  /* × these tolerances: distance from its event of a state refined with closed loops */

/* Rest. */
#define REST_BROKEN 1e-7   /* × the accelerations that cancel: larger ones mean that a dependent pair is not at rest */
#define HELD_SPEED 1e-12   /* × the speed unit: round-off of closing the loops */
#define POWER_GIVEN 1e-6   /* × friction · speed: largest power of a pair's component against the others */
#define FAINT_RATIO 1e-5   /* × the acceleration by friction: smaller accelerations have no direction */
#define DECISION_STEPS 40  /* mode changes from one start; a longer search cycles */
#define CLEAR_MARGIN 1.0   /* largest margin of an event: a pair without load, a threshold exceeded by far */

/* Lengths of frozen sliding directions. */
#define TR_FROZEN 1e126   /* first step: outweighs any velocity by more than a double's digits (its share there is 1e-120) */
#define STILL_FROZEN 1e-6 /* × TR_FROZEN: shortest frozen direction, with any unit vector and levers */
#define ON_LINE 1e144     /* motion along a line: longer than TR_LINE with any unit vector and levers */
#define LINE_WIDTH 1e-9   /* × the speed: smaller speed across the line is round-off */
#define LINE_LEFT POWER_GIVEN /* × the speed: with more across, the line has been left */
#define TURN_TRIED 1e-6   /* rad: step of derivatives by differences, half of a double's digits */

/* Folds of friction. */
#define FOLD_JUMP 0.02 /* × a pair's friction before and after: a smaller change is no fold, the steps failed for another reason */

/* Derivatives by differences. */
#define DIFFERENCE_STEP 1e-6 /* × the scales of the state: error of central differences 1e-12, round-off 1e-10 */
#define NO_DIRECTION 1e-12   /* × these scales: a zero direction */

/* Steps for real time. */
#define SWEEPS 6              /* sweeps over all pairs in a relaxed step, each at the cost of an iteration */
#define IMPULSE_EVALUATIONS 4 /* additional evaluations for an impulse step or a row */
#define ROW_ITERATIONS 8      /* additional iterations for a row; one or two are usual just after a solution */
#endif
