/* Stage `constraints`: λ of closed loops as a function of η, and the open reactions. Open reactions are reactions of redundant
 * loops that the equations of motion leave undetermined. */
#ifndef TR_CONSTRAINTS_H
#define TR_CONSTRAINTS_H
#include "base/base.h"

/* Choice of the open reactions, and data for the derivative of this choice by the state. V (a×r): the r open directions. least:
 * factorised least-squares problem for the amounts along V. turn (r×(ny+1)): for each component of [y, t], the vector cᵈ of
 * ``internal_forces_derivative.c``, which is the effect of the change of V. */
typedef struct tr_reaction_choice {
  int r;
  double *V, *turn;
  tr_least_squares least;
} tr_reaction_choice;

/* Number of open directions whose amounts are unknowns besides the friction η; 0 outside the redundant variant. */
static inline int tr_open_count(const tr_sim *s) { return s->k->nmore ? s->loops.open : 0; }

/* Number of loop rows that depend on other loop rows. Requires the factor. */
static inline int tr_dependent_rows(const tr_sim *s) { return tr_loop_rows(s) - s->loops.rank_now; }

/* Derivative of the reaction components by η (n×e). Requires the laws' values. */
static inline const double *tr_loads_by_friction(const tr_sim *s) { return tr_open_count(s) ? TR_A(s, openE) : TR_A(s, Np) + s->k->nn; }

/* Number of rows of the Jacobian unit: ẏ, and the residuals of the multipliers. The redundant variant adds the scaled reactions and
 * δ. */
static inline int tr_jacobian_rows(const tr_sim *s) {
  const tr_kernel *k = s->k;
  return s->ny + k->active + k->neta + k->nkappa + k->nmore;
}

/* Add to N the open reactions that make the deformations of the contacts compatible, at the frictions eta. Also form openE, the
 * derivative ∂N/∂η with the open reactions included. Requires load maps. On failure, returns 0 with NaN in N. */
static int tr_solve_internal_forces(tr_sim *s, const double *eta, double *N);

/* S (a×a), with its structural zeros. Requires raw maps. */
static const double *tr_whole_loop_matrix(tr_sim *s);

/* r (a) ← r + S z. Requires raw maps. */
static void tr_add_loop_product(const tr_sim *s, const double *z, double *r);

/* The part of S for the rows of loops, without rows of light freedoms (n×n, n = tr_loop_rows). Requires raw maps. */
static const double *tr_loop_matrix(tr_sim *s);

/* Factorise the part of S that belongs to the rows of light freedoms (theory, "Light bodies"). Requires the factor of
 * tr_loop_matrix. */
static void tr_factor_light_rows(tr_sim *s);

/* Factorise S of the current state. Returns its rank. */
static int tr_factor_loops(tr_sim *s);

/* x ← S⁺ b. Requires the factor. */
static void tr_solve_loops(tr_sim *s, const double *b, double *x);

/* Factorise the recursion's inertias without friction (k->narrow). Requires a kernel with recursion. */
static void tr_narrow_without_friction(tr_sim *s);

/* Set the row scales d from the diagonal of S at an accurate state, assembled or projected, and determine the rank of S. A row
 * whose diagonal is round-off uses the largest diagonal of its kind (rotation or translation). If all rows of a kind are round-off,
 * their scale follows from the other kind and the length scale. (Example: rotations of a planar loop about axes other than the
 * world's.) nothing: whether no row has any effect; all scales are then 1, and all pivots are round-off. */
static void tr_find_rank(tr_sim *s, int nothing);

/* Whether the row of contact c, which is open, depends on rows of closed contacts and loops. Requires the factor. */
static int tr_is_contact_dependent(tr_sim *s, int c);

/* Load, N, that contact c would have if it were closed and all contacts had the same stiffness; negative: the contact would pull.
 * Returns 0 without scaled reactions. Requires the solution, and that contact c is open and dependent. */
static double tr_load_of_open_contact(tr_sim *s, int c);

/* Null space of S. The columns of V (a×r), with S V = 0, are the open directions; each belongs to one pivot beyond the rank.
 * Returns r. Requires the factor. */
static int tr_null_space(tr_sim *s, double *V);

/* Form the held maps Q0' and Qe' of q̈ = Q0' + Qe' η, the accelerations of the sliding freedoms; λ is eliminated. Requires load
 * maps, and lam0 (a) of tr_eliminate_loops. */
static void tr_form_held_maps(tr_sim *s, const double *lam0);

/* Form the load maps N0' and Ne' of N = N0' + Ne' η, with λ eliminated, and T = S⁺ Se. lam0 (a) receives λ without friction.
 * Requires the factor. */
static void tr_eliminate_loops(tr_sim *s, double *lam0);

/* Factorise S and form the load maps. If `held`, also form the held maps. */
static void tr_form_maps_without_loops(tr_sim *s, int held);

/* With recursive friction, form the load maps unless they exist already. With set-valued laws, also form the held maps. */
static void tr_form_all_maps(tr_sim *s);

/* Independence of the loop rows, which measures the distance from a singular position. The result is the square root of the last
 * pivot, 0 if a row was dropped, INFINITY for a sparse factor. Requires the factor, or the smallest pivot of the recursion. */
static double tr_loop_independence(const tr_sim *s);

static inline void tr_update_independence(tr_sim *s) { s->loops.least = fmin(s->loops.least, tr_loop_independence(s)); }

/* J: the first `cols` columns of the Jacobian unit at (y, z), which are derivatives by [y, t, z]. Requires the signals. */
static void tr_jacobian_columns(tr_sim *s, const double *y, const double *z, int cols, double *J);

/* Linearise the choice of the open reactions. J: columns of the Jacobian unit at the solution. If no direction is open, r of the
 * result is 0. */
static tr_reaction_choice tr_linearise_choice(tr_sim *s, const double *y, const double *J);

/* Add the change of the open reactions to lam, the derivative of λ along column j. K: derivatives of the scaled reactions and of δ
 * by the variable of column j. */
static void tr_follow_choice(tr_sim *s, const tr_reaction_choice *q, int j, const double *K, double *lam);
/* Whether the loops prescribe the motion of multiplier i's freedom. With closed loops, friction then does not accelerate this
 * freedom. Requires held maps. */
static inline int tr_is_prescribed(const tr_sim *s, int i);

/* In an impulse step, add the rates at the step's start, divided by the step's length, to the accelerations acc (neta). The sums
 * are the rates at the step's end, divided by the same length. A prescribed freedom gets twice its mean rate instead, because
 * friction cannot change the motion of this freedom. size (neta): sums of absolute terms; null pointer: none. Requires held
 * maps. */
static void tr_add_start_rates(const tr_sim *s, double *acc, double *size);

#endif
