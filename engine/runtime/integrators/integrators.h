/* Stage `integrators`: steps of the methods, their errors, dense output and works. */
#ifndef TR_INTEGRATORS_H
#define TR_INTEGRATORS_H
#include "evaluate/evaluate.h"

/* Smallest scale by which errors of works are divided, J. most: the largest work so far, J. */
static double tr_smallest_work_unit(const tr_sim *s, double most);

/* Mean squared error of positions and velocities over a step from y to ynew, from the errors `e`, in units of the tolerance. Errors
 * of multipliers count only by their effect on the motion. Errors of works count separately (tr_squared_work_error). */
static double tr_squared_motion_error(const tr_sim *s, const double *e, const double *y, const double *ynew);

/* Squared error of the n works from index `first` of the state, in tolerances. unit: result of tr_smallest_work_unit, J. */
static double tr_squared_work_error(const tr_sim *s, const double *e, const double *y, const double *ynew, int first, int n, double unit);

/* Squared error from the squared errors of two estimators of different order. */
static double tr_combine_estimators(double first, double second);

/* Extrapolate x (e), the start of Newton's method at stage i, from its values `old` at earlier stages (i × e). Reads up to three
 * doubles after their end. */
static void tr_extrapolate_start(int e, double *x, const tr_explicit *m, int i, const double *old);

/* One trial step h from (t, y). Requires K[0]. Results: ynew and, with ends_in_error, the derivative at the end in K[stages].
 * Returns the error in units of the tolerance, or NaN if a stage failed. */
static double tr_step_explicit(tr_sim *s, const tr_explicit *m, double h);

/* Error of the slopes at the end of a trial step h, in units of the tolerance, if stability limits the step; otherwise 0. In
 * slopes, and so in rows of forces, errors of states are multiplied by |λ|. (Method auto soon changes the method at such steps.)
 * Requires an evaluated end. Stores h |λ|. */
static double tr_error_of_slopes(tr_sim *s, const tr_method *m, double h);

/* dz (nz × (ny+1)) ← dz/d[y, t], from the rows of the residuals R in the Jacobian J: R_z dz = −R_y. choice: linearised choice of
 * the open reactions, whose rows follow those of R; null pointer: multipliers of dependent rows get 0. Requires a solution. Returns
 * 0 if R_z is singular. */
static int tr_multiplier_derivatives(tr_sim *s, const double *J, int ld, const tr_reaction_choice *choice, double *dz);

/* jac ← dF/d[y, t] at (t, y), where ẏ = F: ny × (ny+1), column-major, with column stride tr_jacobian_rows. Returns 0 on
 * failure. */
static int tr_jacobian_at(tr_sim *s, double t, const double *y);

/* One trial step h from (t, y). Requires K[0]. Rows of K: f(t, y), the stages, the derivative at the end. The caller evaluates the
 * derivative at the end after projection. Returns the error in units of the tolerance. Returns NaN if a stage failed, or if the
 * status is TR_NEED_JACOBIAN. */
static double tr_step_rosenbrock(tr_sim *s, const tr_rosenbrock *m, double h);

/* Form the rows of the dense output of an explicit step h from yold to y1. The rows, like those of K, have nv SIMD vectors. Returns
 * the number of rows. */
static int tr_form_dense_rows(const tr_explicit *m, int nv, double h, const tr_vec *K, const tr_vec *yold, const tr_vec *y1, tr_vec *rows);

/* y(θ) = yold + θ(R0 + (1−θ)(R1 + θ(R2 + (1−θ)(…)))) from the rows R of n doubles. */
static void tr_evaluate_dense_rows(int n, int rows, const double *R, const double *yold, double theta, double *out);

/* State at θ of the last step. Requires the dense output. */
static void tr_evaluate_dense(const tr_sim *s, double theta, double *out);

/* Evaluate the powers in the middle of the trial step from yold to ynew. Without a solution, the powers are NaN, and the function
 * returns 0. Restores the multipliers. */
static int tr_evaluate_middle_powers(tr_sim *s, const tr_rosenbrock *m);

/* Form the dense output of the last step, unless it exists. Returns 0 on failure. */
static int tr_ensure_dense(tr_sim *s);

/* State at θ of the last step. Also interpolates η at θ, as a start of Newton's method. Requires the dense output. */
static void tr_dense_state(tr_sim *s, double theta, double *out);

/* Integrate the works over the pending step up to its end, unless the method has already integrated them accurately. */
static void tr_integrate_works(tr_sim *s, const tr_method *m);

/* State at θ of the pending step for a row. If necessary, works are integrated in parts. Requires the dense output. */
static void tr_state_in_step(tr_sim *s, double theta, double *y);

/* Method auto: count a step that ended at a kink. If nearly every step ends at a kink, switch to the stiff method. (Near the kink
 * speed, explicit steps jump between the branches of the law.) */
static void tr_count_kink(tr_sim *s);

/* Whether stability limits the pending explicit step, so that its dense output is less accurate than its end. Changes the
 * multipliers. */
static int tr_is_limited_by_stability(tr_sim *s);

/* Whether stability limited the size of the last explicit trial step. */
static int tr_is_step_stiff(tr_sim *s);

/* Method auto: switch to the stiff method when stability limits explicit steps. Switch back when explicit steps of the same length
 * as those of the stiff method would be stable. */
static void tr_choose_method(tr_sim *s);

/* First step size from the norms of y, ẏ and ÿ (Hairer, Nørsett, Wanner I, II.4). Requires K[0]. */
static double tr_first_step(tr_sim *s, double span, int order);

/* Factor on the size of a refused step with error `err`. */
static double tr_retry_factor(double err, int order);

/* Factor on the size of an accepted step with error `err`. The control is proportional–integral: it also uses the previous error,
 * which reduces refusals where errors vary. */
static double tr_next_step_factor(tr_sim *s, double err, int order, double most);

static void tr_set_next_step(tr_sim *s);
#endif
