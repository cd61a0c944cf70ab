/* Stage `integrators`: steps of the methods, their errors, dense output and works. */
#ifndef TR_INTEGRATORS_H
#define TR_INTEGRATORS_H
#include "evaluate/evaluate.h"

/* Least unit of works, J; most: the largest of them. */
static double tr_smallest_work_unit(const tr_sim *s, double most);

/* Squared error `e` of a step from y to ynew, mean over positions and velocities, 1 at the tolerance. It sees multipliers only
 * through motion; works see the rest, such as a driven joint's effort. */
static double tr_squared_motion_error(const tr_sim *s, const double *e, const double *y, const double *ynew);

/* Squared error of n works from place `first` of the state, 1 at the tolerance. unit: least unit, J. */
static double tr_squared_work_error(const tr_sim *s, const double *e, const double *y, const double *ynew, int first, int n, double unit);

/* One trial step h from (t, y); requires K[0]. Leaves ynew, and with ends_in_error the end derivative in K[stages]. Returns the
 * error, 1 at the tolerance; NaN: a stage failed. */
static double tr_step_explicit(tr_sim *s, const tr_explicit *m, double h);

/* dz/d[y, t] (nz × (ny+1)) from the residual rows of the Jacobian: R_z dz = −R_y. choice: linearised choice of open λ, with its
 * rows behind R (0: basic solution). Requires a solution. Returns 0: singular. */
static int tr_multiplier_derivatives(tr_sim *s, const double *J, int ld, const tr_reaction_choice *choice, double *dz);

/* jac ← dF/d[y, t] at (t, y): ny × (ny+1), column-major with tr_jacobian_rows. Returns 0 on failure. */
static int tr_jacobian_at(tr_sim *s, double t, const double *y);

/* One trial step h from (t, y); requires K[0]. Returns the error, 1 at the tolerance; NaN: a stage failed, or the status is
 * TR_NEED_JACOBIAN. The caller evaluates the end derivative after projection. Rows of K: f(t, y), stages, derivative at the
 * end. */
static double tr_step_rosenbrock(tr_sim *s, const tr_rosenbrock *m, double h);

/* y(θ) = yold + θ(R0 + (1−θ)(R1 + θ(R2 + (1−θ)(…)))). Requires the dense output. */
static void tr_evaluate_dense(const tr_sim *s, double theta, double *out);

/* Evaluate the powers in the middle of the trial step from yold to ynew; NaN without a solution. Multipliers are restored. */
static void tr_evaluate_middle_powers(tr_sim *s, const tr_rosenbrock *m);

/* Form the dense output of the last step, if it is not formed. Returns 0 on failure. */
static int tr_ensure_dense(tr_sim *s);

/* State at θ of the last step, and η there for Newton's method. Requires the dense output. */
static void tr_dense_state(tr_sim *s, double theta, double *out);

/* Integrate works over the pending step up to its end, where those of the method are missing or inaccurate. */
static void tr_integrate_works(tr_sim *s, const tr_method *m);

/* State at θ of the pending step for a row, with works integrated in parts if necessary. Requires the dense output. */
static void tr_state_in_step(tr_sim *s, double theta, double *y);

/* Method auto: count a step that ended at a kink. If nearly every step does, switch to the stiff method; a velocity creeping
 * below the kink makes explicit steps jump between branches. */
static void tr_count_kink(tr_sim *s);

/* Estimate of h |λ| from the last stage and the end of an explicit step of length h (Hairer, Wanner II, IV.2). */
static double tr_estimate_stiffness(tr_sim *s, const tr_explicit *m, double h);

/* Whether stability limits the explicit step that waits. States inside it are then far less accurate than its end. */
static int tr_is_limited_by_stability(tr_sim *s);

/* The state at θ of the explicit step that waits, by a step of that length from its start; works are left out. Returns 0 on
 * failure. */
static int tr_step_to_place(tr_sim *s, double theta, double *out);

/* Method auto: switch to the stiff method when stability limits the steps, and back when its steps would be stable explicitly. */
static void tr_choose_method(tr_sim *s);

/* First step size (Hairer, Nørsett, Wanner I, II.4) from the sizes of y, ẏ and ÿ. Requires K[0]. */
static double tr_first_step(tr_sim *s, double span, int order);

/* Factor on the size of a refused step with this error. */
static double tr_retry_factor(double err, int order);

/* tr_retry_factor after an accepted step, with proportional–integral control by the previous error: fewer refusals where
 * difficulty varies. */
static double tr_next_step_factor(tr_sim *s, double err, int order, double most);

/* Set the size of the next step after the pending one. */
static void tr_set_next_step(tr_sim *s);
#endif
