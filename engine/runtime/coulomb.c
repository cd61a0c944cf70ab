/* Set-valued friction: which pairs stick and which slip, and what that asks of the state (METHOD, "Rest").
 *
 * Within a step modes and directions are frozen. At an event all pairs at rest are decided together: all are tried as stuck, and only
 * the worst violator is turned, until none is left; failing that, other starts and, for few pairs, all combinations. A pair sticks
 * while the friction it needs stays within what it can hold; it slips when friction then opposes its acceleration. */
#include "modes.h"

#define REST_SPEED 1e-11   /* of the speed unit: at rest; above what round-off leaves of a speed that was made zero */
#define TOL_RESOLVE 1e-11  /* of the friction ratio, when modes are decided (below TOL_RELEASE: no dwell time is needed) */
#define TOL_TWIST 1e-9     /* of the capacity: torque about the force that a ball at rest may have to hold; above round-off of both */
#define REST_BROKEN 1e-7   /* of the accelerations that cancel: above it a pair whose rest follows from others is not at rest */
#define CRAWLS 1e-10       /* of the speed unit: what drives move more slowly is at rest while they slow down (as NEAR_MISS) */
#define RESTS_BY 4.0       /* times the time in which a constant deceleration would stop it: moves that end smoothly take three times that */
#define RESTS_FOR 1e-6     /* of 1/rate: far more than one that turns back takes at such a speed */
#define NO_FORCE 1e-300    /* N: stands for a capacity or a size of nothing, so that it can be divided by */
#define NO_FRICTION 1e-290 /* N: friction asked for that is nothing but what stands for nothing above */

/* Surface speed of a pair, m/s, from its rates. */
static double tr_pair_speed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *r = map_rates(s->k, TR_A(s, maps)) + pair->rate0, *arm = TR_A(s, arm) + pair->eta0;
  double sum = 0.0;
  for (int j = 0; j < pair->nrates; ++j) sum += r[j] * r[j] * arm[j] * arm[j];
  return sqrt(sum);
}

/* Rates of a pair at the start of a step, when the maps in place may be of another state. */
static void tr_rates_of_state(tr_sim *s, int i, double *rates) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *from = TR_A(s, y) + s->k->nq + pair->v0;
  if (pair->v0 < 0) {
    tr_set_time(s, s->clock.t);
    tr_maps_of(s, TR_A(s, y));
    from = map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  }
  memcpy(rates, from, sizeof(double) * pair->nrates);
}

/* Directions of laws with a kink at rest, where a step starts past it (no events are located). */
static void tr_turn_directions(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    double rate[3], *side = tr_mode_of(s, i)->direction;
    if (!tr_is_turn(s, i)) continue;
    tr_rates_of_state(s, i, rate);
    if (rate[0] * side[0] < 0.0) side[0] = -side[0];
  }
}

/* Surface speed of a pair at the start of a step, m/s. */
static double tr_speed_of_state(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double r[3], sum = 0.0;
  tr_rates_of_state(s, i, r);
  for (int j = 0; j < pair->nrates; ++j) sum += r[j] * r[j] * TR_A(s, arm)[pair->eta0 + j] * TR_A(s, arm)[pair->eta0 + j];
  return sqrt(sum);
}

/* Levers that turn rates into surface speeds: from the size of unit frictions. */
static void tr_set_arms(tr_sim *s) {
  const tr_kernel *k = s->k;
  double u[k->neta + 1], none[k->nn + 1];
  memset(none, 0, sizeof none);
  for (int part = 0; part < 3; ++part) {
    memset(u, 0, sizeof u);
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) u[tr_pair_of(s, i)->eta0 + part] = 1.0;
    k->held_alone(none, u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) TR_A(s, arm)[tr_pair_of(s, i)->eta0 + part] = 1.0 / fmax(tr_hold_of(s, i)->size, NO_FORCE);
  }
}

/* What all pairs hold of the friction in place (z): fills `hold`. */
static void tr_holding(tr_sim *s) {
  const tr_kernel *k = s->k;
  k->held_alone(TR_A(s, NN), TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
}

/* The same where an evaluation has left the loads of the last iterate but one of Newton's method in place: about the force of that a small ball
 * that keeps its share beside large ones would have a torque, which nothing holds. */
static void tr_holding_now(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (s->friction.shares && !s->step.along) {
    tr_form_all(s);
    tr_loads_now(s, TR_A(s, z) + k->active);
    if (tr_open_count(s)) tr_press(s, TR_A(s, NN));
  }
  tr_holding(s);
}

/* Friction ratio needed over the ratio available, after tr_holding. */
static double tr_ratio(const tr_sim *s, int i) {
  const tr_hold *h = tr_hold_of(s, i);
  double cap = fmax(h->capacity, NO_FORCE);
  if (h->size <= NO_FRICTION) return 0.0;
  return h->beyond > TOL_TWIST * cap ? fmax(h->size / cap, 1.0 + h->beyond / cap) : h->size / cap;
}

static void tr_group(tr_sim *s);

/* How each multiplier is found in the modes in force. The maps of the state must be in place. */
static void tr_note_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  int e = k->neta, *row = tr_row_kinds(s);
  s->friction.still = s->friction.shares = s->friction.by_law = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    int stuck = tr_is_stuck(s, i) || i == s->friction.freed;
    for (int j = 0; j < pair->neta; ++j) row[pair->eta0 + j] = i == s->friction.freed ? TR_ROW_FREE : stuck ? TR_ROW_STILL : TR_ROW_LAW;
    s->friction.still += stuck;
  }
  if (!s->friction.still) return;
  if (tr_hold_apart(s)) {
    memset(TR_A(s, share), 0, sizeof(double) * e), memset(TR_A(s, impend), 0, sizeof(double) * k->nrates);
    return;
  }
  tr_without_loops(s, 1);
  for (int i = 0; i < e; ++i)
    if (row[i] == TR_ROW_STILL && tr_is_prescribed(s, i)) row[i] = TR_ROW_FREE;
  tr_group(s);
}

