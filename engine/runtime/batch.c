/* Many cases of one structure per call: set parameters, assemble, start, step to the end and reduce the output rows, case after
 * case, without the interpreter. A case takes exactly the way a single run takes (a fresh block, the same calls in the same order),
 * so its numbers are the same to the last bit. The host owns all memory; a call returns when its step budget is used up. */
#include "tr.h"

#define TR_KINDS 16 /* kinds of events counted apart */
enum { TR_C_STATUS, TR_C_TIME, TR_C_ROWS, TR_C_STEPS, TR_C_DETAIL, TR_C_COUNT, TR_C_FIRST = TR_C_COUNT + TR_KINDS, TR_C_COLUMNS = TR_C_FIRST + TR_KINDS };
enum { TR_R_MAX, TR_R_MIN, TR_R_FINAL, TR_R_MEAN, TR_R_FINITE, TR_REDUCED };
enum { TR_S_RTOL, TR_S_LENGTH, TR_S_RATE, TR_S_UNTIL, TR_S_EVERY, TR_S_ENERGY, TR_CASE_SETTINGS };
enum { TR_CASE_FAILED = 20 }; /* a case ended early: the host may look at the block, then call again */

/* A kernel's blocks: as prepared by the host; working copies without and with the Jacobian unit (0: not there yet). */
typedef struct tr_variant {
  const tr_sim *fresh;
  tr_sim *plain, *full;
  const tr_jacobian *j;
  size_t full_bytes;
} tr_variant;

typedef struct tr_batch {
  tr_variant variant[2]; /* as generated, and its redundant variant */
  tr_settings settings;  /* of all cases; the numbers in `set` replace its own */
  long ncases, at, capacity;
  int ntable, width, running, which, reported;
  /* per case: parameters (np), start state (nq + nv), what of it is given (by rate: nv, nv), inputs, settings */
  const double *p, *y, *given, *inputs, *set;
  double *rows, *scratch, *out; /* capacity × width; for the redundancy of loops; per case TR_C_COLUMNS + TR_REDUCED × width */
  tr_sim *now;
  double last;
} tr_batch;

static double *tr_case_out(const tr_batch *b) { return b->out + (size_t)b->at * (TR_C_COLUMNS + TR_REDUCED * b->width); }

static void tr_case_clear(tr_batch *b) {
  double *o = tr_case_out(b);
  memset(o, 0, sizeof(double) * (TR_C_COLUMNS + TR_REDUCED * b->width));
  for (int i = 0; i < TR_KINDS; ++i) o[TR_C_FIRST + i] = NAN;
  for (int i = 0; i < b->width; ++i) {
    double *r = o + TR_C_COLUMNS + TR_REDUCED * i;
    r[TR_R_MAX] = r[TR_R_MIN] = r[TR_R_FINAL] = NAN;
  }
}

/* One row into the reductions: largest, smallest and sum of the finite values, last value as it is. */
static void tr_case_row(tr_batch *b, const double *row) {
  double *o = tr_case_out(b), *r = o + TR_C_COLUMNS;
  o[TR_C_ROWS] += 1.0, b->last = row[0];
  for (int i = 0; i < b->width; ++i, r += TR_REDUCED) {
    double v = row[i];
    r[TR_R_FINAL] = v;
    if (!isfinite(v)) continue;
    if (!(r[TR_R_MAX] >= v)) r[TR_R_MAX] = v;
    if (!(r[TR_R_MIN] <= v)) r[TR_R_MIN] = v;
    r[TR_R_MEAN] += v, r[TR_R_FINITE] += 1.0;
  }
}

static void tr_case_events(tr_batch *b, tr_sim *s) {
  double *o = tr_case_out(b);
  for (int i = 0; i < s->nev; ++i) {
    const double *e = TR_A(s, ev) + TR_EVENT * i;
    int kind = (int)e[1] & (TR_KINDS - 1);
    if (o[TR_C_COUNT + kind]++ == 0.0) o[TR_C_FIRST + kind] = e[0];
  }
  s->nev = 0;
}

/* A fresh block of a variant with the case's numbers in it. */
static tr_sim *tr_case_block(tr_batch *b, int which) {
  tr_variant *v = b->variant + which;
  tr_sim *s = v->plain;
  memcpy(s, v->fresh, v->fresh->bytes);
  const tr_kernel *k = s->k;
  memcpy(TR_A(s, p), b->p + (size_t)b->at * k->np, sizeof(double) * k->np);
  int n = tr_inputs(s);
  for (int i = 0; i < n; ++i) TR_A(s, tables)[(int)TR_A(s, tables)[i] + 3] = b->inputs[(size_t)b->at * n + i];
  tr_set_parameters(s);
  const double *set = b->set + (size_t)b->at * TR_CASE_SETTINGS;
  tr_settings o = b->settings;
  o.rtol = set[TR_S_RTOL], o.length = set[TR_S_LENGTH], o.rate = set[TR_S_RATE];
  tr_configure(s, &o);
  tr_set_energy(s, set[TR_S_ENERGY]);
  b->which = which, b->now = s;
  return s;
}

