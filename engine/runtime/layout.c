/* Where everything lies in a block: its size, its arrays, and how it moves into a larger one. */
#include "modes.h"

#define RTOL 1e-6 /* relative tolerance where the host says nothing */

/* The larger of two sizes. */
static int tr_max(int a, int b) { return a > b ? a : b; }

/* Lay the arrays out behind the struct; returns doubles used. */
static int tr_layout(tr_sim *s, int ntable) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  s->ny = k->nq + k->nv + k->nb, s->nworks = o && o->works ? k->npowers : 0, s->naudit = k->npowers ? 2 : 0;
  const int a = k->active, e = k->neta, rows = k->rows, nv = k->nv, ny = s->ny, pairs = k->nsliders, n = tr_width(s);
  int at = 0;
#define TR_PLACE(field, count) (s->at.field = at, at += TR_PAD((count) + 1))
  TR_PLACE(p, k->np); TR_PLACE(c, k->nc); TR_PLACE(co, o ? o->nc : 0); TR_PLACE(cj, s->j ? s->j->nc : 0);
  TR_PLACE(x, k->nx); TR_PLACE(y, n); TR_PLACE(ynew, n); TR_PLACE(yold, n); TR_PLACE(ytmp, n); TR_PLACE(yout, n);
  TR_PLACE(cand, tr_max(n, rows * (rows + 1))); TR_PLACE(dy, n); TR_PLACE(K, n * TR_STAGES); TR_PLACE(kstep, n * tr_max(TR_DENSE_ROWS, WORK_NODES));
  TR_PLACE(power, k->npowers); TR_PLACE(parted, k->npowers); TR_PLACE(impulsed, 2 * k->npowers); TR_PLACE(work, s->nworks); TR_PLACE(w, k->nw); TR_PLACE(maps, k->nmaps); TR_PLACE(unmoved, n); TR_PLACE(z, tr_nz(s)); TR_PLACE(zold, tr_nz(s)); TR_PLACE(zstart, tr_nz(s)); TR_PLACE(zend, tr_nz(s));
  TR_PLACE(zbeyond, tr_nz(s)); TR_PLACE(scale, n);
  TR_PLACE(d, a); TR_PLACE(S, a * a); TR_PLACE(perm, a + e); TR_PLACE(T, a * e); TR_PLACE(Np, k->nn * (1 + e)); TR_PLACE(NN, k->nn);
  TR_PLACE(law, e); TR_PLACE(dn, k->ndn); TR_PLACE(sliding, TR_DOUBLES(tr_sliding) * pairs); TR_PLACE(lu, e * e); TR_PLACE(r, e);
  TR_PLACE(smin, pairs); TR_PLACE(smax, pairs); TR_PLACE(zone, TR_DOUBLES(tr_zone) * pairs); TR_PLACE(h_res, 2 * rows);
  TR_PLACE(ev, TR_DOUBLES(tr_event) * s->events.capacity); TR_PLACE(breaks, s->clock.nbreaks); TR_PLACE(tables, ntable);
  TR_PLACE(nul, a * (a + k->nkappa)); TR_PLACE(wrap, o ? TR_DOUBLES(tr_memory) * o->npost : 0);
  const int r = k->nmore ? a : 0;
  TR_PLACE(openV, a * r); TR_PLACE(openQ, k->nkappa * r); TR_PLACE(openN, k->nn * r); TR_PLACE(amounts, r); TR_PLACE(openY, r * e);
  TR_PLACE(openG, r * r); TR_PLACE(openF, r * r); TR_PLACE(openP, r); TR_PLACE(openB, r * k->nn); TR_PLACE(openE, r ? k->nn * e : 0);
  TR_PLACE(more, k->nmore); TR_PLACE(dmore, k->ndmore);
  TR_PLACE(kap, o ? o->nkappa * (2 + rows) : 0); TR_PLACE(gram, tr_least_size(rows));
  TR_PLACE(Q, e * (1 + e)); TR_PLACE(rowk, e); TR_PLACE(lead, 2 * e); TR_PLACE(share, e);
  TR_PLACE(bound, pairs); TR_PLACE(past, PAST * pairs); TR_PLACE(ends, pairs); TR_PLACE(line, e); TR_PLACE(impend, k->nrates); TR_PLACE(limit, e); TR_PLACE(dlimit, k->ndn);
  TR_PLACE(hold, TR_DOUBLES(tr_hold) * pairs); TR_PLACE(dhold, k->nn * 3); TR_PLACE(arm, e); TR_PLACE(vmin, pairs); TR_PLACE(stray, 2 * pairs);
  TR_PLACE(far, 3 * (pairs + k->nstops));
  const int along = k->begin != 0;
  TR_PLACE(yeval, along * n); TR_PLACE(dyeval, n); TR_PLACE(moves, along * e); TR_PLACE(dlaw, along * k->ndn);
  TR_PLACE(pivots, along * (k->nbodies + (a ? k->nelements + a : 0))); TR_PLACE(less, along * (a + e)); TR_PLACE(borne, along * (a + e));
  TR_PLACE(acc, along * (a + e));
  TR_PLACE(told, 3 * pairs + 2 * k->nstops + 1); TR_PLACE(slow, pairs); TR_PLACE(modes, TR_DOUBLES(tr_mode) * pairs);
  TR_PLACE(con, o ? TR_DOUBLES(tr_contact) * o->ncontacts : 0);
  int nz = a + e, dense = (ny + nz + k->nkappa + k->nmore) * (ny + 1 + nz);
  TR_PLACE(jac, tr_max(rows * nv, s->j ? dense : 0));
  TR_PLACE(jw, tr_max(2 * rows * rows, s->j ? (ny + 1) * nz : 0));
  TR_PLACE(jp, s->j ? s->j->nw : 0); TR_PLACE(W, s->j ? ny * ny : 0); TR_PLACE(wperm, s->j ? ny : 0);
  TR_PLACE(jch, s->j && k->nkappa ? dense + a * (ny + 1) : 0);
  return at;
}

