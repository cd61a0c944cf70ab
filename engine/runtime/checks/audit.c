/* The audit: whether the run satisfies its laws (theory, "Audit"). The audit evaluates the accepted solution at the end of each
 * step, and changes nothing. The audit balances the energy between the ends of steps. For every other law, the audit stores the
 * largest violation ("figure"). */
#include "checks/checks.h"

#define EVERY_STEPS 4    /* number of steps from one energy balance to the next; a balance shows a loss in any of these steps */
#define FIRST_ORDER 1e-4 /* tolerance assumed for steps without error control, and for impulse steps where events accumulate */
#define LEAST_RTOL 1e-12 /* smallest tolerance of the audit; with a tighter tolerance, errors of results are round-off */
#define FAR_OFF 1e3      /* relative to tolerance × the energy turned over: a run with more unexplained energy is inaccurate */
/* relative to the energy turned over: a run with more unexplained energy is inaccurate, whatever its tolerance */
#define AT_MOST 0.1
/* relative to the energy turned over: unexplained energy that is allowed if the mechanism has loops, which may be singular */
#define SINGULAR_LOSS 1e-6
#define NOTED 0.1 /* relative to the unexplained energy above which a run is inaccurate: more unexplained energy causes a note */
#define ROUND_OFF_TERMS 1e-11 /* relative to the sum of all terms of the balance: round-off of these terms over a run */
#define LAW_LEAST 1e-6   /* relative to a law's unit: smaller figures cause no note */
#define FAINT_LOAD 1e-9  /* relative to the largest friction: if a pair has less friction, its friction ratio is round-off */
/* in units of energy over length: if all pairs have less friction, their friction is round-off, for example with μ = 0 */
#define LEAST_LOAD 1e-15
/* in units of length · rate²: if the terms of an acceleration are smaller, the acceleration is round-off (a pendulum that hangs
 * still) */
#define FAINT_TERMS 1e-9

static double tr_audit_tolerance(const tr_sim *s) {
  const int stepped = s->set.hfixed > 0.0 || s->moreau.first_t >= 0.0;
  return fmax(fmax(s->set.rtol, LEAST_RTOL), stepped ? FIRST_ORDER : 0.0);
}

/* Store a figure of the last step if it is larger than the stored figure. */
static inline void tr_audit_record(tr_audit *a, int law, double size, int pair) {
  if (size > a->size[law]) a->size[law] = size, a->pair[law] = pair;
}

/* Acceleration of freedom i from all multipliers, divided by the sum of its absolute terms. `it`: the solution recomputed without
 * maps; if `it` is a null pointer, raw maps give the acceleration. */
static double tr_audit_relative_acceleration(tr_sim *s, int i, const tr_recomputed *it) {
  double size, sum = it ? it->acc[i] : tr_acceleration_and_terms(s, i, &size);
  if (it) size = it->acc_size[i];
  return fabs(sum) / fmax(size, FAINT_TERMS * tr_speed_unit(s) * s->set.rate / TR_A(s, lever)[i]);
}

/* Record the speed and the relative accelerations of a held pair. For prescribed freedoms only the speed is recorded, because their
 * accelerations have no terms that cancel. Requires a solution. */
static void tr_audit_rest(tr_sim *s, int i, const tr_recomputed *it) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_audit_record(&s->audit, TR_LAW_CREEPS, tr_pair_speed(s, i) / tr_speed_unit(s), i);
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j)
    if (tr_row_kinds(s)[j] != TR_ROW_FREE) tr_audit_record(&s->audit, TR_LAW_UNREST, tr_audit_relative_acceleration(s, j, it), i);
}

/* Power of a pair's friction, W; positive if friction drives the pair. */
static double tr_audit_power(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *rate = map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  double power = 0.0;
  for (int j = 0; j < pair->neta; ++j) power -= eta[j] * rate[j];
  return power;
}

/* Record the figures of the friction laws at the end of the last step. Requires the solution at this end. checked: see
 * tr_audit_laws. */