/* Assemble and start a case; TR_OK when it runs. */
static int tr_case_start(tr_batch *b) {
  tr_sim *s = tr_case_block(b, 0);
  const tr_kernel *k = s->k;
  const double *set = b->set + (size_t)b->at * TR_CASE_SETTINGS, *given = b->given + (size_t)b->at * 2 * k->nv;
  double *o = tr_case_out(b);
  tr_case_clear(b);
  memcpy(TR_A(s, y), b->y + (size_t)b->at * (k->nq + k->nv), sizeof(double) * (k->nq + k->nv));
  int code = tr_assemble(s, 0.0, given, given + k->nv);
  if (code != 1) {
    o[TR_C_DETAIL] = code;
    return TR_FAIL_CLOSURE;
  }
  int status = tr_start(s, 0.0, set[TR_S_UNTIL], set[TR_S_EVERY], b->rows);
  if (status == TR_NEED_REDUNDANT) {
    if (!b->variant[1].fresh) return status;
    double y[s->ny + k->nquad + 1];
    memcpy(y, TR_A(s, y), sizeof(double) * (s->ny + k->nquad));
    s = tr_case_block(b, 1);
    memcpy(TR_A(s, y), y, sizeof(double) * (s->ny + k->nquad));
    status = tr_start(s, 0.0, set[TR_S_UNTIL], set[TR_S_EVERY], b->rows);
  }
  if (status != TR_OK) return status;
  tr_case_row(b, b->rows);
  if (k->rows) tr_redundancy(s, b->scratch);
  return TR_OK;
}

/* The case is over: what is left of its rows and events, means, outcome. */
static void tr_case_end(tr_batch *b, int status) {
  tr_sim *s = b->now;
  double *o = tr_case_out(b), *r = o + TR_C_COLUMNS;
  const double *set = b->set + (size_t)b->at * TR_CASE_SETTINGS;
  if (status == TR_DONE && set[TR_S_EVERY] > 0.0 && set[TR_S_UNTIL] - b->last > 1e-9 * set[TR_S_UNTIL]) {
    tr_row(s, b->rows);
    tr_case_row(b, b->rows);
  }
  for (int i = 0; i < b->width; ++i, r += TR_REDUCED) r[TR_R_MEAN] = r[TR_R_FINITE] > 0.0 ? r[TR_R_MEAN] / r[TR_R_FINITE] : NAN;
  o[TR_C_STATUS] = status;
  o[TR_C_TIME] = status == TR_DONE ? set[TR_S_UNTIL] : s->t;
  o[TR_C_STEPS] = (double)s->stats.steps;
  b->running = 0;
}

/* Give the running case the Jacobian unit; 0 when the host has not provided it yet. */
static int tr_case_attach(tr_batch *b) {
  tr_variant *v = b->variant + b->which;
  if (!v->full) return 0;
  memset(v->full, 0, v->full_bytes);
  if (!tr_attach_jacobian(v->full, b->now, v->j, b->ntable)) return 0;
  b->now = v->full;
  return 1;
}

/* Go on with the batch for about `budget` steps and rows. TR_DONE: all cases done; TR_MORE: call again; TR_CASE_FAILED: a case ended
 * early (its block is `now` until the next call); TR_NEED_JACOBIAN, TR_NEED_REDUNDANT: provide it in variant[which] and call again. */
int tr_batch_run(tr_batch *b, long budget) {
  while (b->at < b->ncases) {
    int status = TR_OK;
    long count = 0;
    if (b->reported) {
      b->reported = 0, b->at++;
      continue;
    }
    if (budget <= 0) return TR_MORE;
    if (!b->running) {
      budget -= 20; /* assembly and start cost about as much as that many steps */
      status = tr_case_start(b);
      if (status == TR_NEED_REDUNDANT) return status;
      b->running = 1;
    }
    if (status == TR_OK) {
      long before = b->now->stats.steps;
      status = tr_advance(b->now, b->set[(size_t)b->at * TR_CASE_SETTINGS + TR_S_UNTIL], budget, b->rows, b->capacity, &count);
      budget -= 1 + (b->now->stats.steps - before) + count;
      for (long i = 0; i < count; ++i) tr_case_row(b, b->rows + i * b->width);
      tr_case_events(b, b->now);
    }
    if (status == TR_NEED_JACOBIAN) {
      if (!tr_case_attach(b)) return status;
    } else if (status == TR_DONE) {
      tr_case_end(b, status);
      b->at++;
    } else if (status >= TR_DONE) {
      tr_case_end(b, status);
      b->reported = 1;
      return TR_CASE_FAILED;
    }
  }
  return TR_DONE;
}

size_t tr_batch_size(void) { return sizeof(tr_batch); }
