/* Stage `friction`: η from the complement equations, or from the conditions of rest. */
#ifndef TR_FRICTION_H
#define TR_FRICTION_H
#include "constraints/constraints.h"

/* Friction at rest as a convex problem (``creep_minimisation.c``) for n pairs with m multipliers and r freedoms. Comments give the
 * length of each array before the colon. */
typedef struct tr_creep_problem {
  int n, m, r;
  const int *pairs; /* n */
  int *index;       /* m: multipliers of the pairs */
  int *first;       /* n + 1: index of each pair's first multiplier among the m multipliers */
  int *lead;        /* r: multipliers whose accelerations determine all other accelerations */
  double *B;        /* m×r, row-major: x = B w */
  double *w0, *w;   /* r: accelerations in the metric of the masses, without friction and with friction */
  double *x;        /* m: surface accelerations, m/s²; of a ball, only the part perpendicular to its force */
  double *u;        /* m: frictions, N, which are unknowns besides w; at convergence u = cap x/√(x² + ε²) */
  double *cap;      /* n: capacities, N */
  double share;     /* fraction of the capacities that friction may use */
  double *eps;      /* n: ε of each pair, m/s² */
} tr_creep_problem;

/* Whether pair i is a sliding ball, whose friction may require a search by tilt (``ball_near_cone.c``). If its law has a kink, the
 * ball must be beyond the kink. */
static inline int tr_is_sliding_ball(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  int flag = tr_mode_flag(tr_mode_of(s, i));
  return pair->cone && (pair->kind == TR_KIND_SET ? flag == TR_SLIPS : pair->kind == TR_KIND_KINK && flag == TR_SATURATED);
}

/* Whether the stuck pair i yields: it exerts its capacity along its direction, while other pairs hold its freedom. A tilt in the
 * mode marks a pair that yields. (All other tilts belong to balls, and balls never yield.) */
static inline int tr_yields(const tr_sim *s, int i) { return tr_is_stuck(s, i) && !tr_pair_of(s, i)->cone && tr_mode_of(s, i)->tilt != 0.0; }

static inline int tr_row_kind(const tr_sim *s, int i) { return s->friction.held ? tr_row_kinds(s)[i] : TR_ROW_LAW; }

/* Set the rates of held tree joints to exactly zero in v; v may also contain the derivatives of rates. A held pair whose rest
 * follows from other pairs may move slightly with the mechanism. If the rate of such a pair is above round-off, it is kept, because
 * a zero would stop the mechanism. */
static void tr_zero_held_rates(const tr_sim *s, double *v);

/* Surface speed of pair i in the current state, m/s. */
static double tr_pair_speed(const tr_sim *s, int i);

/* Whether pair i counts as at rest (``base/stick_rule.h``). Requires maps. */
static inline int tr_is_at_rest(const tr_sim *s, int i) { return tr_pair_speed(s, i) <= tr_rest_speed(tr_speed_unit(s)); }

/* Whether pair i is so slow that it counts as stopped when its direction reverses (``base/stick_rule.h``). Requires maps. */
static inline int tr_is_crawling(const tr_sim *s, int i) { return tr_pair_speed(s, i) <= tr_crawl_speed(tr_speed_unit(s)); }

/* Whether pair i is a ball in motion. Requires maps. */
static int tr_is_moving_ball(const tr_sim *s, int i);

/* Unit of the surface speed of pair i, m/s: the rate scale times the pair's largest lever (for translation, the length scale). */
static double tr_pair_speed_unit(const tr_sim *s, int i);

/* Rates of pair i in the state `y`. Rates that are not part of the state come from maps; `y` then becomes the current state. */
static void tr_rates_of_state(tr_sim *s, int i, double *rates);

/* Surface speed of pair i in the state `y`, m/s. May make `y` the current state (see tr_rates_of_state). */
static double tr_speed_of_state(tr_sim *s, int i);

/* Set the levers: factors from rates to surface speeds. Levers follow from the surface forces of unit frictions. The lever of a
 * multiplier without a pair (the force between wheels that teeth push apart) is 1. */
static void tr_set_levers(tr_sim *s);

/* Largest friction of all pairs, N, with torques divided by their levers. Returns 0 if no law is set-valued: levers are then
 * unknown. */
static double tr_largest_surface_friction(const tr_sim *s);

/* At the frictions eta, evaluate N, law(N), ∂law/∂N and sliding speeds, with λ eliminated. Forms the maps that it requires. */
static void tr_evaluate_laws(tr_sim *s, const double *eta);

/* Write J = E − ∂law/∂N · Ne' to `lu` (e×e, E: unit matrix). Requires the laws' values. The sizes of journals and balls are
 * compiled separately. */
static void tr_form_law_jacobian(tr_sim *s);

/* Compute `hold`, the friction and capacity of every pair, at the multipliers z and the loads NN. */
static void tr_evaluate_capacities(tr_sim *s);