static void tr_audit_friction(tr_sim *s, int checked) {
  TR_NEED(s, TR_HAS_SOLUTION);
  const tr_kernel *k = s->k;
  tr_audit *a = &s->audit;
  double load = LEAST_LOAD * s->set.energy / s->set.length, *acc = TR_A(s, end_acc), N[k->nn], law[k->neta];
  tr_sliding sliding[k->nsliders + 1];
  tr_recomputed again = {.acc = acc, .acc_size = acc + k->neta + k->active, .N = N, .law = law, .sliding = sliding}, *it = 0;
  if (s->step.recursive && !s->step.mapped && tr_has_stuck_pair(s)) it = &again;
  if (it && !checked) tr_recompute_recursive(s, it, 1);
  /* otherwise, tr_update_extremes has evaluated the capacities */
  if (k->sets && !(s->friction.held && s->step.watch)) tr_evaluate_capacities(s);
  for (int i = 0; i < k->nsliders && k->sets; ++i) load = fmax(load, tr_hold_of(s, i)->size);
  for (int i = 0; i < k->nsliders; ++i) {
    double power = tr_audit_power(s, i);
    const int held = tr_is_set_valued(s, i) && tr_is_stuck(s, i); /* the power of a held pair is round-off */
    a->power = fmax(a->power, fabs(power));
    if (power > 0.0 && !held && !tr_pair_of(s, i)->stores)
      tr_audit_record(a, TR_LAW_DRIVES, power / (a->power + s->set.rtol * s->set.energy * s->set.rate), i);
    if (!held) continue; /* TR_LAW_FRICTION judges sliding pairs */
    if (tr_hold_of(s, i)->size > FAINT_LOAD * load) tr_audit_record(a, TR_LAW_CONE, tr_friction_ratio(s, i) - 1.0, i);
    tr_audit_rest(s, i, it);
  }
}

static void tr_audit_laws(tr_sim *s, int checked) {
  tr_audit *a = &s->audit;
  if (s->k->active + s->k->neta == 0) return; /* without multipliers, only the energy balance applies */
  for (int i = 0; i < TR_LAWS; ++i) a->size[i] = 0.0, a->pair[i] = -1.0;
  if (s->k->active) a->size[TR_LAW_CLOSURE] = a->gap;
  if (s->k->neta) tr_audit_friction(s, checked);
}

/* Energies and works at the state y. Requires the signals of y. */
static void tr_audit_energies(tr_sim *s, const double *y, double *kinetic, double *potential, double *taken, double *given) {
  const tr_kernel *k = s->k;
  double out[2];
  k->energy(TR_A(s, x), y, TR_A(s, c) + k->c_energy, out);
  *kinetic = out[0], *potential = out[1];
  const double *sums = y + s->ny + s->nworks;
  *taken = sums[0], *given = sums[1];
}

/* Balance the energy at (t, y). */
static void tr_audit_balance(tr_sim *s, double t, const double *y) {
  tr_audit *a = &s->audit;
  double kinetic, potential, taken, given;
  tr_set_time(s, t);
  tr_audit_energies(s, y, &kinetic, &potential, &taken, &given);
  a->known = taken - given < INFINITY; /* works are NaN if the powers in the middle of a stiff step have no solution */
  if (!a->known) return;
  const double lost = kinetic + potential - taken - given - a->begin;
  a->all.turned += 0.5 * (fabs(kinetic - a->kinetic) + fabs(potential - a->potential) + fabs(taken - a->taken) + fabs(given - a->given));
  if (fabs(lost - a->lost) > a->jump) {
    a->jump = fabs(lost - a->lost), a->all.jump_time = t;
    a->all.jump_joint = s->events.last.time >= a->seen ? s->events.last.element : 0.0;
  }
  if (fabs(lost) > fabs(a->all.lost)) a->all.lost = lost, a->all.lost_time = t;
  a->most = fmax(a->most, kinetic), a->terms = fmax(a->terms, kinetic + fabs(potential) + fabs(taken) + fabs(given));
  a->kinetic = kinetic, a->potential = potential, a->taken = taken, a->given = given, a->lost = lost, a->seen = t;
}

