/* Many cases of one structure in one call (theory, "Batches and hosts"): parameters, assembly, start, steps, reduction of rows.
 * Each case makes the same calls as a single run, in a fresh block. Its results are therefore bitwise identical to those of a
 * single run. The host owns all memory. A call returns when its step budget is used up. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#define START_STEPS 20 /* assembly and start count as this number of steps */

/* Number of doubles in a case's output. */
static int tr_case_doubles(const tr_batch *b) { return TR_DOUBLES(tr_case) + TR_DOUBLES(tr_reduced) * b->width; }

static tr_case *tr_case_out(const tr_batch *b) { return (tr_case *)(b->out + (size_t)b->at * tr_case_doubles(b)); }

static tr_reduced *tr_case_columns(const tr_batch *b) { return (tr_reduced *)(tr_case_out(b) + 1); }

static const tr_case_settings *tr_case_set(const tr_batch *b) { return b->set + b->at; }

static void tr_case_clear(tr_batch *b) {
  tr_case *o = tr_case_out(b);
  tr_reduced *r = tr_case_columns(b);
  memset(o, 0, sizeof(double) * tr_case_doubles(b));
  for (int i = 0; i < TR_EVENT_KINDS; ++i) o->first[i] = NAN;
  o->margin = INFINITY;
  for (int i = 0; i < b->width; ++i) r[i].max = r[i].min = r[i].final = NAN;
}

/* Add a row to the reductions: maximum, minimum and sum of finite values, and last value. */
static void tr_case_row(tr_batch *b, const double *row) {
  tr_reduced *r = tr_case_columns(b);
  tr_case_out(b)->rows += 1.0, b->last = row[0];
  if (b->kept) {
    double *kept = b->kept + (size_t)b->kept_rows++ * (b->width + 1);
    kept[0] = (double)b->at;
    memcpy(kept + 1, row, sizeof(double) * b->width);
  }
  for (int i = 0; i < b->width; ++i, ++r) {
    double v = row[i];
    r->final = v;
    if (!isfinite(v)) continue;
    if (!(r->max >= v)) r->max = v;
    if (!(r->min <= v)) r->min = v;
    r->mean += v, r->finite += 1.0;
  }
}

/* Count the events in the block's buffer by kind, and record first times and margins. Empties the buffer. */
static void tr_case_events(tr_batch *b, tr_sim *s) {
  tr_case *o = tr_case_out(b);
  for (int i = 0; i < s->events.count; ++i) {
    const tr_event *e = (const tr_event *)TR_A(s, ev) + i;
    int kind = (int)e->kind & (TR_EVENT_KINDS - 1);
    if (o->count[kind]++ == 0.0) o->first[kind] = e->time;
    if (kind == TR_EV_SEPARATION || kind == TR_EV_CONTACT_JUMP) continue; /* these events do not follow from a decision */
    if (e->margin < o->margin) o->margin = e->margin;
    o->marginal += e->marginal;
  }
  s->events.count = 0;
}

static tr_sim *tr_case_block(tr_batch *b, int which) {
  tr_variant *v = b->variant + which;
  tr_sim *s = v->plain;
  memcpy(s, v->fresh, v->fresh->bytes);
  const tr_kernel *k = s->k;
  memcpy(TR_A(s, p), b->p + (size_t)b->at * k->np, sizeof(double) * k->np);
  int n = tr_input_count(s);
  for (int i = 0; i < n; ++i) {
    tr_input *input = (tr_input *)tr_table_of(s, i);
    input->start = input->u[0] = b->inputs[(size_t)b->at * n + i];
  }
  tr_set_parameters(s);
  const tr_case_settings *set = tr_case_set(b);
  tr_settings o = b->settings;
  o.rtol = set->rtol, o.length = set->length, o.rate = set->rate, o.energy = set->energy;
  tr_configure(s, &o);
  s->lane = which ? 0 : b->lane;
  if (b->lane) s->ask.host = 0; /* ``hosts/lane_batch.c`` asks the host between its calls */
  b->which = which, b->now = s;
  return s;
}

/* Assemble and start the case. Returns TR_OK when the case is running, otherwise a status. If the status is a request to the host,
 * the host calls again, and the case begins anew. */
