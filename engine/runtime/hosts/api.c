/* Entry points for hosts: parameters, start, rows, single evaluations. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

int tr_verify(tr_sim *s, int deciding) {
  int rest[s->k->nsliders + 1], n = 0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  if (deciding) n = tr_collect_pairs_at_rest(s, -1, rest);
  return tr_check_solution(s, TR_A(s, y), deciding ? rest : 0, n);
}

void tr_set_parameters(tr_sim *s) {
  s->k->prepare(s->k->scene, TR_A(s, p), TR_A(s, c));
  s->friction.pace = 0.0;
  for (int i = 0; i < s->k->npaces; ++i)
    s->friction.pace = fmax(s->friction.pace, fabs(TR_A(s, p)[s->k->pace[i].parameter]) * s->k->pace[i].hertz);
  if (s->o) s->o->prepare(s->o->scene, TR_A(s, p), TR_A(s, co));
  if (s->j) s->j->prepare(s->j->scene, TR_A(s, p), TR_A(s, cj));
}

int tr_assemble(tr_sim *s, double t, const double *qgiven, const double *vgiven) {
  s->clock.t = t;
  s->ask.cancelled = 0, s->ask.work = 0.0;
  tr_moment_of(s)->inside = t + JUST_AFTER;
  tr_set_initial_contacts(s);
  return tr_assemble_state(s, qgiven, vgiven);
}

void tr_gap(tr_sim *s, double *h) {
  const tr_kernel *k = s->k;
  tr_set_time(s, s->clock.t);
  if (k->rows) tr_evaluate_closure(s, TR_A(s, y), h);
}

/* Set the units of the tolerance. The unit of angles and quaternions is 1, and that of lengths the length scale. The unit of a rate
 * is that of its coordinate times the rate scale. */
static void tr_set_tolerance_units(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *u = TR_A(s, scale);
  for (int i = 0; i < tr_state_width(s); ++i) u[i] = 1.0;
  for (int i = 0; i < k->nq; ++i) u[i] = k->qkind[i] == TR_COORDINATE_LENGTH ? s->set.length : 1.0;
  for (int i = 0; i < k->nv; ++i) u[k->nq + i] = tr_rate_unit(s, i) * s->set.rate;
}

static void tr_reset_run(tr_sim *s, double t, double t_stop, double every) {
  const int width = s->clock.width, nbreaks = s->clock.nbreaks, capacity = s->events.capacity;
  const int method = tr_is_auto(s) ? tr_auto_explicit_method(s) : s->set.method;
  s->clock = (tr_clock){.t = t, .t_start = t, .t_end = t_stop, .every = every, .row_next = t, .width = width, .nbreaks = nbreaks};
  s->step = (tr_stepping){.h = s->set.hfixed, .method = method, .moved_t = t};
  s->pending = (tr_waiting){.kind = TR_NOTHING};
  s->loops = (tr_loops){0};
  s->moreau = (tr_moreau){.burst_t = t, .first_t = -1.0, .failed_t = -INFINITY};
  s->events = (tr_events){.capacity = capacity, .chatter_t = -INFINITY, .margin = CLEAR_MARGIN};
  s->audit = (tr_audit){.open_t = -1.0, .dead_t = -1.0, .open_pair = -1, .fail_detail = -1, .fail_number = -1.0};
  s->stats = (tr_stats){0};
  s->bound = (tr_bounding){0};
  tr_begin_breaks(s, t);
  tr_moment_of(s)->inside = t + JUST_AFTER;
  memset(TR_A(s, z), 0, sizeof(double) * (s->k->active + s->k->neta));
  memset(TR_A(s, post_memory), 0, sizeof(tr_memory) * (s->o ? s->o->npost : 0));
  memset(TR_A(s, impulse_work), 0, sizeof(double) * s->k->npowers);
}

/* Write the first row. The energy in this row becomes the reference of the energy residuals. Returns a status. */
static int tr_write_first_row(tr_sim *s, double *row) {
  double *y = TR_A(s, yout);
  memcpy(y, TR_A(s, y), sizeof(double) * tr_state_width(s));
  int code = tr_output_row(s, s->clock.t, y, row);
  if (code != TR_OK) return s->clock.status = code;
  tr_current_contacts(s, y, (tr_contact *)TR_A(s, contacts));
  memset(TR_A(s, contact_peaks), 0, sizeof(double) * s->o->ncontacts);
  if (s->o->energy >= 0) {
    s->audit.energy0 = row[1 + s->o->energy];
    memset(TR_A(s, post_memory), 0, sizeof(tr_memory) * s->o->npost);
    double kept[tr_solution_size(s)];
    tr_save_solution(s, kept);
    memcpy(y, TR_A(s, y), sizeof(double) * tr_state_width(s));
    tr_output_row(s, s->clock.t, y, row);
    tr_restore_solution(s, kept);
  }
  s->clock.row_index = 1, s->clock.row_next = s->clock.t + s->clock.every;
  return TR_OK;
}

