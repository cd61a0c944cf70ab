/* Layout of a block: its size, the offsets of its arrays, and the copy of a block into a larger one. */
#include "base/base.h"

static int tr_max(int a, int b) { return a > b ? a : b; }

/* Set the offsets of all arrays, which follow the struct. Returns their total number of doubles. */
static int tr_lay_out(tr_sim *s, int ntable) {
  const tr_kernel *k = s->k;
  const tr_outputs *o = s->o;
  s->ny = k->nq + k->nv + k->nb, s->nworks = o && o->works ? k->npowers : 0;
  const int a = k->active, e = k->neta, rows = k->rows, nv = k->nv, ny = s->ny, pairs = k->nsliders, n = tr_state_width(s);
  int at = 0;
#define TR_PLACE(field, count) (s->at.field = at, at += TR_PAD((count) + 1))
  TR_PLACE(p, k->np); TR_PLACE(c, k->nc); TR_PLACE(co, o ? o->nc : 0); TR_PLACE(cj, s->j ? s->j->nc : 0);
  TR_PLACE(x, k->nx); TR_PLACE(y, n); TR_PLACE(ynew, n); TR_PLACE(yold, n); TR_PLACE(ytmp, n); TR_PLACE(yout, n);
  TR_PLACE(event_y, tr_max(n, rows * (rows + 1))); TR_PLACE(dy, n); TR_PLACE(K, n * TR_STAGES); TR_PLACE(kstep, n * tr_max(TR_DENSE_ROWS, TR_WORK_NODES));
  TR_PLACE(power, k->npowers); TR_PLACE(part_power, k->npowers); TR_PLACE(impulse_work, 2 * k->npowers); TR_PLACE(work, s->nworks); TR_PLACE(w, k->nw); TR_PLACE(maps, k->nmaps); TR_PLACE(dy_unforced, n); TR_PLACE(z, tr_z_length(s)); TR_PLACE(zold, tr_z_length(s)); TR_PLACE(zstart, tr_z_length(s)); TR_PLACE(zend, tr_z_length(s));
  TR_PLACE(zbeyond, tr_z_length(s)); TR_PLACE(scale, n);
  TR_PLACE(d, a); TR_PLACE(S, a * a); TR_PLACE(sparse, k->nfill ? a + k->nfill : 0); TR_PLACE(whole_S, k->nS < a * a ? a * a : 0); TR_PLACE(perm, a + e); TR_PLACE(T, a * e); TR_PLACE(Np, k->nn * (1 + e)); TR_PLACE(NN, k->nn);
  const int light = k->nlight, of_loops = light ? a - light : 0;
  TR_PLACE(light_S, of_loops * of_loops); TR_PLACE(light_Z, of_loops * light); TR_PLACE(light_D, light * light); TR_PLACE(light_P, light);
  TR_PLACE(law, e); TR_PLACE(dn, k->ndn); TR_PLACE(sliding, TR_DOUBLES(tr_sliding) * pairs); TR_PLACE(lu, e * e); TR_PLACE(r, e);
  TR_PLACE(smin, pairs); TR_PLACE(smax, pairs); TR_PLACE(zone, TR_DOUBLES(tr_zone) * pairs); TR_PLACE(loop_error, 2 * rows);
  TR_PLACE(ev, TR_DOUBLES(tr_event) * s->events.capacity); TR_PLACE(breaks, TR_DOUBLES(tr_break) * s->clock.nbreaks); TR_PLACE(tables, ntable);
  TR_PLACE(open_lambda, a * (a + k->nkappa)); TR_PLACE(post_memory, o ? TR_DOUBLES(tr_memory) * o->npost : 0);
  const int r = k->nmore ? a : 0;
  TR_PLACE(openV, a * r); TR_PLACE(openQ, k->nkappa * r); TR_PLACE(openN, k->nn * r); TR_PLACE(open_amounts, r); TR_PLACE(openY, r * e);
  TR_PLACE(openG, r * r); TR_PLACE(openF, r * r); TR_PLACE(openP, r); TR_PLACE(openB, r * k->nn); TR_PLACE(openE, r ? k->nn * e : 0);
  TR_PLACE(more, k->nmore); TR_PLACE(dmore, k->ndmore);
  TR_PLACE(open_kappa, o ? o->nkappa * (2 + rows) : 0); TR_PLACE(gram, tr_least_squares_doubles(rows));
  TR_PLACE(Q, e * (1 + e)); TR_PLACE(row_kind, e); TR_PLACE(leaders, 2 * e); TR_PLACE(share, e);
  TR_PLACE(pair_class, pairs); TR_PLACE(past_speeds, TR_PAST_ENDS * pairs); TR_PLACE(stopping, pairs); TR_PLACE(class_rates, e); TR_PLACE(impending, k->nrates); TR_PLACE(impending_law, e); TR_PLACE(impending_dlaw, k->ndn);
  TR_PLACE(hold, TR_DOUBLES(tr_hold) * pairs); TR_PLACE(dhold, k->nn * 3); TR_PLACE(lever, e); TR_PLACE(capture_tried, pairs); TR_PLACE(speed_errors, 2 * pairs);
  TR_PLACE(violations, 3 * (2 * pairs + k->nstops)); TR_PLACE(reserves, TR_RECORDS * (1 + pairs));
  const int along = k->begin != 0;
  TR_PLACE(yeval, along * n); TR_PLACE(dyeval, n); TR_PLACE(end_acc, along * 2 * (e + a)); TR_PLACE(moves, along * e); TR_PLACE(dlaw, along * k->ndn);
  TR_PLACE(pivots, along * (k->nbodies + (a ? k->nelements + 2 * a : 0))); TR_PLACE(less, along * (a + e)); TR_PLACE(borne, along * (a + e));
  TR_PLACE(acc, along * (a + e));
  TR_PLACE(indicators, 3 * pairs + 2 * k->nstops + 1); TR_PLACE(end_speed, pairs); TR_PLACE(saved_modes, TR_DOUBLES(tr_mode) * pairs);
  TR_PLACE(contacts, o ? TR_DOUBLES(tr_contact) * o->ncontacts : 0); TR_PLACE(contact_peaks, o ? o->ncontacts : 0);
  TR_PLACE(touch, TR_DOUBLES(tr_touch) * k->nunilateral); TR_PLACE(raw_rows, k->nunilateral * (a + e + 1));
  int nz = a + e, dense = (ny + nz + k->nkappa + k->nmore) * (ny + 1 + nz);
  TR_PLACE(jac, tr_max(rows * nv, s->j ? dense : 0));
  TR_PLACE(jw, tr_max(2 * rows * rows, s->j ? (ny + 1) * nz : 0));
  TR_PLACE(jp, s->j ? s->j->nw : 0); TR_PLACE(W, s->j ? ny * ny : 0); TR_PLACE(wperm, s->j ? ny : 0);
  TR_PLACE(choice_jac, s->j && k->nkappa ? dense + a * (ny + 1) : 0);
  return at;
}

