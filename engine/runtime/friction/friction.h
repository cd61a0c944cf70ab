/* Stage `friction`: η from the complement equations, or from the conditions of rest. */
#ifndef TR_FRICTION_H
#define TR_FRICTION_H
#include "constraints/constraints.h"

/* Friction at rest as a convex problem (``creep_minimisation.c``): n pairs with m multipliers and r freedoms. */
typedef struct tr_creep_problem {
  int n, m, r;
  const int *pairs; /* n */
  int *index;       /* m: multipliers of the pairs */
  int *first;       /* n + 1: begin of each pair's multipliers among the m */
  int *lead;        /* r: multipliers whose accelerations determine all others */
  double *B;        /* m×r, by rows */
  double *w0, *w;   /* r */
  double *x;        /* m: surface accelerations, of balls across their forces, m/s² */
  double *u;        /* m: frictions, N; unknowns beside w, cap x/√(x² + ε²) at the end */
  double *cap;      /* n: capacities, N */
  double share;     /* fraction of the capacities that may be used */
  double *eps;      /* n: ε of each pair, m/s² */
} tr_creep_problem;

/* Whether pair i is a sliding ball (with a kink: beyond it), whose friction may require a search by tilt. */
static inline int tr_is_sliding_ball(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  int flag = tr_mode_flag(tr_mode_of(s, i));
  return pair->cone && (pair->kind == TR_KIND_SET ? flag == TR_SLIPS : pair->kind == TR_KIND_KINK && flag == TR_SATURATED);
}

static inline int tr_row_kind(const tr_sim *s, int i) { return s->friction.held ? tr_row_kinds(s)[i] : TR_ROW_LAW; }

/* Set rates of held tree joints (or their derivatives) in v to exactly zero. A pair whose rest follows from others may move
 * slightly with the mechanism; a rate above round-off stays, because stopping it would stop everything. */
static void tr_zero_held_rates(const tr_sim *s, double *v);

/* Surface speed of pair i in the current state, m/s. */
static double tr_pair_speed(const tr_sim *s, int i);

/* Whether pair i counts as at rest (``base/stick_rule.h``). Requires maps. */
static inline int tr_is_at_rest(const tr_sim *s, int i) { return tr_pair_speed(s, i) <= tr_rest_speed(tr_speed_unit(s)); }

/* Whether pair i is so slow that reversed sliding has come to its end (``base/stick_rule.h``). Requires maps. */
static inline int tr_is_crawling(const tr_sim *s, int i) { return tr_pair_speed(s, i) <= tr_crawl_speed(tr_speed_unit(s)); }

/* Whether pair i is a ball in motion. Requires maps. */
static int tr_is_moving_ball(const tr_sim *s, int i);

/* Unit of the surface speed of pair i, m/s: the rate scale times its largest lever (of travel: the length). */
static double tr_pair_speed_unit(const tr_sim *s, int i);

/* Rates of pair i in the state `y`. If they are not part of the state, `y` becomes the current state. */
static void tr_rates_of_state(tr_sim *s, int i, double *rates);

/* Surface speed of pair i in the state `y`, m/s, as tr_rates_of_state. */
static double tr_speed_of_state(tr_sim *s, int i);

/* Set the levers that turn rates into surface speeds, from the sizes of unit frictions. */
static void tr_set_levers(tr_sim *s);

/* N, law(N), its derivative and sliding speeds at the frictions eta, λ eliminated. Forms the maps it needs. */
static void tr_evaluate_laws(tr_sim *s, const double *eta);

/* J = E − dlaw/dN · Ne' (e×e) into `lu`. Requires the laws' values. Sizes of journals and balls are compiled separately. */
static void tr_form_law_jacobian(tr_sim *s);

/* Friction and capacity of every pair (`hold`) at the multipliers z and the loads NN. */
static void tr_evaluate_capacities(tr_sim *s);

