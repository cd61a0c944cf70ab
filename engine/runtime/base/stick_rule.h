/* The only place that decides when a sliding pair sticks. Events, decisions, checks and the vector lanes
 * (engine/kernel/simd_lanes), which read this file with a vector for each double, call these functions. Surface speeds and
 * their unit (tr_speed_unit) are in m/s. Theory, "Tolerances", explains how the thresholds depend on each other. */
#ifndef TR_STICK_RULE_H
#define TR_STICK_RULE_H

#define TOL_SPEED 1e-13    /* × the unit: distance beyond the end of sliding that a step may overlook; below REST_SPEED */
#define REST_SPEED 1e-11   /* × the unit: at rest; above round-off of a speed set to zero */
#define NEAR_MISS 1e-10    /* × the unit: a turn by more than a right angle at a higher speed is no stick event; the step is too large */
#define CAPTURE_SPEED 1e-8 /* × the unit: slower sliding of several components may stop at once; above round-off of loops */

/* Distance beyond the end of sliding of a velocity along the frozen direction, in tolerances; above 1 it is a stick event. */
static inline double tr_stick_overshoot(double speed, double unit) { return -speed / (unit * TOL_SPEED); }

/* Speed beyond the end of sliding that counts as its end. */
static inline double tr_stick_tolerance(double unit) { return TOL_SPEED * unit; }

/* Largest speed of a pair at rest. */
static inline double tr_rest_speed(double unit) { return REST_SPEED * unit; }

/* Largest speed at which reversed sliding has come to its end. */
static inline double tr_crawl_speed(double unit) { return NEAR_MISS * unit; }

/* Largest speed at which a last step may end sliding of several components (``events/end_of_sliding.c``; model exchange). */
static inline double tr_last_speed(double unit) { return CAPTURE_SPEED * unit; }
#endif