/* Set the kernel, columns and Jacobian unit of a block, its capacities, and the layout that all these require. */
static void tr_fit(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  s->k = k, s->o = o, s->j = j, s->clock.nbreaks = nbreaks, s->events.capacity = ev_capacity;
  s->bytes = TR_HEAD + sizeof(double) * tr_lay_out(s, ntable);
  s->clock.width = 1 + (o ? o->nout : 0);
}

size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  tr_sim s;
  tr_fit(&s, k, o, j, nbreaks, ntable, ev_capacity);
  return s.bytes;
}

int tr_init(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  if (k->abi != TR_ABI || (o && o->abi != TR_ABI) || (j && j->abi != TR_ABI)) return 0;
  if (k->nx != TR_DOUBLES(tr_moment) + TR_DOUBLES(tr_signal) * k->ntables + k->nstops + TR_DOUBLES(tr_mode) * k->nsliders) return 0;
  tr_fit(s, k, o, j, nbreaks, ntable, ev_capacity);
  s->set = (tr_settings){.rtol = DEFAULT_RTOL, .hmax = INFINITY, .length = 1.0, .rate = 1.0, .project = 1, .locate = 1};
  s->clock.last_break = -INFINITY, s->clock.next_break = INFINITY;
  s->step.method = TR_AUTO_TIGHT;
  for (int i = 0; i < k->active; ++i) TR_A(s, d)[i] = 1.0;
  return 1;
}

