/* Cases of a batch that make their steps together. Each goes its own way, with its own step size, error, method and modes, on a stack of its
 * own, by the code of every run; where that asks for a step (``asks.c``) it waits until as many cases wait for the same as vectors have lanes.
 * Lanes know nothing of each other, so that a case's numbers do not depend on who its neighbours are. A case that cannot go on is left to
 * the host, which makes it by itself. Stacks are changed by a few instructions, known for one kind of processor: elsewhere there are no ensembles. */
#include "modes.h"

#if defined __x86_64__ && !defined _WIN32 && defined __clang__
#define TR_STACK_MARK 0x7472756e6e696f6eL /* at the end of each stack: it has overflowed where that is gone */
#define TR_ALL_STEPS 1000000000L          /* of a case: it goes on until it asks */
enum { TR_QUEUES = TR_ASKS * TR_METHODS };

/* Go on where the other stack was left. Registers that a function keeps (System V ABI, 3.2.1) are on the stack that is left. */
__attribute__((naked, noinline)) static void tr_change_stacks(void **from __attribute__((unused)), void *to __attribute__((unused))) {
  __asm__ volatile("pushq %rbp\n pushq %rbx\n pushq %r12\n pushq %r13\n pushq %r14\n pushq %r15\n movq %rsp, (%rdi)\n"
                   "movq %rsi, %rsp\n popq %r15\n popq %r14\n popq %r13\n popq %r12\n popq %rbx\n popq %rbp\n ret");
}

/* Where a new stack begins: what is called, and with what, wait in registers. */
__attribute__((naked, noinline)) static void tr_begin_stack(void) {
  __asm__ volatile("movq %r12, %rdi\n callq *%r13\n ud2");
}

/* Leave the case's stack, in this state. */
static void tr_leave(tr_strand *c, int state) {
  c->state = state;
  tr_change_stacks(&c->here, c->back);
}

/* What a case's lane does when it is asked. */
static int tr_wait_for(tr_lane *lane, tr_request *request) {
  tr_strand *c = (tr_strand *)lane;
  c->request = request, request->ok = 0;
  tr_leave(c, TR_STRAND_ASKS);
  return request->ok;
}

/* A case to its end, or to where it cannot go on. */
static int tr_through_case(tr_strand *c) {
  for (;;) {
    const int status = tr_batch_run(c->batch, TR_ALL_STEPS);
    if (status == TR_NEED_JACOBIAN) tr_leave(c, TR_STRAND_NEEDS);
    else if (status != TR_MORE) return status == TR_DONE ? TR_ENDED_WHOLE : TR_ENDED_EARLY;
  }
}

/* Case after case, as long as there are any. */
static void tr_strand_goes(tr_strand *c) {
  tr_ensemble *e = c->all;
  while (e->next < e->ncases) {
    const long at = e->next++;
    c->batch->at = at, c->batch->ncases = at + 1, c->batch->running = c->batch->reported = 0;
    e->ended[at] = tr_through_case(c), e->finished++;
  }
  for (;;) tr_leave(c, TR_STRAND_OVER);
}

/* A strand with an empty stack. */
static void tr_strand_anew(tr_strand *c, tr_ensemble *e) {
  void **top = (void **)(((size_t)c->stack + (size_t)e->stack_bytes) & ~(size_t)63);
  *(long *)c->stack = TR_STACK_MARK;
  *--top = 0, *--top = 0; /* the first function is entered as if it had been called */
  *--top = (void *)tr_begin_stack;
  *--top = 0, *--top = 0;             /* rbp, rbx */
  *--top = c, *--top = (void *)tr_strand_goes; /* r12, r13 */
  *--top = 0, *--top = 0;             /* r14, r15 */
  c->here = top, c->state = TR_STRAND_GOES, c->all = e, c->batch->lane = &c->lane;
  c->lane = (tr_lane){.ask = tr_wait_for, .lanes = e->lanes, .columns = e->columns};
}

/* Whether this processor has ensembles. */
int tr_ensemble_there(void) { return 1; }

/* Begin with all cases. */
void tr_ensemble_begin(tr_ensemble *e) {
  e->next = e->finished = 0;
  for (long i = 0; i < e->ncases; ++i) e->ended[i] = TR_ENDED_NOT;
  for (int i = 0; i < e->strands; ++i) tr_strand_anew(e->strand + i, e);
}

/* Let go of the case that a strand is in the middle of: the host makes it by itself. */
void tr_ensemble_drop(tr_ensemble *e, int which) {
  e->ended[e->strand[which].batch->at] = TR_ENDED_EARLY, e->finished++;
  tr_strand_anew(e->strand + which, e);
}

/* Cases that ask for the same wait in one queue. */
static inline int tr_queue_of(const tr_request *request) {
  return request->kind * TR_METHODS + (request->kind <= TR_ASK_DENSE ? request->method : 0);
}

/* Serve cases that wait for the same, `width` at a time; all: what is left over too. Returns how many calls that took. */
static long tr_serve(tr_ensemble *e, tr_strand **asks, int count, int all) {
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

/* Go on for about so many calls of the vectors. TR_DONE: all cases have ended; TR_MORE: call again; TR_NEED_JACOBIAN: some wait for the
 * Jacobian unit; TR_FAIL_STALLED: a stack has overflowed. */
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
    for (int q = 0; q < TR_QUEUES; ++q) budget -= tr_serve(e, asks[q], count[q], q == most && count[q] < e->lanes->width);
  }
}

/* The host has provided the Jacobian unit. */
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
