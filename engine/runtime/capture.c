/* The end of sliding of pairs of several components, whose speed goes to zero without changing sign: the last stretch is a step of its own, at
 * whose end the pair rests, and with it all that come to rest there. */
#include "modes.h"

#define CAPTURE_JOLT 10.0   /* of the pair's own rates: by no more may those of others change when it stops */
#define CAPTURE_SPEED 1e-8  /* of the speed unit: what is slower may stop at once; the direction of what is much slower is that of round-off in loops. */
#define CAPTURE_ALONE 1.0   /* × the tolerance, of the speed unit: and what is slower than this where nothing else is about to stop */
#define CAPTURE_ACROSS 0.2  /* acceleration across the sliding, of the deceleration: what goes on with more passes by its least speed, and does not stop */
#define CAPTURE_TIME 10.0   /* × the tolerance, of 1/rate: so well the time of the stop is to be known (as OWN_ERROR), */
                            /* unless the speed is below NEAR_MISS: then the rest is taken at once */
#define STOPS_AS_ONE 0.01      /* × the tolerance, of 1/rate: stops that follow each other so soon are one; far below what times may be off by */
#define STOPS_WITH 0.5      /* of the last stretch: pairs whose own stops are as near to its end stop there (well above what their times are off by) */

/* Surface speeds of the pairs at the ends of the last PAST steps, the newest first, m/s. */
static double *tr_past_speeds(const tr_sim *s, int back) { return TR_A(s, past) + back * s->k->nsliders; }

/* The speeds at the end of an accepted step, evaluated, are kept; those before an event are none of this motion's. */
static void tr_keep_speeds(tr_sim *s) {
  double *t = s->friction.past_t;
  if (t[0] != s->step.t0)
    for (int q = 0; q < PAST; ++q) t[q] = NAN;
  memmove(tr_past_speeds(s, 1), tr_past_speeds(s, 0), sizeof(double) * (PAST - 1) * s->k->nsliders);
  memmove(t + 1, t, sizeof(double) * (PAST - 1));
  t[0] = s->pending.t;
  for (int i = 0; i < s->k->nsliders; ++i) tr_past_speeds(s, 0)[i] = tr_pair_speed(s, i);
}

/* In how long pair i comes to rest, s, by what its speed has lost over two steps, `back` steps ago: over one, or as its acceleration has it, it
 * goes to and fro with explicit steps at the edge of their stability. Not a number: not known; negative: it does not. */
static double tr_time_to_rest(const tr_sim *s, int i, int back) {
  const double *t = s->friction.past_t + back, v = tr_past_speeds(s, back)[i], was = tr_past_speeds(s, back + 2)[i];
  return v * (t[0] - t[2]) / (was - v);
}

/* Whether pair m, which slides, is about to rest as soon as another pair, in `left` s. */
static int tr_rests_as_soon(const tr_sim *s, int m, double left) {
  return tr_is_set(s, m) && tr_slides(s, m) && fabs(tr_time_to_rest(s, m, 0) - left) <= STOPS_WITH * left;
}

/* In how long pair i comes to rest, s, as the acceleration just evaluated has it. Infinite where that turns it, or makes it faster. */
static double tr_time_to_brake(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *rates = tr_slider_rates(s, i), *arm = TR_A(s, arm) + pair->eta0, v = tr_pair_speed(s, i);
  double along = 0.0, size = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    const double acc = tr_acceleration_now(s, pair->eta0 + j) * arm[j];
    along += acc * rates[j] * arm[j] / v, size += acc * acc;
  }
  const int turns = size - along * along > CAPTURE_ACROSS * CAPTURE_ACROSS * along * along;
  return along < 0.0 && !turns ? v / -along : INFINITY;
}

/* The speed below which pair i, which rests in `left` s, may stop, m/s. Where others are about to rest as well it is told from near by alone which
 * of them do, and how. */
static double tr_capture_speed(tr_sim *s, int i, double left) {
  int alone = tr_time_to_brake(s, i) < INFINITY;
  for (int m = 0; m < s->k->nsliders && alone; ++m) alone = m == i || !tr_rests_as_soon(s, m, left);
  return tr_speed_unit(s) * (alone ? fmax(CAPTURE_ALONE * s->set.rtol, CAPTURE_SPEED) : CAPTURE_SPEED);
}

