/* Cases of a batch that step together (theory, "Ensembles"). Each case has its own stack, step size, method and modes, and runs the
 * code of a single run. A case that requests a step (``evaluate/lane_requests.c``) waits until enough similar requests fill the
 * SIMD lanes. Lanes are independent, so results do not depend on the other cases. If a case cannot continue here, the host runs it
 * alone. Ensembles require x86-64 outside Windows, because assembly code switches the stacks. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#if defined __x86_64__ && !defined _WIN32 && defined __clang__
#define TR_STACK_MARK 0x7472756e6e696f6eL /* mark at the end of each stack; a stack overflow overwrites it */
/* Step budget of a case per call. It is practically unlimited, because a case runs until its next request. */
#define TR_ALL_STEPS 1000000000L
enum { TR_QUEUES = TR_ASKS * TR_METHODS };

/* Switch from the present stack to `to`. The stack that is left stores the callee-saved registers (System V ABI, 3.2.1). */
__attribute__((naked, noinline)) static void tr_change_stacks(void **from __attribute__((unused)), void *to __attribute__((unused))) {
  __asm__ volatile("pushq %rbp\n pushq %rbx\n pushq %r12\n pushq %r13\n pushq %r14\n pushq %r15\n movq %rsp, (%rdi)\n"
                   "movq %rsi, %rsp\n popq %r15\n popq %r14\n popq %r13\n popq %r12\n popq %rbx\n popq %rbp\n ret");
}

/* Entry of a new stack: r13 contains the function, r12 its argument. */
__attribute__((naked, noinline)) static void tr_begin_stack(void) {
  __asm__ volatile("movq %r12, %rdi\n callq *%r13\n ud2");
}

/* Leave the stack of the case, and set the state of its strand (the stack with its cases). */
static void tr_leave_stack(tr_strand *c, int state) {
  c->state = state;
  tr_change_stacks(&c->here, c->back);
}

/* Function `ask` of a case's lane: wait until the request is served. Returns the result of the request. */
static int tr_wait_for_lane(tr_lane *lane, tr_request *request) {
  tr_strand *c = (tr_strand *)lane;
  c->request = request, request->ok = 0;
  tr_leave_stack(c, TR_STRAND_ASKS);
  return request->ok;
}

/* Run a case until it ends or cannot continue. */
static int tr_run_case(tr_strand *c) {
  for (;;) {
    const int status = tr_batch_run(c->batch, TR_ALL_STEPS);
    if (status == TR_NEED_JACOBIAN) tr_leave_stack(c, TR_STRAND_NEEDS);
    else if (status != TR_MORE) return status == TR_DONE ? TR_ENDED_WHOLE : TR_ENDED_EARLY;
  }
}

static void tr_run_strand(tr_strand *c) {
  tr_ensemble *e = c->all;
  while (e->next < e->ncases) {
    const long at = e->next++;
    c->batch->at = at, c->batch->ncases = at + 1, c->batch->running = c->batch->reported = 0;
    e->ended[at] = tr_run_case(c), e->finished++;
  }
  for (;;) tr_leave_stack(c, TR_STRAND_OVER);
}

static void tr_reset_strand(tr_strand *c, tr_ensemble *e) {
  void **top = (void **)(((size_t)c->stack + (size_t)e->stack_bytes) & ~(size_t)63);
  *(long *)c->stack = TR_STACK_MARK;
  *--top = 0, *--top = 0; /* place for `ret` to the entry function, with an aligned stack */
  *--top = (void *)tr_begin_stack;
  *--top = 0, *--top = 0;             /* rbp, rbx */
  *--top = c, *--top = (void *)tr_run_strand; /* r12, r13 */
  *--top = 0, *--top = 0;             /* r14, r15 */
  c->here = top, c->state = TR_STRAND_GOES, c->all = e, c->batch->lane = &c->lane;
  c->lane = (tr_lane){.ask = tr_wait_for_lane, .lanes = e->lanes, .columns = e->columns};
}

int tr_ensemble_there(void) { return 1; }

void tr_ensemble_begin(tr_ensemble *e) {
  e->next = e->finished = 0;
  for (long i = 0; i < e->ncases; ++i) e->ended[i] = TR_ENDED_NOT;
  for (int i = 0; i < e->strands; ++i) tr_reset_strand(e->strand + i, e);
}

void tr_ensemble_drop(tr_ensemble *e, int which) {
  e->ended[e->strand[which].batch->at] = TR_ENDED_EARLY, e->finished++;
  tr_reset_strand(e->strand + which, e);
}

/* Number of the queue for a request. Lanes can serve the requests of a queue together. */
static inline int tr_queue_of(const tr_request *request) {
  return request->kind * TR_METHODS + (request->kind <= TR_ASK_DENSE ? request->method : 0);
}

/* Serve waiting requests in groups of `width`. `all`: also serve an incomplete last group. Returns the number of calls of the
 * lanes. */
static long tr_serve_queue(tr_ensemble *e, tr_strand **asks, int count, int all) {
  tr_request *request[TR_STRANDS];
  const int width = e->lanes->width;
  long calls = 0;
  for (int first = 0; all ? first < count : first + width <= count; first += width, ++calls) {
    const int have = count - first < width ? count - first : width;
    for (int i = 0; i < width; ++i) request[i] = asks[first + (i < have ? i : 0)]->request;
    e->lanes->serve(request[0]->kind, request);
    for (int i = 0; i < have; ++i) asks[first + i]->state = TR_STRAND_GOES;
    e->calls++, e->asked += have;
  }
  return calls;
}

int tr_ensemble_run(tr_ensemble *e, long budget) {
  tr_strand *asks[TR_QUEUES][TR_STRANDS];
  for (;;) {
    int count[TR_QUEUES] = {0}, most = 0, needs = 0;
    for (int i = 0; i < e->strands; ++i) {
      tr_strand *c = e->strand + i;
      if (c->state == TR_STRAND_GOES) tr_change_stacks(&c->back, c->here);
      if (*(long *)c->stack != TR_STACK_MARK) return TR_FAIL_STALLED;
      needs += c->state == TR_STRAND_NEEDS;
      if (c->state != TR_STRAND_ASKS) continue;
      const int queue = tr_queue_of(c->request);
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
#else
int tr_ensemble_there(void) { return 0; }
void tr_ensemble_begin(tr_ensemble *e) { e->finished = 0; }
int tr_ensemble_run(tr_ensemble *e, long budget) { return e && budget ? TR_FAIL_STALLED : TR_DONE; }
void tr_ensemble_drop(tr_ensemble *e, int which) { e->finished += which < 0; }
void tr_ensemble_resume(tr_ensemble *e) { e->finished += 0; }
#endif
