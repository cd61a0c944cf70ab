/* Entry points for hosts: size and layout of a simulation block, start, parameters, single evaluations. One translation unit. */
#include <math.h>
#include <string.h>
#include "modes.h"
#include "linalg.h"
#include "least.c"
#include "multipliers.c"
#include "rhs.c"
#include "explicit.c"
static int tr_prepare_dense(tr_sim *s);
static void tr_full_multipliers(tr_sim *s, const double *y, double *full, int resolve);
static int tr_settle(tr_sim *s, double t, double *y, int which);
static void tr_certify(tr_sim *s);
#include "manifold.c"
#include "coulomb.c"
#include "groups.c"
TR_RARE
#include "onset.c"
#include "rest.c"
#include "decide.c"
TR_OFTEN
#include "events.c"
#include "watch.c"
#include "output.c"
#include "choice.c"
#include "rosenbrock.c"
TR_RARE
#include "settle.c"
#include "assemble.c"
#include "diagnose.c"
#include "limit.c"
#include "moreau.c"
TR_OFTEN
#include "advance.c"

TR_RARE

static int tr_max(int a, int b) { return a > b ? a : b; }

/* Lay the arrays out behind the struct; returns doubles used. */
static int tr_layout(tr_sim *s, int ntable) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  int at = 0, n = TR_PAD(k->nq + k->nv + k->nb + k->nquad), a = k->active, e = k->neta, rows = k->rows, nv = k->nv, ny = k->nq + nv + k->nb;
#define TR_PLACE(field, count) (s->at.field = at, at += TR_PAD((count) + 1))
  TR_PLACE(p, k->np); TR_PLACE(c, k->nc); TR_PLACE(co, o ? o->nc : 0); TR_PLACE(cj, s->j ? s->j->nc : 0);
  TR_PLACE(x, k->nx); TR_PLACE(y, n); TR_PLACE(ynew, n); TR_PLACE(yold, n); TR_PLACE(ytmp, n); TR_PLACE(yout, n);
  TR_PLACE(cand, tr_max(n, rows * (rows + 1))); TR_PLACE(dy, n); TR_PLACE(K, n * TR_STAGES); TR_PLACE(kstep, n * TR_DENSE_ROWS);
  TR_PLACE(w, k->nw); TR_PLACE(maps, k->nmaps); TR_PLACE(z, a + e); TR_PLACE(zold, a + e); TR_PLACE(scale, n);
  TR_PLACE(d, a); TR_PLACE(S, a * a); TR_PLACE(perm, a + e); TR_PLACE(T, a * e); TR_PLACE(Np, k->nn * (1 + e)); TR_PLACE(NN, k->nn);
  TR_PLACE(law, e); TR_PLACE(dn, k->ndn); TR_PLACE(sliding, TR_DOUBLES(tr_sliding) * k->nsliders); TR_PLACE(lu, e * e); TR_PLACE(r, e);
  TR_PLACE(smin, k->nsliders); TR_PLACE(smax, k->nsliders); TR_PLACE(zone, TR_DOUBLES(tr_zone) * k->nsliders);
  TR_PLACE(h_res, 2 * rows); TR_PLACE(ev, TR_DOUBLES(tr_event) * s->events.capacity); TR_PLACE(breaks, s->clock.nbreaks); TR_PLACE(tables, ntable);
  TR_PLACE(nul, a * (a + k->nkappa)); TR_PLACE(wrap, o ? TR_DOUBLES(tr_memory) * o->npost : 0); TR_PLACE(kap, o ? o->nkappa * (2 + rows) : 0);
  TR_PLACE(gram, tr_least_size(rows));
  TR_PLACE(Q, e * (1 + e)); TR_PLACE(rowk, e); TR_PLACE(lead, 2 * e); TR_PLACE(share, e); TR_PLACE(hold, TR_DOUBLES(tr_hold) * k->nsliders);
  TR_PLACE(dhold, k->nn * 3); TR_PLACE(arm, e); TR_PLACE(vmin, k->nsliders);
  TR_PLACE(con, o ? TR_DOUBLES(tr_contact) * o->ncontacts : 0);
  int nz = a + e, dense = (ny + k->nquad + nz + k->nkappa) * (ny + 1 + nz);
  TR_PLACE(jac, tr_max(rows * nv, s->j ? dense : 0));
  TR_PLACE(jw, tr_max(2 * rows * rows, s->j ? (ny + 1) * nz : 0));
  TR_PLACE(jp, s->j ? s->j->nw : 0); TR_PLACE(W, s->j ? ny * ny : 0); TR_PLACE(wperm, s->j ? ny : 0);
  TR_PLACE(jch, s->j && k->nkappa ? dense + a * (ny + 1) : 0);
  return at;
}

size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  tr_sim s;
  memset(&s, 0, sizeof s);
  s.k = k, s.o = o, s.j = j, s.clock.nbreaks = nbreaks, s.events.capacity = ev_capacity;
  return sizeof(tr_sim) + sizeof(double) * tr_layout(&s, ntable);
}

