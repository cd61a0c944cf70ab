/* Requests to the SIMD lanes, which step several cases at once (``hosts/batch_coroutines.c``). A case whose request lanes cannot
 * serve takes the ordinary path. */
#include "evaluate/evaluate.h"

static tr_request tr_lane_request(tr_sim *s, int kind, double t, double *y) {
  return (tr_request){.kind = kind, .method = s->step.method, .n = tr_state_width(s), .nworks = s->nworks, .watch = s->step.watch, .t = t,
                      .length = s->set.length, .rate = s->set.rate, .independence = s->loops.least, .x = TR_A(s, x), .c = TR_A(s, c), .d = TR_A(s, d),
                      .z = TR_A(s, z), .zstart = TR_A(s, zstart), .zend = TR_A(s, zend), .arm = TR_A(s, lever), .smin = TR_A(s, smin),
                      .smax = TR_A(s, smax), .N = TR_A(s, NN), .sliding = TR_A(s, sliding), .y = y, .K = TR_A(s, K), .R = TR_A(s, kstep), .yold = TR_A(s, yold), .ynew = TR_A(s, ynew),
                      .maps = TR_A(s, maps), .w = TR_A(s, w),
                      .S = TR_A(s, S), .perm = (int *)TR_A(s, perm), .T = TR_A(s, T), .Np = TR_A(s, Np), .law = TR_A(s, law), .dn = TR_A(s, dn), .first = TR_A(s, ytmp), .second = TR_A(s, yout), .slope = TR_A(s, dy)};
}

/* Send a request, and record its effects on statistics and validity. evaluations: number of right-hand-side evaluations that the
 * request replaces. Returns 0 if the lanes did not serve the request. */
static int tr_ask_lane(tr_sim *s, tr_request *request, int evaluations) {
  if (!s->lane->ask(s->lane, request)) return 0;
  s->stats.rhs_evaluations += evaluations;
  s->step.mapped = TR_MAPS_RAW, s->step.recursive = 0, s->loops.rank_now = s->k->active;
  TR_NEW_STATE(s);
  TR_MADE(s, TR_HAS_FACTOR | TR_HAS_LAW | (evaluations ? TR_HAS_SOLUTION : 0));
  if (s->k->neta && evaluations) s->stats.newton_iterations += request->iterations, s->loops.least = request->independence;
  return 1;
}

static int tr_request_step(tr_sim *s, const tr_explicit *m, double h) {
  if (!tr_has_lane(s) || s->set.hfixed > 0.0) return 0;
  tr_request request = tr_lane_request(s, TR_ASK_STEP, s->clock.t, TR_A(s, y));
  request.h = h;
  return tr_ask_lane(s, &request, m->stages - 1 + m->ends_in_error);
}

static int tr_request_dense(tr_sim *s, const tr_explicit *m, double h) {
  if (!tr_has_lane(s)) return 0;
  tr_request request = tr_lane_request(s, TR_ASK_DENSE, s->step.t0, TR_A(s, yold));
  request.h = h;
  return tr_ask_lane(s, &request, m->extra);
}

static int tr_request_end(tr_sim *s, int kind, double t, double *y, double *slope) {
  if (!tr_has_lane(s) || (kind == TR_ASK_PROJECT && !s->k->active)) return 0;
  tr_set_time(s, t);
  tr_request request = tr_lane_request(s, kind, t, y);
  request.slope = slope;
  if (!tr_ask_lane(s, &request, kind != TR_ASK_PROJECT)) return 0;
  if (s->k->active) s->audit.gap = request.gap, s->stats.projections += request.projections;
  return 1;
}

static int tr_request_violations(tr_sim *s, double t, double *y) {
  if (!s->k->neta || !tr_has_lane(s)) return 0;
  tr_set_time(s, t);
  tr_request request = tr_lane_request(s, TR_ASK_LOOK, t, y);
  return tr_ask_lane(s, &request, 1);
}