/* tr_evaluate_capacities at the loads of the solution. Newton's method leaves those of its last iterate but one. With them a
 * small ball that shares a load with large ones would carry an unbalanced torque. */
static void tr_evaluate_capacities_at_solution(tr_sim *s);

/* tr_newton with other leaders of the groups at rest: Newton's method finds no root if a leader carries no load there. */
static int tr_newton_with_other_leaders(tr_sim *s, const double *warm);

/* Friction of pair i over its capacity; 0 for friction of round-off. Requires capacities. */
static double tr_friction_ratio(const tr_sim *s, int i);

/* Response of multiplier i's freedom to friction j, loops closed. Requires held maps. */
static double tr_freedom_response(const tr_sim *s, int i, int j);

/* Scale of multiplier i's response for rank decisions: its own response, at least the round-off of what cancels in it. */
static double tr_response_scale(const tr_sim *s, int i, double own);

/* Whether multipliers i and j belong to one freedom. Requires held maps. */
static int tr_are_one_freedom(const tr_sim *s, int i, int j);

/* The pair that owns multiplier e; *at: place of that pair's derivative of the capacity. */
static int tr_pair_of_multiplier(const tr_sim *s, int e, int *at);

/* Whether the loops prescribe the motion of multiplier i's freedom: its response through them vanishes. Requires held maps. */
static inline int tr_is_prescribed(const tr_sim *s, int i);

/* Acceleration of multiplier i's freedom at the solution. Requires held maps, or a recursive solution. */
static double tr_freedom_acceleration(tr_sim *s, int i);

/* Acceleration of multiplier i's freedom from raw maps and all multipliers. size: sum of the absolute terms. */
static double tr_acceleration_and_terms(tr_sim *s, int i, double *size);

/* Acceleration of multiplier i's freedom at the solution, also without held pairs. */
static double tr_acceleration_by_maps(tr_sim *s, int i);

/* Whether freedom i, moved by drives with acceleration acc, counts as at rest. Its motion must fade for long, or change about
 * when it would have stopped (RESTS_BY). Otherwise it reverses. Requires maps. */
static int tr_is_coming_to_rest(const tr_sim *s, int i, double acc);

/* Whether freedom i of a held pair, whose rest follows from others', moves. Requires the solution and its row kinds. */
static int tr_is_held_freedom_moving(tr_sim *s, int i);

/* Violation of a held pair whose rest follows from others: positive if it moves too much, otherwise −∞. Near positions of rest
 * such a pair moves by a small part of the mechanism's motion. */
static double tr_rest_violation(tr_sim *s, int i);

/* Violation of a set-valued pair, in tolerances: end of sliding, release, border between sliding and spinning. Requires the
 * laws' values, and capacities for held pairs. */
static double tr_set_valued_violation(tr_sim *s, int i);

/* Violation of a pair whose law has a kink at rest, in tolerances: the end of its direction. */
static inline double tr_direction_violation(const tr_sim *s, int i) { return tr_stick_overshoot(tr_sliding_of(s, i)->speed, tr_speed_unit(s)); }

/* Violation of pair or stop i, in tolerances; above 1 an event. depth: depths of all stops. Requires the same as
 * tr_set_valued_violation. */
static double tr_mode_violation(tr_sim *s, int i, const double *depth);

/* Replace residual r and Jacobian J for held pairs: zero acceleration; zero friction for prescribed motion; a share or a stored
 * load. Requires held maps and row kinds. */
static void tr_form_rest_rows(tr_sim *s, const double *eta, double *r, double *J);

/* Newton's method for η = law(N(η)) from the given eta. Returns 1 on convergence. The Jacobian is exact, so a small step that shows
 * quadratic convergence is the last. */
static int tr_newton(tr_sim *s, double *eta);

/* Find the friction of ball i by its tilt, from eta; its mode stores the tilt. Inside the cone the tilt is zero, as trial steps
 * beyond the end of sliding need. Returns 1 on success. */
static int tr_find_tilt(tr_sim *s, double *eta, int i);