/* The equations of friction in the modes in force, at the state whose maps are in place, made ready for tr_newton. */
static void tr_ready_equations(tr_sim *s) {
  s->step.along = 0;
  if (s->k->sets) tr_note_modes(s);
  tr_without_loops(s, s->friction.still);
}

/* Acceleration of multiplier i's freedom at the solution in place. */
static double tr_freedom_acceleration(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + k->active;
  if (s->step.along) return TR_A(s, acc)[i];
  double acc = Q0[i];
  for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j];
  return acc;
}

/* The same from the maps as they are, λ included: also where nothing is held. size: the sum of the sizes of what it is made of. */
static double tr_acceleration_sum(tr_sim *s, int i, double *size) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  const double *z = TR_A(s, z), *maps = TR_A(s, maps), *Ql = map_Ql(k, maps) + i, *Qe = map_Qe(k, maps) + i;
  double acc = map_Q0(k, maps)[i];
  *size = fabs(acc);
  for (int q = 0; q < k->active; ++q) acc += Ql[q * k->neta] * z[q], *size += fabs(Ql[q * k->neta] * z[q]);
  for (int q = 0; q < k->neta; ++q) acc += Qe[q * k->neta] * z[k->active + q], *size += fabs(Qe[q * k->neta] * z[k->active + q]);
  return acc;
}

/* The sum alone. */
static double tr_acceleration_now(tr_sim *s, int i) {
  double size;
  if (s->step.along) return TR_A(s, acc)[i];
  return tr_acceleration_sum(s, i, &size);
}

/* How far freedom i is from rest: its acceleration over what cancels in it. Of freedoms held by the loops or as one of a group, whose rest
 * is not asked for by an equation of their own: it follows from the others', or contradicts it. */
static double tr_unrest(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  tr_form_all(s);
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + k->active;
  double acc = Q0[i], size = fabs(Q0[i]);
  for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j], size += fabs(Qe[i + j * e] * eta[j]);
  return fabs(acc) / fmax(size, NO_FORCE);
}

/* Whether freedom i, which drives move and accelerate by acc, is as good as at rest, and comes to rest with a drive: what changes next does so about
 * when it would have stopped, or that takes long (a drive that follows an input dies away). Else it turns back. Maps in place. */
static int tr_comes_to_rest(const tr_sim *s, int i, double acc) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    if (i < pair->eta0 || i >= pair->eta0 + pair->nrates) continue;
    const double rate = map_rates(s->k, TR_A(s, maps))[pair->rate0 + i - pair->eta0];
    if (!(acc * rate < 0.0) || fabs(rate) * TR_A(s, arm)[i] > CRAWLS * tr_speed_unit(s)) return 0;
    const double now = tr_moment_of(s)->t, left = fabs(rate / acc);
    return tr_break_after(s, now) - now <= RESTS_BY * left || left >= RESTS_FOR / s->set.rate;
  }
  return 0;
}

/* Whether freedom i of a held pair moves although nothing but the others holds it. After tr_solve_modes. */
static int tr_contradicts(tr_sim *s, int i) {
  int kind = tr_row_kinds(s)[i];
  if (kind == TR_ROW_FREE && tr_comes_to_rest(s, i, tr_freedom_acceleration(s, i))) return 0;
  return (kind == TR_ROW_SHARE || kind == TR_ROW_KEPT || kind == TR_ROW_FREE) && tr_unrest(s, i) > REST_BROKEN;
}

/* Whether the decision that is being made has done the work it may. */
static inline int tr_is_spent(const tr_sim *s) { return s->friction.work > 0 && s->stats.newton_iterations + s->stats.creeps > s->friction.work; }

/* Solve for the multipliers in the modes in force, and make the accelerations of the sliding freedoms available. */
static int tr_solve_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active;
  if (tr_is_spent(s) || tr_gives_up(s, (double)(a + 1) * k->neta * (a + k->nn + k->neta))) return 0;
  s->stats.solutions++;
  tr_note_modes(s);
  if (tr_recurs(s) && tr_newton_along(s, 0)) {
    tr_holding(s);
    return 1;
  }
  tr_form_maps(s);
  if (!tr_multipliers(s, 1)) return 0;
  if (!s->friction.still) {
    double lam0[a + 1];
    for (int i = 0; i < a; ++i) {
      lam0[i] = TR_A(s, z)[i];
      for (int j = 0; j < k->neta; ++j) lam0[i] += TR_A(s, T)[i + j * a] * TR_A(s, z)[a + j];
    }
    tr_held_maps(s, lam0);
  }
  tr_note_loads(s);
  tr_law(s, TR_A(s, z) + a);
  tr_holding(s);
  return 1;
}