/* Bytes of a block; ntable: numbers in the tables, ev_capacity: events it can hold until they are read. */
size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  tr_sim s;
  memset(&s, 0, sizeof s);
  s.k = k, s.o = o, s.j = j, s.clock.nbreaks = nbreaks, s.events.capacity = ev_capacity;
  return TR_HEAD + sizeof(double) * tr_layout(&s, ntable);
}

/* Prepare a zeroed block of tr_size bytes. */
int tr_init(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  if (k->abi != TR_ABI || (o && o->abi != TR_ABI) || (j && j->abi != TR_ABI)) return 0;
  if (k->nx != TR_DOUBLES(tr_moment) + TR_DOUBLES(tr_signal) * k->ntables + k->nstops + TR_DOUBLES(tr_mode) * k->nsliders) return 0;
  s->k = k, s->o = o, s->j = j, s->clock.nbreaks = nbreaks, s->events.capacity = ev_capacity;
  s->bytes = TR_HEAD + sizeof(double) * tr_layout(s, ntable);
  s->clock.width = 1 + (o ? o->nout : 0);
  s->set = (tr_settings){.rtol = RTOL, .hmax = INFINITY, .length = 1.0, .rate = 1.0, .project = 1, .locate = 1}; /* and method auto */
  s->step.method = TR_AUTO_TIGHT;
  for (int i = 0; i < k->active; ++i) TR_A(s, d)[i] = 1.0;
  return 1;
}

/* Whether a count or an index lies within what it counts; indices of nothing are −1. */
static int tr_from_to(int value, int least, int most) { return least <= value && value <= most; }

