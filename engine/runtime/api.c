/* Entry points for hosts: parameters, start, rows, single evaluations. This file includes the others: one translation unit. */
#include <math.h>
#include <string.h>
#include "modes.h"
#include "linalg.h"
#include "least.c"
#include "recursive.c"
#include "rhs.c"
#include "explicit.c"
#include "singular.c"
static int tr_have_dense(tr_sim *s);
static void tr_full_multipliers(tr_sim *s, const double *y, double *full, int resolve);
static int tr_settle(tr_sim *s, double t, double *y, int which, const tr_contact *known);
static int tr_settles_anew(tr_sim *s, int which, const tr_mode *modes, int others);
static void tr_certify(tr_sim *s);
double tr_break_after(const tr_sim *s, double t);
#include "manifold.c"
#include "coulomb.c"
#include "groups.c"
#include "verify.c"
#include "bound.c"
TR_RARE
#include "line.c"
#include "onset.c"
#include "rest.c"
#include "decide.c"
TR_OFTEN
#include "events.c"
#include "audit.c"
#include "margin.c"
#include "turns.c"
#include "search.c"
#include "record.c"
#include "start.c"
#include "watch.c"
#include "output.c"
#include "choice.c"
#include "rosenbrock.c"
TR_RARE
#include "closed.c"
#include "settle.c"
#include "capture.c"
#include "closing.c"
#include "assemble.c"
#include "diagnose.c"
#include "certify.c"
#include "fold.c"
#include "limit.c"
TR_OFTEN
#include "stepsize.c"
TR_RARE
#include "moreau.c"
#include "ends.c"
#include "impulses.c"
TR_OFTEN
#include "before.c"
#include "finish.c"
#include "corner.c"
#include "trial.c"
#include "advance.c"
#include "bounded.c"

TR_RARE
#include "layout.c"

#define JUST_AFTER 1e-12 /* s: signals with kinks are read at a start as they are just after it */

/* What follows from the parameters, anew. */
void tr_set_parameters(tr_sim *s) {
  s->k->prepare(s->k->scene, TR_A(s, p), TR_A(s, c));
  s->friction.pace = 0.0;
  for (int i = 0; i < s->k->npaces; ++i)
    s->friction.pace = fmax(s->friction.pace, fabs(TR_A(s, p)[s->k->pace[i].parameter]) * s->k->pace[i].hertz);
  if (s->o) s->o->prepare(s->o->scene, TR_A(s, p), TR_A(s, co));
  if (s->j) s->j->prepare(s->j->scene, TR_A(s, p), TR_A(s, cj));
}

/* Close the loops at time t, from the state in the block: see tr_assemble_state. */
int tr_assemble(tr_sim *s, double t, const double *qgiven, const double *vgiven) {
  s->clock.t = t;
  s->ask.stop = 0, s->ask.work = 0.0;
  tr_moment_of(s)->inside = t + JUST_AFTER;
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
  for (int i = 0; i < tr_width(s); ++i) u[i] = 1.0;
  for (int i = 0; i < k->nq; ++i) u[i] = k->qkind[i] == TR_COORDINATE_LENGTH ? s->set.length : 1.0;
  for (int i = 0; i < k->nv; ++i) u[k->nq + i] = tr_rate_unit(s, i) * s->set.rate;
}

/* Forget what an earlier run has left behind: the run begins at t. */
static void tr_reset(tr_sim *s, double t, double t_stop, double every) {
  const int width = s->clock.width, nbreaks = s->clock.nbreaks, capacity = s->events.capacity;
  const int method = tr_chooses(s) ? tr_first_choice(s) : s->set.method;
  s->clock = (tr_clock){.t = t, .start = t, .stop = t_stop, .every = every, .row_next = t, .width = width, .nbreaks = nbreaks};
  s->step = (tr_stepping){.h = s->set.hfixed, .method = method, .moved_t = t};
  s->pending = (tr_waiting){.kind = TR_NOTHING};
  s->loops = (tr_loops){0};
  s->moreau = (tr_moreau){.burst_t = t, .first_t = -1.0, .failed_t = -INFINITY};
  s->events = (tr_events){.capacity = capacity, .chatter_t = -INFINITY, .margin = CLEAR};
  s->audit = (tr_audit){.open_t = -1.0, .open_pair = -1, .fail_detail = -1, .fail_number = -1.0};
  s->stats = (tr_stats){0};
  s->bound = (tr_bounding){0};
  while (s->clock.next_break < nbreaks && TR_A(s, breaks)[s->clock.next_break] <= t) s->clock.next_break++;
  tr_moment_of(s)->inside = t + JUST_AFTER;
  memset(TR_A(s, z), 0, sizeof(double) * (s->k->active + s->k->neta));
  memset(TR_A(s, wrap), 0, sizeof(tr_memory) * (s->o ? s->o->npost : 0));
  memset(TR_A(s, impulsed), 0, sizeof(double) * s->k->npowers);
}

