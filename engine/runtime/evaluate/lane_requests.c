/* Requests to the SIMD lanes, which step several cases at once (``hosts/lane_batch.c``). A case waits for its request between two
 * phases of a step (``stepping/trial_step.c``). If lanes cannot serve its request, the case computes the result itself. */
#include "evaluate/evaluate.h"

static tr_request tr_lane_request(tr_sim *s, int kind, double t, double *y) {
  return (tr_request){.kind = kind, .method = s->step.method, .n = tr_state_width(s), .nworks = s->nworks, .watch = s->step.watch, .t = t,
                      .length = s->set.length, .rate = s->set.rate, .independence = s->loops.least, .x = TR_A(s, x), .c = TR_A(s, c), .d = TR_A(s, d),
                      .z = TR_A(s, z), .zstart = TR_A(s, zstart), .zend = TR_A(s, zend), .arm = TR_A(s, lever), .smin = TR_A(s, smin),
                      .smax = TR_A(s, smax), .N = TR_A(s, NN), .sliding = TR_A(s, sliding), .y = y, .K = TR_A(s, K), .R = TR_A(s, kstep), .yold = TR_A(s, yold), .ynew = TR_A(s, ynew),
                      .maps = TR_A(s, maps), .w = TR_A(s, w),
                      .S = TR_A(s, S), .perm = (int *)TR_A(s, perm), .T = TR_A(s, T), .Np = TR_A(s, Np), .law = TR_A(s, law), .dn = TR_A(s, dn), .first = TR_A(s, ytmp), .second = TR_A(s, yout), .slope = TR_A(s, dy)};
}

/* Make the request, unless the lanes have served it. Returns whether the case must wait. */
static int tr_ask_lane(tr_sim *s, int kind, double t, double *y, double h, double *slope) {
  tr_lane *lane = s->lane;
  if (lane->state == TR_LANE_SERVED && lane->request.kind == kind) return 0;
  lane->request = tr_lane_request(s, kind, t, y);
  lane->request.h = h, lane->request.slope = slope;
  lane->state = TR_LANE_ASKS;
  return 1;
}

static int tr_wait_for_step(tr_sim *s, double h) {
  return tr_has_lane(s) && s->set.hfixed <= 0.0 && tr_ask_lane(s, TR_ASK_STEP, s->clock.t, TR_A(s, y), h, 0);
}

static int tr_wait_for_dense(tr_sim *s) {
  return tr_has_lane(s) && tr_ask_lane(s, TR_ASK_DENSE, s->step.t0, TR_A(s, yold), s->step.size, 0);
}

static int tr_wait_for_end(tr_sim *s, double t, double *slope) {
  if (!tr_has_lane(s)) return 0;
  tr_set_time(s, t);
  return tr_ask_lane(s, TR_ASK_END, t, TR_A(s, ynew), 0.0, slope);
}

static int tr_take_from_lane(tr_sim *s, int kind, int evaluations) {
  tr_lane *lane = s->lane;
  if (!lane || lane->state != TR_LANE_SERVED || lane->request.kind != kind) return 0;
  lane->state = TR_LANE_FREE;
  if (!lane->request.ok) return 0;
  s->stats.rhs_evaluations += evaluations;
  s->step.mapped = TR_MAPS_RAW, s->step.recursive = 0, s->loops.rank_now = s->k->active;
  TR_NEW_STATE(s);
  TR_MADE(s, TR_HAS_FACTOR | TR_HAS_LAW | TR_HAS_SOLUTION);
  if (s->k->neta) s->stats.newton_iterations += lane->request.iterations, s->loops.least = lane->request.independence;
  if (kind == TR_ASK_END && s->k->active) s->audit.gap = lane->request.gap, s->stats.projections += lane->request.projections;
  return 1;
}