/* Whether every count and index beside the arrays of a block is one that a run can have. */
static int tr_in_range(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const int pair = k->nsliders - 1, watched = k->nsliders + k->nstops - 1, none = -1, rows = tr_max(TR_DENSE_ROWS, WORK_NODES);
  return tr_from_to(s->clock.next_break, 0, s->clock.nbreaks) && tr_from_to(s->clock.status, TR_OK, TR_CASE_FAILED)
      && tr_from_to(s->set.method, 0, TR_METHODS - 1) && tr_from_to(s->step.method, 0, TR_METHODS - 1)
      && tr_from_to(s->step.dense_rows, 0, rows) && tr_from_to(s->step.mapped, TR_MAPS_NONE, TR_MAPS_HELD)
      && tr_from_to(s->pending.kind, TR_NOTHING, TR_IMPULSE_STEP) && tr_from_to(s->pending.which, none, tr_max(watched, 0))
      && tr_from_to(s->loops.rank, 0, k->active) && tr_from_to(s->loops.rank_now, 0, k->active) && tr_from_to(s->loops.open, 0, k->active)
      && tr_from_to(s->friction.still, 0, k->nsliders) && tr_from_to(s->friction.failed, none, tr_max(watched, 0))
      && tr_from_to(s->friction.freed, none, tr_max(pair, 0)) && tr_from_to(s->friction.missed, none, tr_max(pair, 0))
      && tr_from_to(s->friction.capture, none, tr_max(pair, 0)) && tr_from_to(s->events.count, 0, s->events.capacity);
}

/* Renew the addresses and places of a block that was copied or read, made for the same sizes. Whether it can be one of a run. */
int tr_refit(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  tr_sim own;
  memset(&own, 0, sizeof own);
  own.k = k, own.o = o, own.j = j, own.clock.nbreaks = nbreaks, own.events.capacity = ev_capacity;
  s->bytes = TR_HEAD + sizeof(double) * tr_layout(&own, ntable);
  s->k = k, s->o = o, s->j = j, s->ny = own.ny, s->nworks = own.nworks, s->naudit = own.naudit, s->at = own.at;
  s->ask = (tr_asking){0, 0.0, 0};
  s->clock.width = 1 + (o ? o->nout : 0), s->clock.nbreaks = nbreaks, s->events.capacity = ev_capacity;
  return tr_in_range(s);
}

/* An array of the block that hosts may look into: TR_ARRAY_…; 0 for any other number. */
double *tr_array(tr_sim *s, int which) {
  switch (which) {
    case TR_ARRAY_PARAMETERS: return TR_A(s, p);
    case TR_ARRAY_STATE: return TR_A(s, y);
    case TR_ARRAY_SIGNALS: return TR_A(s, x);
    case TR_ARRAY_BREAKS: return TR_A(s, breaks);
    case TR_ARRAY_TABLES: return TR_A(s, tables);
    case TR_ARRAY_EVENTS: return TR_A(s, ev);
    case TR_ARRAY_MULTIPLIERS: return TR_A(s, z);
    case TR_ARRAY_SLOPES: return TR_A(s, K);
    case TR_ARRAY_MAPS: return TR_A(s, maps);
    default: return 0;
  }
}

/* Move a running simulation into a larger block laid out with the Jacobian unit: everything before its arrays is the same. */
int tr_attach_jacobian(tr_sim *to, const tr_sim *from, const tr_jacobian *j, int ntable) {
  if (j->abi != TR_ABI) return 0;
  tr_sim old = *from;
  *to = *from;
  to->j = j;
  to->bytes = TR_HEAD + sizeof(double) * tr_layout(to, ntable);
  const double *a = (const double *)((const char *)from + TR_HEAD);
  double *b = (double *)((char *)to + TR_HEAD);
#define TR_MOVE(field, next) memcpy(b + to->at.field, a + old.at.field, sizeof(double) * (old.at.next - old.at.field))
  TR_MOVE(p, c); TR_MOVE(c, co); TR_MOVE(co, cj);
  memcpy(b + to->at.x, a + old.at.x, sizeof(double) * (old.at.jac - old.at.x));
  j->prepare(j->scene, TR_A(to, p), TR_A(to, cj));
  return 1;
}