/* Whether the pair of several components whose turning has cut the steps is about to rest: at a speed that does not count, and within a time
 * whose third power, the error of the last stretch, does not, and which is known; then the pair, else −1. (One that stops along a line passes
 * through zero and is located as any other, unless its direction is so stiff that steps shrink on the way.) After an accepted step, its end
 * evaluated. */
static int tr_ends_sliding(tr_sim *s) {
  const int i = s->friction.missed, fixed = s->set.hfixed > 0.0; /* which are made in parts of any size: what they lose tells nothing */
  tr_keep_speeds(s);
  if (i < 0 || i >= s->k->nsliders || !tr_is_set(s, i) || tr_is_stuck(s, i) || tr_pair_of(s, i)->nrates == 1) return -1;
  const double v = tr_pair_speed(s, i), unit = tr_speed_unit(s), *t = s->friction.past_t;
  double *least = TR_A(s, vmin) + i;
  if (v > 2.0 * *least) *least = 0.0; /* it has gone faster since it was last tried */
  if (!(v > REST_SPEED * unit) || (*least > 0.0 && v > 0.5 * *least)) return -1;
  const double left = fixed ? tr_time_to_brake(s, i) : tr_time_to_rest(s, i, 0), before = tr_time_to_rest(s, i, 1);
  if (!(left > 0.0 && left <= cbrt(s->set.rtol) / s->set.rate) || v > tr_capture_speed(s, i, left)) return -1;
  const double moved = fabs(t[0] + left - (t[1] + before)), gone = before - left;
  const int known = fixed || (gone > 0.0 && moved * left <= CAPTURE_TIME * s->set.rtol / s->set.rate * gone);
  if (!known && v > NEAR_MISS * unit) return -1;
  s->friction.capture_h = left;
  return i;
}

/* The fastest of rates v (n), with their units (travels: the scene's length). */
static double tr_fastest_rate(int n, const double *v, const double *unit) {
  double most = 0.0;
  for (int q = 0; q < n; ++q) most = fmax(most, fabs(v[q]) / unit[q]);
  return most;
}

/* Whether rest of the pair at (t, y), a copy of the state, leads anywhere: to sticking, or to slip in another direction. In a loop it may
 * be slow without being about to rest, at a dead centre of its own, say: what then stopped it would stop all else. Nor does one rest of which
 * a freedom is driven on, however slowly. Decided and undone. */
static int tr_rest_has_answer(tr_sim *s, double t, double *y, int i) {
  const int nv = s->k->nv, nq = s->k->nq, pair_rates = tr_pair_of(s, i)->nrates;
  const double along = pair_rates == 2 ? s->set.length : 1.0, own_unit[3] = {along, 1.0, 1.0}; /* a shaft's first rate is its travel */
  tr_mode modes[s->k->nsliders + 1];
  double change[nv + 1], unit[nv + 1];
  const double margin = s->events.margin;
  const int unsure = s->events.unsure;
  int events = s->events.count;
  long refused = s->stats.refused;
  tr_keep_modes(s, modes);
  int has = tr_rhs(s, t, y, TR_A(s, dy));
  if (has) {
    const double own = tr_fastest_rate(pair_rates, tr_slider_rates(s, i), own_unit);
    memcpy(change, y + nq, sizeof(double) * nv);
    has = tr_settle(s, t, y, i, 0) == TR_OK && tr_pair_speed(s, i) <= CRAWLS * tr_speed_unit(s);
    for (int q = 0; q < nv; ++q) change[q] -= y[nq + q], unit[q] = tr_rate_unit(s, q);
    has = has && tr_fastest_rate(nv, change, unit) <= CAPTURE_JOLT * own;
  }
  tr_put_modes(s, modes);
  s->events.count = events, s->events.margin = margin, s->events.unsure = unsure, s->stats.refused = refused;
  tr_note_modes(s);
  return has;
}