static int tr_is_within(int value, int least, int most) { return least <= value && value <= most; }

/* Whether every count and index in the struct is within the sizes of the kernel and the arrays. An index of -1 means none. */
static int tr_has_valid_counts(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const int pair = k->nsliders - 1, watched = k->nsliders + k->nstops - 1, none = -1, rows = tr_max(TR_DENSE_ROWS, TR_WORK_NODES);
  return tr_is_within(s->clock.status, TR_OK, TR_CASE_FAILED)
      && tr_is_within(s->set.method, 0, TR_METHODS - 1) && tr_is_within(s->step.method, 0, TR_METHODS - 1)
      && tr_is_within(s->step.dense_rows, 0, rows) && tr_is_within(s->step.mapped, TR_MAPS_NONE, TR_MAPS_OF_IMPULSES)
      && tr_is_within(s->pending.kind, TR_NOTHING, TR_IMPULSE_STEP) && tr_is_within(s->pending.which, none, tr_max(watched, 0))
      && tr_is_within(s->loops.rank, 0, k->active) && tr_is_within(s->loops.rank_now, 0, k->active) && tr_is_within(s->loops.open, 0, k->active)
      && tr_is_within(s->friction.held, 0, k->nsliders) && tr_is_within(s->friction.failed, none, tr_max(watched, 0))
      && tr_is_within(s->friction.freed, none, tr_max(pair, 0)) && tr_is_within(s->friction.cutting_pair, none, tr_max(pair, 0))
      && tr_is_within(s->friction.capture, none, tr_max(pair, 0)) && tr_is_within(s->events.count, 0, s->events.capacity);
}

int tr_refit(tr_sim *s, const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable, int ev_capacity) {
  tr_fit(s, k, o, j, nbreaks, ntable, ev_capacity);
  s->ask = (tr_asking){0, 0.0, 0};
  return tr_has_valid_counts(s);
}

double *tr_array(tr_sim *s, int which) {
  const tr_places *at = &s->at;
  const int place[] = {[TR_ARRAY_PARAMETERS] = at->p, [TR_ARRAY_STATE] = at->y, [TR_ARRAY_SIGNALS] = at->x, [TR_ARRAY_BREAKS] = at->breaks,
                       [TR_ARRAY_TABLES] = at->tables, [TR_ARRAY_EVENTS] = at->ev, [TR_ARRAY_MULTIPLIERS] = at->z, [TR_ARRAY_SLOPES] = at->K,
                       [TR_ARRAY_MAPS] = at->maps};
  return which >= 0 && which < (int)(sizeof place / sizeof *place) ? (double *)((char *)s + TR_HEAD) + place[which] : 0;
}

int tr_attach_jacobian(tr_sim *to, const tr_sim *from, const tr_jacobian *j, int ntable) {
  if (j->abi != TR_ABI) return 0;
  tr_sim old = *from;
  *to = *from;
  to->j = j;
  to->bytes = TR_HEAD + sizeof(double) * tr_lay_out(to, ntable);
  const double *a = (const double *)((const char *)from + TR_HEAD);
  double *b = (double *)((char *)to + TR_HEAD);
#define TR_MOVE(field, next) memcpy(b + to->at.field, a + old.at.field, sizeof(double) * (old.at.next - old.at.field))
  TR_MOVE(p, c); TR_MOVE(c, co); TR_MOVE(co, cj);
  memcpy(b + to->at.x, a + old.at.x, sizeof(double) * (old.at.jac - old.at.x));
  j->prepare(j->scene, TR_A(to, p), TR_A(to, cj));
  return 1;
}