/* Prepare a zeroed block of tr_size bytes. */
int tr_init(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  if (k->abi != TR_ABI || (o && o->abi != TR_ABI) || (j && j->abi != TR_ABI)) return 0;
  if (k->nx != TR_DOUBLES(tr_moment) + TR_DOUBLES(tr_signal) * k->ntables + k->nstops + TR_DOUBLES(tr_mode) * k->nsliders) return 0;
  s->k = k, s->o = o, s->j = j, s->clock.nbreaks = nbreaks, s->events.capacity = ev_capacity;
  s->bytes = sizeof(tr_sim) + sizeof(double) * tr_layout(s, ntable);
  s->ny = k->nq + k->nv + k->nb;
  s->clock.width = 1 + (o ? o->nout : 0);
  s->set.rtol = 1e-6, s->set.hmax = INFINITY, s->set.hmin = 0.0, s->set.length = 1.0, s->set.rate = 1.0, s->set.project = 1, s->set.locate = 1;
  s->step.method = TR_AUTO_TIGHT; /* and set.method, 0, is auto */
  for (int i = 0; i < k->active; ++i) TR_A(s, d)[i] = 1.0;
  return 1;
}

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

void tr_set_parameters(tr_sim *s) {
  s->k->prepare(TR_A(s, p), TR_A(s, c));
  if (s->o) s->o->prepare(TR_A(s, p), TR_A(s, co));
  if (s->j) s->j->prepare(TR_A(s, p), TR_A(s, cj));
}

int tr_assemble(tr_sim *s, double t, const double *qgiven, const double *vgiven) {
  s->clock.t = t;
  tr_moment_of(s)->inside = t + 1e-12;
  return tr_assemble_state(s, qgiven, vgiven);
}

/* How far the loops are from closing at the block's state: a residual a row (m, or the sine of an angle), then their rates. */
void tr_gap(tr_sim *s, double *h) {
  const tr_kernel *k = s->k;
  tr_set_time(s, s->clock.t);
  if (k->rows) k->closure(TR_A(s, x), TR_A(s, y), TR_A(s, c) + k->c_closure, h);
}

/* Tolerance units: 1 for angles and quaternions, the length scale for lengths; rates times the rate scale. */
static void tr_units(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *u = TR_A(s, scale);
  for (int i = 0; i < TR_PAD(s->ny + k->nquad); ++i) u[i] = 1.0;
  for (int i = 0; i < k->nq; ++i) u[i] = k->qkind[i] == TR_COORDINATE_LENGTH ? s->set.length : 1.0;
  for (int i = 0; i < k->nv; ++i) u[k->nq + i] = tr_rate_unit(s, i) * s->set.rate;
}