static int tr_case_start(tr_batch *b) {
  tr_sim *s = tr_case_block(b, 0);
  const tr_kernel *k = s->k;
  const tr_case_settings *set = tr_case_set(b);
  const double *given = b->given + (size_t)b->at * 2 * k->nv;
  tr_case_clear(b);
  memcpy(TR_A(s, y), b->y + (size_t)b->at * (k->nq + k->nv), sizeof(double) * (k->nq + k->nv));
  int code = tr_assemble(s, 0.0, given, given + k->nv);
  if (s->ask.cancelled) return TR_CANCELLED;
  if (code != 1) {
    tr_case_out(b)->detail = code;
    return TR_FAIL_CLOSURE;
  }
  if (set->light != 0.0 && b->examined != b->at + 1) return TR_NEED_INERTIA;
  int status = tr_start(s, 0.0, set->until, set->every, b->rows);
  if (status == TR_NEED_REDUNDANT) {
    if (!b->variant[1].fresh) return status;
    double y[s->ny + 1], x[k->nx + 1]; /* x is copied with y, because x contains the states of the contacts */
    memcpy(y, TR_A(s, y), sizeof(double) * s->ny), memcpy(x, TR_A(s, x), sizeof(double) * k->nx);
    s = tr_case_block(b, 1);
    memcpy(TR_A(s, y), y, sizeof(double) * s->ny), memcpy(TR_A(s, x), x, sizeof(double) * k->nx);
    status = tr_start(s, 0.0, set->until, set->every, b->rows);
  }
  if (status != TR_OK) return status;
  tr_case_row(b, b->rows);
  /* a single run makes this call, which changes the block; its result is not needed, because open reactions depend on the structure
   * alone */
  tr_evaluate_for_redundancy(s);
  return TR_OK;
}

/* End the case: last row, means, audit and status. */
static void tr_case_end(tr_batch *b, int status) {
  tr_sim *s = b->now;
  tr_case *o = tr_case_out(b);
  tr_reduced *r = tr_case_columns(b);
  const tr_case_settings *set = tr_case_set(b);
  if (status == TR_DONE && set->every > 0.0 && set->until - b->last > LAST_ROW * set->until) {
    int code = tr_row(s, b->rows);
    if (code == TR_OK) tr_case_row(b, b->rows);
    else status = code;
  }
  for (int i = 0; i < b->width; ++i, ++r) r->mean = r->finite > 0.0 ? r->mean / r->finite : NAN;
  if (o->rows > 0.0) tr_audit_end(s), tr_judge(s, &o->audit);
  if (status == TR_DONE && o->audit.verdict == TR_VERDICT_INACCURATE) status = TR_INACCURATE;
  o->status = status;
  o->time = status == TR_DONE || status == TR_INACCURATE ? set->until : s->clock.t;
  o->steps = (double)s->stats.steps;
  b->running = 0;
}

/* Move the running case into a block with the Jacobian unit. Returns 0 if the host has not provided this unit yet. */
static int tr_case_attach(tr_batch *b) {
  tr_variant *v = b->variant + b->which;
  if (!v->full) return 0;
  memset(v->full, 0, v->full_bytes);
  if (!tr_attach_jacobian(v->full, b->now, v->j, b->ntable)) return 0;
  b->now = v->full;
  return 1;
}

int tr_batch_run(tr_batch *b, long budget) {
  while (b->at < b->ncases) {
    int status = TR_OK;
    long count = 0;
    if (b->reported) {
      b->reported = 0, b->at++;
      continue;
    }
    if (budget <= 0) return TR_MORE;
    /* Room is needed for a first row, a full buffer and a last row. */
    if (b->kept && b->kept_rows + b->capacity + 2 > b->kept_capacity) return TR_MORE;
    if (!b->running) {
      budget -= START_STEPS;
      status = tr_case_start(b);
      if (status == TR_NEED_REDUNDANT || status == TR_NEED_INERTIA) return status;
      b->running = 1;
    }
    if (status == TR_OK) {
      long before = b->now->stats.steps;
      status = tr_advance(b->now, tr_case_set(b)->until, budget, b->rows, b->capacity, &count);
      budget -= 1 + (b->now->stats.steps - before) + count;
      for (long i = 0; i < count; ++i) tr_case_row(b, b->rows + i * b->width);
      tr_case_events(b, b->now);
    }
    if (status == TR_CANCELLED || status == TR_WAITS) return status;
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

void tr_batch_end(tr_batch *b, int status) {
  b->now->ask.cancelled = 0, b->now->ask.work = 0.0;
  tr_case_end(b, status);
  b->reported = 1;
}

size_t tr_batch_size(void) { return sizeof(tr_batch); }
