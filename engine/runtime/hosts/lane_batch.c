/* Cases of a batch that step together (theory, "Ensembles"). Each case has its own step size, method and modes, and runs the code
 * of a single run. A case that waits for lanes (``evaluate/lane_requests.c``) waits until enough similar requests fill them. Lanes
 * are independent, so results do not depend on the other cases. A case that cannot continue with lanes is run alone by the host. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

/* Step budget of a case in a call: practically unlimited, because a case runs until its next request. */
#define TR_ALL_STEPS 1000000000L
enum { TR_QUEUES = TR_ASKS * TR_METHODS };

/* Run the cases of a strand, one after another, until a case must wait or no case is left. Returns the state of the strand. */
static int tr_run_strand(tr_ensemble *e, tr_strand *c) {
  for (;;) {
    if (!c->running) {
      if (e->next >= e->ncases) return TR_STRAND_OVER;
      c->batch->at = e->next, c->batch->ncases = ++e->next, c->batch->running = c->batch->reported = 0;
      c->running = 1, c->lane.state = TR_LANE_FREE;
    }
    const int status = tr_batch_run(c->batch, TR_ALL_STEPS);
    if (status == TR_WAITS) return TR_STRAND_ASKS;
    if (status == TR_NEED_JACOBIAN) return TR_STRAND_NEEDS;
    if (status == TR_MORE) continue;
    e->ended[c->batch->ncases - 1] = status == TR_DONE ? TR_ENDED_WHOLE : TR_ENDED_EARLY;
    e->finished++, c->running = 0;
  }
}

void tr_ensemble_begin(tr_ensemble *e) {
  e->next = e->finished = 0;
  for (long i = 0; i < e->ncases; ++i) e->ended[i] = TR_ENDED_NOT;
  for (tr_strand *c = e->strand; c < e->strand + e->strands; ++c) {
    c->lane = (tr_lane){.lanes = e->lanes, .columns = e->columns};
    c->batch->lane = &c->lane;
    c->running = 0, c->state = TR_STRAND_GOES;
  }
}

void tr_ensemble_drop(tr_ensemble *e, int which) {
  tr_strand *c = e->strand + which;
  e->ended[c->batch->ncases - 1] = TR_ENDED_EARLY, e->finished++;
  c->running = 0, c->state = TR_STRAND_GOES;
}

/* Number of the queue of a request. The lanes can serve all requests of a queue together. */
static inline int tr_queue_of(const tr_request *request) {
  return request->kind * TR_METHODS + (request->kind <= TR_ASK_DENSE ? request->method : 0);
}

/* Serve waiting requests in groups of `width`. all: whether to serve an incomplete last group, too. Returns the number of calls of
 * the lanes. */
static long tr_serve_queue(tr_ensemble *e, tr_strand **asks, int count, int all) {
  tr_request *request[TR_STRANDS];
  const int width = e->lanes->width;
  long calls = 0;
  for (int first = 0; all ? first < count : first + width <= count; first += width, ++calls) {
    const int have = count - first < width ? count - first : width;
    for (int i = 0; i < width; ++i) request[i] = &asks[first + (i < have ? i : 0)]->lane.request;
    e->lanes->serve(request[0]->kind, request);
    for (int i = 0; i < have; ++i) asks[first + i]->lane.state = TR_LANE_SERVED, asks[first + i]->state = TR_STRAND_GOES;
    e->calls++, e->asked += have;
  }
  return calls;
}

int tr_ensemble_run(tr_ensemble *e, long budget) {
  tr_strand *asks[TR_QUEUES][TR_STRANDS];
  for (;;) {
    int count[TR_QUEUES] = {0}, most = 0, needs = 0;
    for (tr_strand *c = e->strand; c < e->strand + e->strands; ++c) {
      if (c->state == TR_STRAND_GOES) c->state = tr_run_strand(e, c);
      needs += c->state == TR_STRAND_NEEDS;
      if (c->state != TR_STRAND_ASKS) continue;
      const int queue = tr_queue_of(&c->lane.request);
      asks[queue][count[queue]++] = c;
      if (count[queue] > count[most]) most = queue;
    }
    if (needs) return TR_NEED_JACOBIAN;
    if (!count[most]) return TR_DONE;
    if (budget <= 0) return TR_MORE;
    for (int q = 0; q < TR_QUEUES; ++q) budget -= tr_serve_queue(e, asks[q], count[q], q == most && count[q] < e->lanes->width);
  }
}

void tr_ensemble_resume(tr_ensemble *e) {
  for (int i = 0; i < e->strands; ++i)
    if (e->strand[i].state == TR_STRAND_NEEDS) e->strand[i].state = TR_STRAND_GOES;
}