static void tr_audit_step(tr_sim *s, double t, const double *y) {
  tr_audit *a = &s->audit;
  for (int i = 0; i < TR_LAWS && s->k->active + s->k->neta; ++i) {
    tr_worst *worst = a->all.law + i;
    if (a->size[i] > worst->size)
      *worst = (tr_worst){a->size[i], t, a->pair[i] < 0.0 ? 0.0 : 1.0 + tr_pair_of(s, (int)a->pair[i])->element};
  }
  if (a->known && s->stats.steps % EVERY_STEPS == 0) tr_audit_balance(s, t, y);
}

static void tr_audit_impulses(tr_sim *s, double t, const double *y) {
  if (s->audit.known && s->stats.steps % EVERY_STEPS == 0) tr_audit_balance(s, t, y);
}

static void tr_audit_begin(tr_sim *s) {
  tr_audit *a = &s->audit;
  double *y = TR_A(s, y);
  a->all = (tr_judgement){.lost_time = -1.0, .jump_time = -1.0};
  for (int i = 0; i < TR_LAWS; ++i) a->all.law[i] = (tr_worst){.time = -1.0};
  for (int i = 0; i < TR_AUDIT_SUMS; ++i) y[s->ny + s->nworks + i] = 0.0;
  a->known = 1;
  tr_set_time(s, s->clock.t);
  tr_audit_energies(s, y, &a->kinetic, &a->potential, &a->taken, &a->given);
  a->begin = a->kinetic + a->potential - a->taken - a->given, a->most = a->kinetic, a->lost = a->jump = 0.0, a->seen = s->clock.t;
}

static double tr_audit_energy(tr_sim *s) {
  double kinetic, potential, taken, given;
  if (!s->audit.known) return 0.0;
  tr_set_time(s, s->clock.t);
  tr_audit_energies(s, TR_A(s, y), &kinetic, &potential, &taken, &given);
  return kinetic + potential - taken - given;
}

void tr_audit_end(tr_sim *s) {
  const int watch = s->step.watch;
  if (s->clock.t == s->clock.t_start && s->stats.steps == 0) return;
  s->step.watch = 0;
  double y[tr_state_width(s)];
  memcpy(y, TR_A(s, y), sizeof y);
  if (tr_project(s, s->clock.t, y) && tr_rhs(s, s->clock.t, y, TR_A(s, dy))) {
    tr_audit_laws(s, 0);
    if (s->k->neta) tr_certify(s), tr_audit_record(&s->audit, TR_LAW_FRICTION, s->audit.complement, -1);
    tr_audit_step(s, s->clock.t, y);
    if (s->audit.known) tr_audit_balance(s, s->clock.t, y);
  }
  s->step.watch = watch;
}

void tr_judge(const tr_sim *s, tr_judgement *out) {
  const tr_audit *a = &s->audit;
  *out = a->all;
  const double own = a->most + a->all.turned, tolerance = tr_audit_tolerance(s);
  const double far = fmin(FAR_OFF * tolerance, AT_MOST), limit = fmax(far, s->k->active ? SINGULAR_LOSS : 0.0);
  out->tolerance = tolerance, out->judged = a->known && own < INFINITY && fabs(a->all.lost) < INFINITY;
  out->noted = fmax(LAW_LEAST, RUN_ERROR * tolerance), out->noted_energy = NOTED * far;
  const double beyond = fabs(out->lost) - ROUND_OFF_TERMS * a->terms;
  out->turned = own + sqrt(own * s->set.energy); /* the second term allows for slow motion, whose tolerance is absolute */
  out->share = out->turned > 0.0 ? fabs(out->lost) / out->turned : 0.0;
  for (int i = 0; i < TR_LAWS; ++i)
    if (a->all.law[i].size > out->noted) out->verdict = TR_VERDICT_NOTE;
  if (out->judged && beyond > out->noted_energy * out->turned) out->verdict = beyond > limit * out->turned ? TR_VERDICT_INACCURATE : TR_VERDICT_NOTE;
}