/* Like tr_evaluate_capacities, at the loads of the solution. (Newton's method leaves the loads of the iterate before the last one
 * in NN. With these loads, a small ball that shares a load with large balls would carry an unbalanced torque.) */
static void tr_evaluate_capacities_at_solution(tr_sim *s);

/* Friction of pair i divided by its capacity. Returns 0 if the friction is round-off. Requires capacities. */
static double tr_friction_ratio(const tr_sim *s, int i);

/* Friction that pair i, at rest, can carry in addition to its present friction, N or N m. Requires capacities. */
static double tr_reserve(const tr_sim *s, int i);

/* Deceleration that a unit of friction j causes in the freedom of multiplier i, with closed loops. Requires held maps. */
static double tr_freedom_response(const tr_sim *s, int i, int j);

/* Scale 1/√response of multiplier i for rank decisions. `own`: response of the multiplier's freedom to its own friction. The terms
 * of a response may cancel; the scale therefore uses at least the round-off of these terms. */
static double tr_response_scale(const tr_sim *s, int i, double own);

/* Whether multipliers i and j act on the same freedom. Requires held maps. */
static int tr_are_one_freedom(const tr_sim *s, int i, int j);

/* The pair that owns multiplier e. *at receives the offset of the derivative of this pair's capacity. */
static int tr_pair_of_multiplier(const tr_sim *s, int e, int *at);

/* Acceleration of multiplier i's freedom with the multipliers eta. Requires held maps. */
static double tr_held_acceleration(const tr_sim *s, int i, const double *eta);

/* Acceleration of multiplier i's freedom at the solution. Requires held maps, or a recursive solution. */
static double tr_freedom_acceleration(tr_sim *s, int i);

/* Acceleration of multiplier i's freedom from raw maps and all multipliers. size receives the sum of the absolute terms. */
static double tr_acceleration_and_terms(tr_sim *s, int i, double *size);

/* Like tr_freedom_acceleration, without held maps. */
static double tr_acceleration_by_maps(tr_sim *s, int i);

/* Whether freedom i, which drives move with the acceleration acc, counts as at rest. The freedom is at rest if its slow motion
 * fades for a long time. It is also at rest if the signals have a break near its stopping time (RESTS_BY). Otherwise its motion
 * reverses. Requires maps. */
static int tr_is_coming_to_rest(const tr_sim *s, int i, double acc);

/* Whether freedom i of a held pair moves although its rest should follow from the rest of other freedoms. open: acceleration caused
 * by open loops, relative to the sum of absolute terms; 0 for decisions, where loops are closed. Inside a step, the error of the
 * dense output opens loops, and a locked freedom seems to move. Requires the solution and its row kinds. */
static int tr_is_held_freedom_moving(tr_sim *s, int i, double open);

/* Violation of a held pair whose rest follows from other pairs: positive if the pair moves too much, otherwise −∞. (Near a dead
 * centre, this pair moves by a small fraction of the mechanism's motion.) */
static double tr_rest_violation(tr_sim *s, int i);

/* Violation of the mode of a pair with a set-valued law, in tolerances. Depending on the mode, the limit is the end of sliding, the
 * release, or the border between sliding and spinning. Requires the laws' values, and capacities for held pairs. */
static double tr_set_valued_violation(tr_sim *s, int i);

/* Violation of the mode of a pair whose law has a kink at rest, in tolerances. The limit is the end of sliding in the frozen
 * direction. */
static inline double tr_direction_violation(const tr_sim *s, int i) { return tr_stick_overshoot(tr_sliding_of(s, i)->speed, tr_speed_unit(s)); }

/* Violation of the mode of pair or stop i, in tolerances; a value above 1 is an event. depth: depths of all stops. The requirements
 * are those of tr_set_valued_violation. */
static double tr_mode_violation(tr_sim *s, int i, const double *depth);

/* Stored load of multiplier i of pair m under the loads N. Of a ball's stored friction, only the part perpendicular to its force f
 * counts. slope (3): derivative by f, which is zero for pairs that are not balls. */
static double tr_stored_load(const tr_sim *s, int m, int i, const double *N, double *slope);

/* Write the equations of held pairs (TR_ROW_…) to their rows of the residual r and the Jacobian J. Kinds of equation: zero
 * acceleration, zero friction (prescribed motion), a share, a stored load, the capacity of a pair that yields. Requires held maps
 * and row kinds. */
static void tr_form_rest_rows(tr_sim *s, const double *eta, double *r, double *J);

/* Newton's method for η = law(N(η)) from the given eta. Because the Jacobian is exact, convergence is quadratic, and the iteration
 * ends after a small step. Returns 1 on convergence. */
static int tr_newton(tr_sim *s, double *eta);