/* Freeze the directions of pairs of several components over the last stretch of pair i, which is one of them, as far as they are as slow: what
 * stops with it keeps its direction up to there, and where that answers fast to friction one that is frozen beside others that are not would turn
 * all of them. */
static void tr_freeze_last(tr_sim *s, int i) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    if (!tr_is_set(s, m) || !tr_slides(s, m) || tr_pair_of(s, m)->nrates == 1) continue;
    double r[3], v = tr_speed_of_state(s, m);
    tr_rates_of_state(s, m, r);
    if (m == i || (v > REST_SPEED * tr_speed_unit(s) && v <= CAPTURE_SPEED * tr_speed_unit(s))) tr_freeze_along(s, m, ON_LINE, r, v);
  }
}

/* Which pairs stop with pair i at the end of its last stretch: it is only the first of those that come to rest there. Maps in place. */
static void tr_note_ends(tr_sim *s, int i) {
  const double h = s->friction.capture_h;
  for (int m = 0; m < s->k->nsliders; ++m)
    tr_ends(s)[m] = m != i && tr_pair_speed(s, m) <= CAPTURE_SPEED * tr_speed_unit(s) && tr_rests_as_soon(s, m, h);
}

/* Which pairs stop at the event at which pair i does, the state there just evaluated: those of one component whose own stops follow it by less than
 * times are told from each other. In a mechanism that is symmetric they stop at once, and the step's error parts them. */
static void tr_note_same(tr_sim *s, int i) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    if (m == i || !tr_is_set(s, m) || !tr_slides(s, m) || tr_pair_of(s, m)->nrates > 1) continue;
    double change, v = tr_speed_on_line(s, m, &change);
    tr_ends(s)[m] = change < 0.0 && v <= CAPTURE_SPEED * tr_speed_unit(s) && v <= -change * STOPS_AS_ONE * s->set.rtol / s->set.rate;
  }
}

static void tr_forget_ends(tr_sim *s) { memset(tr_ends(s), 0, sizeof(int) * s->k->nsliders); }

/* The last stretch of sliding as a step of its own: y at its end by the midpoint rule, with straight lines as its dense output. 0 when
 * rest there has no answer. */
static int tr_step_capture(tr_sim *s) {
  int n = tr_width(s), i = s->friction.capture;
  double h = s->friction.capture_h, *y = TR_A(s, y), *mid = TR_A(s, ytmp), *f = TR_A(s, dy), *R = TR_A(s, kstep), *ynew = TR_A(s, ynew);
  tr_mode modes[s->k->nsliders];
  memcpy(TR_A(s, yold), y, sizeof(double) * n);
  s->friction.capture = -1;
  tr_keep_modes(s, modes);
  tr_freeze_last(s, i);
  for (int q = 0; q < n; ++q) mid[q] = y[q] + 0.5 * h * TR_A(s, K)[q];
  int ok = tr_rhs(s, s->clock.t + 0.5 * h, mid, f);
  tr_note_end(s);
  for (int q = 0; q < n; ++q) ynew[q] = y[q] + h * f[q];
  ok = ok && tr_project(s, s->clock.t + h, ynew);
  memcpy(TR_A(s, cand), ynew, sizeof(double) * n);
  if (ok) tr_maps_at(s, s->clock.t + h, ynew), tr_note_ends(s, i);
  ok = ok && tr_rest_has_answer(s, s->clock.t + h, TR_A(s, cand), i);
  if (!ok) {
    TR_A(s, vmin)[i] = tr_past_speeds(s, 0)[i];
    tr_forget_ends(s);
    tr_put_modes(s, modes);
    return 0;
  }
  s->step.t0 = s->clock.t, s->step.size = h;
  for (int q = 0; q < n; ++q) R[q] = ynew[q] - y[q];
  s->step.dense_rows = 1, s->step.have_dense = 1;
  s->pending.theta = 1.0, s->pending.which = i, s->pending.h = s->step.h, s->pending.t = s->clock.t + h, s->pending.grow = 1.0, s->pending.cut = 0;
  s->pending.captured = 1;
  return 1;
}
