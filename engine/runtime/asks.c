/* Steps that are made in the lanes of vectors beside those of other cases (``ensemble.c``): what a case asks for, and what it takes over. Where
 * it may not ask, or what it asked for could not be done, it goes the way of every run. */
#include "modes.h"

/* Doubles of a row of the state, integrals included. */
static inline int tr_width(const tr_sim *s) { return TR_PAD(s->ny + s->nworks + s->naudit); }

/* Whether what is asked for next may be done in a lane: all rows of the loops independent, nothing that follows tables; of what rubs nothing is
 * held at rest or given by something else than its law, and no open reactions depend on it. */
static inline int tr_may_ask(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const tr_friction *f = &s->friction;
  if (!s->lane || k->ntables || k->begin || k->shift || k->nfill || k->nkappa || s->loops.rank != k->active || !s->set.project) return 0;
  return !k->neta || !(f->still || f->freed >= 0 || f->eased > 0.0 || f->anywhere || s->moreau.h > 0.0 || s->ask.stop);
}

/* A request about the present step from state y. */
static tr_request tr_request_of(tr_sim *s, int kind, double t, double *y) {
  return (tr_request){.kind = kind, .method = s->step.method, .n = tr_width(s), .nworks = s->nworks, .naudit = s->naudit, .watch = s->step.watch, .t = t,
                      .length = s->set.length, .rate = s->set.rate, .independence = s->loops.least, .x = TR_A(s, x), .c = TR_A(s, c), .d = TR_A(s, d),
                      .z = TR_A(s, z), .zstart = TR_A(s, zstart), .zend = TR_A(s, zend), .arm = TR_A(s, arm), .smin = TR_A(s, smin),
                      .smax = TR_A(s, smax), .N = TR_A(s, NN), .sliding = TR_A(s, sliding), .y = y, .K = TR_A(s, K), .R = TR_A(s, kstep), .yold = TR_A(s, yold), .ynew = TR_A(s, ynew),
                      .maps = TR_A(s, maps), .w = TR_A(s, w),
                      .S = TR_A(s, S), .perm = (int *)TR_A(s, perm), .T = TR_A(s, T), .Np = TR_A(s, Np), .law = TR_A(s, law), .dn = TR_A(s, dn), .first = TR_A(s, ytmp), .second = TR_A(s, yout), .slope = TR_A(s, dy)};
}

/* Ask, and note what so many evaluations leave behind. */
static int tr_asked(tr_sim *s, tr_request *request, int evaluations) {
  if (!s->lane->ask(s->lane, request)) return 0;
  s->stats.rhs_evaluations += evaluations;
  s->step.mapped = TR_MAPS_RAW, s->step.along = 0, s->loops.rank_now = s->k->active;
  if (s->k->neta && evaluations) s->stats.newton_iterations += request->iterations, s->loops.least = request->independence;
  return 1;
}

/* Stages, end and errors of a trial step of size h. 1 when they have been made. */
static int tr_asks_step(tr_sim *s, const tr_explicit *m, double h) {
  if (!tr_may_ask(s) || s->set.hfixed > 0.0) return 0;
  tr_request request = tr_request_of(s, TR_ASK_STEP, s->clock.t, TR_A(s, y));
  request.h = h;
  return tr_asked(s, &request, m->stages - 1 + m->ends_in_error);
}

/* The extra stages of the dense output of the step just made. */
static int tr_asks_dense(tr_sim *s, const tr_explicit *m, double h) {
  if (!tr_may_ask(s)) return 0;
  tr_request request = tr_request_of(s, TR_ASK_DENSE, s->step.t0, TR_A(s, yold));
  request.h = h;
  return tr_asked(s, &request, m->extra);
}

/* State y at time t back onto the manifold, and (TR_ASK_END, TR_ASK_ALL) its slope. */
static int tr_asks_end(tr_sim *s, int kind, double t, double *y, double *slope) {
  if (!tr_may_ask(s) || (kind == TR_ASK_PROJECT && !s->k->active)) return 0;
  tr_set_time(s, t);
  tr_request request = tr_request_of(s, kind, t, y);
  request.slope = slope;
  if (!tr_asked(s, &request, kind != TR_ASK_PROJECT)) return 0;
  if (s->k->active) s->audit.gap = request.gap, s->stats.projections += request.projections;
  return 1;
}

/* How far pairs are from the ends of their modes at (t, y): multipliers, loads, how they slide. */
static int tr_asks_look(tr_sim *s, double t, double *y) {
  if (!s->k->neta || !tr_may_ask(s)) return 0;
  tr_set_time(s, t);
  tr_request request = tr_request_of(s, TR_ASK_LOOK, t, y);
  return tr_asked(s, &request, 1);
}
