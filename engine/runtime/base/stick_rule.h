/* The only file that decides when a sliding pair sticks. Events, decisions, checks and the SIMD lanes (engine/kernel/simd_lanes)
 * call its functions. The lanes compile this file with a vector in place of each double. Surface speeds and their unit
 * (tr_speed_unit) are in m/s. The section "Tolerances" of the theory explains how the thresholds depend on each other. */
#ifndef TR_STICK_RULE_H
#define TR_STICK_RULE_H

/* relative to the speed unit: largest overshoot beyond the end of sliding that causes no event; smaller than REST_SPEED */
#define TOL_SPEED 1e-13
/* relative to the speed unit: largest speed at rest; above the round-off of a speed that was set to zero */
#define REST_SPEED 1e-11
/* relative to the speed unit: if a faster pair turns by more than 90° in a step, the step is refused */
#define NEAR_MISS 1e-10
/* relative to the speed unit: below this speed, sliding with several components may end at once; above the round-off of loops */
#define CAPTURE_SPEED 1e-8

/* Overshoot beyond the end of sliding, in units of the tolerance; a value above 1 is a stick event. speed: velocity along the
 * frozen direction. */
static inline double tr_stick_overshoot(double speed, double unit) { return -speed / (unit * TOL_SPEED); }

/* Largest overshoot, m/s, that still counts as the end of sliding. */
static inline double tr_stick_tolerance(double unit) { return TOL_SPEED * unit; }

/* Largest speed of a pair at rest, m/s. */
static inline double tr_rest_speed(double unit) { return REST_SPEED * unit; }

/* Largest speed at which a pair whose direction reversed counts as stopped, m/s. */
static inline double tr_crawl_speed(double unit) { return NEAR_MISS * unit; }

/* Largest speed, m/s, from which one step may end sliding with several components (``events/capture_at_end_of_sliding.c``; model
 * exchange). */
static inline double tr_last_speed(double unit) { return CAPTURE_SPEED * unit; }
#endif