/* Find η with a search for the tilt of ball i, starting from eta. The tilt is stored in the mode of the ball. Inside its cone the
 * ball has the tilt zero; this occurs in trial steps that pass the end of sliding. Returns 1 on success. */
static int tr_find_tilt(tr_sim *s, double *eta, int i);

static void tr_clear_tilts(tr_sim *s);

/* Find a root of sliding ball i at a tilt beyond the kink of its law, where no root begins at the kink itself. Returns 0 if φ ≤ 0
 * (``ball_near_cone.c``) at a tilt slightly above the tilt of the kink. Returns 1 on success, with the root in eta. Requires the
 * laws' values. */
static int tr_find_tilt_beyond_kink(tr_sim *s, double *eta, int i);

/* Search for a root of φ (``ball_near_cone.c``) over growing tilts of ball i, even if φ(0) ≤ 0. Returns 1 on success. */
static int tr_search_tilt(tr_sim *s, double *eta, int i);

/* Whether every pair is on the branch of its mode: on the mode's side of the kink and, for a ball, of the cone. Requires the laws'
 * values. */
static int tr_is_on_branches(const tr_sim *s);

/* Next number, in (−1, 1), of a fixed pseudo-random sequence. */
static double tr_next_random(unsigned *seed);

/* Find η by continuation from zero friction to full friction. Returns 1 on success. */
static int tr_newton_by_growing_friction(tr_sim *s, double *eta);

/* size (neta) receives the largest friction of each pair under the loads without friction. Requires load maps. */
static void tr_estimate_frictions(tr_sim *s, double *size);

/* Write random start number `which` to eta. size: result of tr_estimate_frictions. */
static void tr_random_start(const tr_sim *s, const double *size, int which, unsigned *seed, double *eta);

/* Whether eta, a result of Newton's method, is a root: small enough, and on the branches of the modes. */
static int tr_is_root(tr_sim *s, const double *size, const double *eta);

/* Collect the multipliers of the problem's pairs, except those with prescribed motion. Requires held maps. */
static void tr_creep_collect_multipliers(const tr_sim *s, tr_creep_problem *c);

/* Set B and `lead` by factorising the responses of the freedoms to friction. Requires held maps. */
static void tr_creep_factor_responses(const tr_sim *s, tr_creep_problem *c);

/* Minimise the objective for decreasing ε, and update the loads in each iteration. Writes surface accelerations to x and frictions
 * to z. law: see tr_creep_update_loads. */
static void tr_creep_minimise(tr_sim *s, tr_creep_problem *c, const int *law);

/* Whether the recursion can find friction in the modes in force. Each pair must slide, store its load, or be held at freedoms that
 * are states of the tree. In a mechanism without loops, a pair may also be without friction. No loop row may be redundant. */
static int tr_is_recursive(const tr_sim *s);

/* Factorise the inertias of the recursion for the closure of many loops: without friction, with all freedoms. Returns the sign of
 * the determinant; 0 on failure. */
static int tr_factor_without_friction(tr_sim *s);

/* Acceleration of freedom i by a unit of force along it, in a tree. Overwrites the recursion's factor. Requires a recursive
 * solution. */
static double tr_response_by_recursion(tr_sim *s, int i);

/* Compute the loads for the frictions eta, with held freedoms at rest. Stores these loads after the multipliers in z. Returns 0 on
 * failure. */
static int tr_loads_by_recursion(tr_sim *s, double *eta);

/* Newton's method with the recursion in the current state. near: 1 starts from the loads of a close state, which are stored after
 * the multipliers in z; the call then fails unless convergence is fast. 0 starts from the frictions in z. Rejects a root if the
 * sign of its determinant is below `least`; −1 accepts both signs. Returns 1 on success. */
static int tr_newton_recursive_from(tr_sim *s, int near, int least);

/* Store the loads of the solution, from which the next recursive iteration starts. Requires load maps. */
static void tr_store_solution_loads(tr_sim *s);

/* Evaluate ẏ (dy) at y with the recursion. Requires the signals. Returns 0 on failure. */
static int tr_rhs_recursive(tr_sim *s, const double *y, double *dy);

/* Set the kind of equation (TR_ROW_…) of each multiplier in the modes in force. Requires maps. */
static void tr_set_row_kinds(tr_sim *s);

/* Solve for z = [λ active | η] in the current state, starting from the multipliers in z. deciding: 1 tries other sharing rules of a
 * group if the first one has no root. Returns 0 if no root is found. */
static int tr_solve_multipliers(tr_sim *s, int deciding);

/* Form the maps and row kinds that tr_newton requires in the modes in force. */
static void tr_prepare_equations(tr_sim *s);

/* Solve for the multipliers in the modes in force. Also sets row kinds, capacities and held maps. Counts as one solution of a
 * decision. Returns 0 if no solution is found. */
static int tr_solve_in_modes(tr_sim *s);
#endif