/* Reset the tilts in all modes. */
static void tr_clear_tilts(tr_sim *s);

/* Find the friction of ball i beyond the kink of its law, where sliding has no continuation from the kink. To slide faster, the
 * ball would have to be further inside its cone. Returns 1 with the root in eta in that case. Requires the laws' values. */
static int tr_find_tilt_beyond_kink(tr_sim *s, double *eta, int i);

/* Search a root of ball i from small tilts on, also where φ(0) ≤ 0. Returns 1 when found. */
static int tr_search_tilt(tr_sim *s, double *eta, int i);

/* Whether every pair is on the branch of its mode: beyond its law's kink or not, inside a ball's cone or not. Requires the laws' values. */
static int tr_is_on_branches(const tr_sim *s);

/* Next number of a fixed sequence in (−1, 1). */
static double tr_next_random(unsigned *seed);

/* Find η along the path on which friction grows from zero. Returns 1 on success. */
static int tr_newton_by_growing_friction(tr_sim *s, double *eta);

/* Size of each pair's friction under the loads without friction (neta). Requires load maps. */
static void tr_estimate_frictions(tr_sim *s, double *size);

/* The `which`-th random start. */
static void tr_random_start(const tr_sim *s, const double *size, int which, unsigned *seed, double *eta);

/* Whether eta, to which Newton's method has converged, is of a root's size and on the branches of the modes. */
static int tr_is_root(tr_sim *s, const double *size, const double *eta);

/* Collect the multipliers of the pairs whose motion is not prescribed. Requires held maps. */
static void tr_creep_collect_multipliers(const tr_sim *s, tr_creep_problem *c);

/* Set B from the responses of the freedoms to friction. Requires held maps. */
static void tr_creep_factor_responses(const tr_sim *s, tr_creep_problem *c);

/* Minimise for smaller and smaller ε, loads following. Leaves surface accelerations in x and frictions in z. law: see
 * tr_creep_update_loads. */
static void tr_creep_minimise(tr_sim *s, tr_creep_problem *c, const int *law);

/* Whether friction can be found along the recursion in the modes in force: every pair slides, is held by itself, or has no
 * friction. On loops, all must slide and no row may be redundant. */
static int tr_is_recursive(const tr_sim *s);

/* Factorise the recursion without friction and with all freedoms, to close many loops. Returns the sign of the determinant, or 0. */
static int tr_factor_without_friction(tr_sim *s);

/* Loads behind z caused by the frictions eta, with held freedoms. Returns 0 on failure. */
static int tr_loads_by_recursion(tr_sim *s, double *eta);

/* Newton's method along the recursion in the current state. near: start from the loads of a close state, if they lead to its
 * root at once; otherwise from the frictions in z. Refuses roots with a determinant below `least` (0; −1: any). Returns 1 on
 * success. */
static int tr_newton_recursive_from(tr_sim *s, int near, int least);

/* Store the loads of the solution, from which the next recursive iteration starts. Requires load maps. */
static void tr_store_solution_loads(tr_sim *s);

/* ẏ (dy) at y along the recursion. Requires the signals. Returns 0 if it fails. */
static int tr_rhs_recursive(tr_sim *s, const double *y, double *dy);

/* Set the equation that finds each multiplier in the modes in force. Requires maps. */
static void tr_set_row_kinds(tr_sim *s);

/* Solve z = [λ active | η] in the current state, from the multipliers in z. deciding: groups may share in another way. Returns
 * 0 without a reachable root. */
static int tr_solve_multipliers(tr_sim *s, int deciding);

/* Form the maps and row kinds that tr_newton needs in the modes in force. */
static void tr_prepare_equations(tr_sim *s);

/* Solve the multipliers in the modes in force, with row kinds, capacities and accelerations of the freedoms. Counts as one solution of a
 * decision. Returns 0 when there is none. */
static int tr_solve_in_modes(tr_sim *s);
#endif