/* Begin a run at (t, y) already assembled: scales, ranks, modes, energy reference, first row. */
int tr_start(tr_sim *s, double t, double t_stop, double every, double *row) {
  const tr_kernel *k = s->k;
  if (s->set.method < 0 || s->set.method >= TR_METHODS) return s->clock.status = TR_FAIL_METHOD;
  s->clock.t = s->clock.start = t, s->clock.stop = t_stop, s->clock.every = every, s->clock.row_index = 0, s->clock.row_next = t;
  s->step.h = s->set.hfixed, s->step.h_slip = 0.0, s->step.have_k1 = s->step.have_dense = s->step.have_jac = 0;
  s->pending.kind = TR_NOTHING, s->events.chatter = s->events.count = 0, s->clock.status = TR_OK;
  s->step.stiff_count = s->step.nonstiff_count = s->step.kink_count = 0, s->step.err_old = 0.0;
  s->audit.fail_detail = -1, s->audit.fail_number = -1.0, s->events.chatter_t = -INFINITY, s->clock.next_break = 0, s->loops.rank = 0, s->audit.energy0 = 0.0;
  memset(&s->stats, 0, sizeof s->stats);
  memset(&s->events.last, 0, sizeof s->events.last);
  s->moreau.h = 0.0, s->moreau.burst_t = t, s->moreau.first_t = -1.0, s->moreau.burst_events = 0, s->moreau.steps = s->moreau.calm = 0;
  s->audit.contraction = s->audit.complement = 0.0, s->audit.open_t = -1.0, s->audit.open_pair = -1;
  s->step.method = tr_chooses(s) ? tr_first_choice(s) : s->set.method;
  while (s->clock.next_break < s->clock.nbreaks && TR_A(s, breaks)[s->clock.next_break] <= t) s->clock.next_break++;
  tr_moment_of(s)->inside = t + 1e-12;
  memset(TR_A(s, z), 0, sizeof(double) * (k->active + k->neta));
  memset(TR_A(s, wrap), 0, sizeof(tr_memory) * (s->o ? s->o->npost : 0));
  tr_units(s);
  if (k->active) {
    tr_set_time(s, t);
    k->stage1(TR_A(s, x), TR_A(s, y), TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
    tr_scale_rows(s);
    tr_note_rank(s);
  }
  tr_shift(s, t, TR_A(s, y));
  if (k->neta && k->loop_friction && k->nkappa == 0 && (k->coupled || (k->active && s->loops.rank < k->active))) return TR_NEED_REDUNDANT;
  int modes = tr_start_modes(s);
  if (modes != TR_OK && !tr_through_jam(s)) return s->clock.status = modes;
  if (k->active + k->neta == 0 && !tr_rhs(s, t, TR_A(s, y), TR_A(s, dy))) return s->clock.status = TR_FAIL_MULTIPLIERS;
  if (k->neta) tr_certify(s);
  for (int i = 0; i < s->ny; ++i)
    if (!isfinite(TR_A(s, dy)[i])) {
      s->audit.fail_detail = i;
      return s->clock.status = TR_FAIL_NOT_FINITE;
    }
  if (s->o && row) {
    memcpy(TR_A(s, yout), TR_A(s, y), sizeof(double) * tr_width(s));
    int code = tr_output(s, t, TR_A(s, yout), row);
    if (code != TR_OK) return s->clock.status = code;
    if (s->o->wants & TR_WANTS_CONTACTS) tr_all_contacts(s, TR_A(s, yout), (tr_contact *)TR_A(s, con));
    if (s->o->energy >= 0) { /* the residual column is measured from its first value */
      s->audit.energy0 = row[1 + s->o->energy];
      memset(TR_A(s, wrap), 0, sizeof(tr_memory) * s->o->npost);
      tr_output(s, t, TR_A(s, yout), row);
    }
    s->clock.row_index = 1, s->clock.row_next = t + every;
  }
  return TR_OK;
}

/* Row at the present state (for the end of a run, or an FMU's outputs): TR_OK, or why there is none. */
int tr_row(tr_sim *s, double *row) {
  memcpy(TR_A(s, yout), TR_A(s, y), sizeof(double) * tr_width(s));
  return tr_output(s, s->clock.t, TR_A(s, yout), row);
}

/* Evaluate ẏ at the block's (t, y) with the modes as they are. 1 on success. */
int tr_evaluate(tr_sim *s, double *dy, double *z) {
  s->step.watch = 0;
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  memcpy(dy, TR_A(s, dy), sizeof(double) * (s->ny + s->k->nquad));
  memcpy(z, TR_A(s, z), sizeof(double) * (s->k->active + s->k->neta));
  return 1;
}

/* dẏ/d[y, t] at the block's (t, y): (ny + nquad) × (ny + 1), column-major. 1 on success; needs the Jacobian unit. */
int tr_derivatives(tr_sim *s, double *out) {
  const tr_kernel *k = s->k;
  int rows = s->ny + k->nquad, ld = tr_jacobian_rows(s);
  if (!s->j) return 0;
  s->step.watch = 0, s->step.have_jac = 0;
  if (!tr_jacobian_at(s, s->clock.t, TR_A(s, y))) return 0;
  for (int q = 0; q <= s->ny; ++q) memcpy(out + (size_t)q * rows, TR_A(s, jac) + (size_t)q * ld, sizeof(double) * rows);
  return 1;
}

/* Redundancy at the present state: number of reaction directions the motion leaves open; out (nkappa × count): their scaled
 * reactions, orthonormal. */
int tr_redundancy(tr_sim *s, double *out) {
  const tr_kernel *k = s->k;
  if (!s->o || !s->o->nkappa || !k->rows) return 0;
  int m = s->o->nkappa;
  double z[k->rows + k->neta + 1], base[m], *dir = TR_A(s, cand);
  s->step.watch = 0;
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return -1;
  if (k->active == 0) s->loops.rank_now = 0;
  tr_full_multipliers(s, TR_A(s, y), z, 0);
  if (k->active == k->rows && s->loops.rank_now == k->active) return 0;
  int count = tr_open_reactions(s, TR_A(s, y), z, dir, out, base);
  tr_orthonormal(m, count, out);
  return count;
}

const tr_stats *tr_statistics(const tr_sim *s) { return &s->stats; }
double tr_time(const tr_sim *s) { return s->clock.t; }
int tr_events_take(tr_sim *s) { int n = s->events.count; s->events.count = 0; return n; }

void tr_configure(tr_sim *s, const tr_settings *set) { s->set = *set; }

/* Move a running simulation into a larger block laid out with the Jacobian unit: everything before its arrays is the same. */
int tr_attach_jacobian(tr_sim *to, const tr_sim *from, const tr_jacobian *j, int ntable) {
  if (j->abi != TR_ABI) return 0;
  tr_sim old = *from;
  *to = *from;
  to->j = j;
  to->bytes = sizeof(tr_sim) + sizeof(double) * tr_layout(to, ntable);
  const double *a = (const double *)((const char *)from + sizeof(tr_sim));
  double *b = (double *)((char *)to + sizeof(tr_sim));
#define TR_MOVE(field, next) memcpy(b + to->at.field, a + old.at.field, sizeof(double) * (old.at.next - old.at.field))
  TR_MOVE(p, c); TR_MOVE(c, co); TR_MOVE(co, cj);
  memcpy(b + to->at.x, a + old.at.x, sizeof(double) * (old.at.jac - old.at.x));
  j->prepare(TR_A(to, p), TR_A(to, cj));
  return 1;
}

#include "hold.c"
#include "linearize.c"
TR_OFTEN
#include "batch.c"
#include "communicate.c"