int tr_start(tr_sim *s, double t, double t_stop, double every, double *row) {
  const tr_kernel *k = s->k;
  if (s->set.method < 0 || s->set.method >= TR_METHODS) return s->clock.status = TR_FAIL_METHOD;
  tr_reset_run(s, t, t_stop, every);
  s->ask.cancelled = 0, s->ask.work = 0.0, s->pulls.count = 0;
  tr_set_tolerance_units(s);
  if (k->active) {
    tr_evaluate_maps_at(s, t, TR_A(s, y));
    tr_find_rank(s, tr_has_idle_rows(s, TR_A(s, y)));
  }
  tr_move_run_to(s, t, TR_A(s, y));
  const int open = k->coupled || (k->active && s->loops.rank < tr_loop_rows(s)) || (k->nunilateral && tr_has_redundant_contacts(s));
  if (k->neta && k->loop_friction && k->nkappa == 0 && open) return TR_NEED_REDUNDANT;
  int modes = tr_set_initial_modes(s);
  if (s->ask.cancelled) return s->clock.status = TR_CANCELLED;
  if (modes != TR_OK && k->neta) { /* a second attempt uses all starts of Newton's method */
    s->friction.from_anywhere = 1;
    modes = tr_set_initial_modes(s);
    s->friction.from_anywhere = 0;
  }
  /* Contacts are also started if no modes were found, because modes may exist when some closed contacts open. */
  const int begun = k->nunilateral ? tr_start_contacts(s) : modes;
  if (begun != TR_OK && (modes == TR_OK || !tr_continue_through_jam(s))) return s->clock.status = s->ask.cancelled ? TR_CANCELLED : begun;
  if (k->active + k->neta == 0 && !tr_rhs(s, t, TR_A(s, y), TR_A(s, dy))) return s->clock.status = TR_FAIL_MULTIPLIERS;
  if (k->neta) tr_certify(s);
  for (int i = 0; i < s->ny; ++i)
    if (!isfinite(TR_A(s, dy)[i])) {
      s->audit.fail_detail = i;
      return s->clock.status = TR_FAIL_NOT_FINITE;
    }
  tr_audit_begin(s);
  return s->o && row ? tr_write_first_row(s, row) : TR_OK;
}

int tr_row(tr_sim *s, double *row) {
  memcpy(TR_A(s, yout), TR_A(s, y), sizeof(double) * tr_state_width(s));
  return tr_output_row(s, s->clock.t, TR_A(s, yout), row);
}

int tr_evaluate(tr_sim *s, double *dy, double *z) {
  s->step.watch = 0;
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  memcpy(dy, TR_A(s, dy), sizeof(double) * (s->ny + s->nworks));
  memcpy(z, TR_A(s, z), sizeof(double) * (s->k->active + s->k->neta));
  return 1;
}

int tr_derivatives(tr_sim *s, double *out) {
  const int rows = s->ny, ld = tr_jacobian_rows(s);
  if (!s->j) return 0;
  s->step.watch = 0, s->step.have_jac = 0;
  if (!tr_jacobian_at(s, s->clock.t, TR_A(s, y))) return 0;
  for (int q = 0; q <= s->ny; ++q) memcpy(out + (size_t)q * rows, TR_A(s, jac) + (size_t)q * ld, sizeof(double) * rows);
  return 1;
}

int tr_evaluate_for_redundancy(tr_sim *s) {
  if (!s->o || !s->o->nkappa || !s->k->rows) return 0;
  s->step.watch = 0;
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return -1;
  if (s->k->active == 0) s->loops.rank_now = 0;
  return 1;
}

int tr_redundancy(tr_sim *s, double *share) {
  const tr_kernel *k = s->k;
  const int found = tr_evaluate_for_redundancy(s);
  if (found != 1) return found;
  double z[k->rows + k->neta + 1];
  int evaluations;
  tr_expand_multipliers(s, TR_A(s, y), z, 0);
  return tr_open_shares(s, TR_A(s, y), z, share, 0, &evaluations);
}

int tr_open_columns(tr_sim *s, double *columns) {
  const tr_kernel *k = s->k;
  if (tr_evaluate_for_redundancy(s) != 1) return 0;
  double z[k->rows + k->neta + 1], share[s->o->nkappa];
  int evaluations;
  tr_expand_multipliers(s, TR_A(s, y), z, 0);
  tr_open_shares(s, TR_A(s, y), z, share, columns, &evaluations);
  return evaluations;
}

const tr_stats *tr_statistics(const tr_sim *s) { return &s->stats; }

double tr_time(const tr_sim *s) { return s->clock.t; }

int tr_events_take(tr_sim *s) {
  int n = s->events.count;
  s->events.count = 0;
  return n;
}

void tr_watch_pulls(tr_sim *s, int count, const int *slot, const double *sense, double *values) {
  s->pulls = (tr_pulls){count, slot, sense, values, values + count, values + 2 * count};
}

void tr_ask(tr_sim *s, tr_asked_host *host) { s->ask = (tr_asking){.host = host}; }

void tr_configure(tr_sim *s, const tr_settings *set) { s->set = *set; }