/* The first output row; the residual of the energy is measured from its value here. TR_OK, or why there is none. */
static int tr_first_row(tr_sim *s, double *row) {
  double *y = TR_A(s, yout);
  memcpy(y, TR_A(s, y), sizeof(double) * tr_width(s));
  int code = tr_output(s, s->clock.t, y, row);
  if (code != TR_OK) return s->clock.status = code;
  tr_all_contacts(s, y, (tr_contact *)TR_A(s, con));
  if (s->o->energy >= 0) {
    s->audit.energy0 = row[1 + s->o->energy];
    memset(TR_A(s, wrap), 0, sizeof(tr_memory) * s->o->npost);
    double kept[tr_solution_size(s)];
    tr_keep_solution(s, kept);
    memcpy(y, TR_A(s, y), sizeof(double) * tr_width(s));
    tr_output(s, s->clock.t, y, row);
    tr_put_solution(s, kept);
  }
  s->clock.row_index = 1, s->clock.row_next = s->clock.t + s->clock.every;
  return TR_OK;
}

/* Begin a run at (t, y) already assembled: scales, rank of the loops, modes, first row (0: none). */
int tr_start(tr_sim *s, double t, double t_stop, double every, double *row) {
  const tr_kernel *k = s->k;
  if (s->set.method < 0 || s->set.method >= TR_METHODS) return s->clock.status = TR_FAIL_METHOD;
  tr_reset(s, t, t_stop, every);
  s->ask.stop = 0, s->ask.work = 0.0;
  tr_units(s);
  if (k->active) {
    tr_maps_at(s, t, TR_A(s, y));
    tr_scale_rows(s, tr_rows_hold_nothing(s, TR_A(s, y)));
    tr_note_rank(s);
  }
  tr_shift(s, t, TR_A(s, y));
  const int open = k->coupled || (k->active && s->loops.rank < k->active);
  if (k->neta && k->loop_friction && k->nkappa == 0 && open) return TR_NEED_REDUNDANT;
  int modes = tr_start_modes(s);
  if (s->ask.stop) return s->clock.status = TR_STOPPED;
  if (modes != TR_OK && k->neta) { /* once more, from all starts there are */
    s->friction.anywhere = 1;
    modes = tr_start_modes(s);
    s->friction.anywhere = 0;
  }
  if (modes != TR_OK && !tr_through_jam(s)) return s->clock.status = s->ask.stop ? TR_STOPPED : modes;
  if (k->active + k->neta == 0 && !tr_rhs(s, t, TR_A(s, y), TR_A(s, dy))) return s->clock.status = TR_FAIL_MULTIPLIERS;
  if (k->neta) tr_certify(s);
  for (int i = 0; i < s->ny; ++i)
    if (!isfinite(TR_A(s, dy)[i])) {
      s->audit.fail_detail = i;
      return s->clock.status = TR_FAIL_NOT_FINITE;
    }
  tr_audit_begin(s);
  return s->o && row ? tr_first_row(s, row) : TR_OK;
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
  memcpy(dy, TR_A(s, dy), sizeof(double) * (s->ny + s->nworks));
  memcpy(z, TR_A(s, z), sizeof(double) * (s->k->active + s->k->neta));
  return 1;
}

/* dẏ/d[y, t] at the block's (t, y): ny × (ny + 1), column-major. 1 on success; needs the Jacobian unit. */
int tr_derivatives(tr_sim *s, double *out) {
  const int rows = s->ny, ld = tr_jacobian_rows(s);
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

/* What the run has cost so far, and the time its state is at. */
const tr_stats *tr_statistics(const tr_sim *s) { return &s->stats; }
double tr_time(const tr_sim *s) { return s->clock.t; }

/* How many events there are to read; they count as read. */
int tr_events_take(tr_sim *s) {
  int n = s->events.count;
  s->events.count = 0;
  return n;
}

/* Ask `host` now and then whether to give up (0: nobody). What is being sought then is not found; a start or an advance ends as TR_STOPPED. */
void tr_ask(tr_sim *s, int (*host)(void)) { s->ask = (tr_asking){.host = host}; }

/* How to step from now on. */
void tr_configure(tr_sim *s, const tr_settings *set) { s->set = *set; }

#include "hold.c"
#include "linearize.c"
#include "told.c"
#include "slopes.c"
#include "update.c"
#include "worn.c"
TR_OFTEN
#include "batch.c"
#include "ensemble.c"
#include "communicate.c"
