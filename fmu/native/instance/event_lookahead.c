/* Steps that end at events (FMI 3.0). A copy of the run locates the next event, and the run then advances to this event. The
 * internal steps of the run are those of a run that does not end steps at events. */

#define LOOK_AHEAD 1.0 /* longest wait for the record of a reversal, relative to 1/rate */

#define DUE 32         /* largest number of events in a look-ahead; the clocks of further events tick when these events are
                          recorded */

/* Result of a look-ahead. */
typedef struct fmu_sight {
  int ended, event;  /* ended: status of the copy's step; event: whether an event was found */
  int same;          /* whether the run would have made the same steps as the copy; the copy can then replace the run */
  double time, known; /* time of the first event, and time of its record, s; INFINITY if there is no event */
  int ndue;
  tr_event due[DUE]; /* found events */
} fmu_sight;

/* Allocate memory for look-aheads; returns 0 on failure. */
static int fmu_can_look(fmu_instance *m) {
  m->ahead = fmu_allocate(m->state->bytes);
  m->before = fmu_allocate(sizeof(double) * (1 + MODEL->columns->nout));
  return m->ahead && m->before;
}

/* Whether state s contains recorded events that the host does not know yet, and that end a step that begins at `from`. sight:
 * look-ahead result to update, or NULL. An event at or before `from` counts at the time of its record. */
static int fmu_new_events(const fmu_state *s, double from, fmu_sight *sight) {
  tr_sim *sim = FMU_SIM(s);
  const tr_event *e = (const tr_event *)tr_array(sim, TR_ARRAY_EVENTS);
  int found = 0;
  for (int i = 0; i < sim->events.count; ++i) {
    const double at = e[i].time > from && !fmu_same_event(e[i].time, from) ? e[i].time : tr_time(sim);
    if (fmu_is_heard(s, e + i) || fmu_same_event(at, from)) continue;
    found = 1;
    if (!sight) continue;
    sight->event = 1, sight->time = fmin(sight->time, at), sight->known = fmin(sight->known, tr_time(sim));
    if (sight->ndue < DUE) sight->due[sight->ndue++] = e[i];
  }
  return found;
}

/* Whether a friction pair of the copy is in its proportional zone and has reversed by `until`. Reversals that are reported or given
 * up do not count. give_up: give up the found reversals. The look-ahead does not wait for the records of these reversals. */
static int fmu_unsure(const fmu_instance *m, double until, int give_up) {
  int found = 0;
  for (int i = 0; i < MODEL->kernel->nsliders; ++i) {
    double turned;
    if (!tr_within_zone(FMU_SIM(m->ahead), i, &turned) || !(turned <= until)) continue;
    if (fmu_same_event(turned, FMU_A(m->ahead, heard)[i]) || turned == FMU_A(m->ahead, given_up)[i]) continue;
    found = 1;
    if (give_up) FMU_A(m->ahead, given_up)[i] = FMU_A(m->state, given_up)[i] = turned;
  }
  return found;
}

/* Whether a friction pair of the copy is in its proportional zone. */
static int fmu_in_zone(const fmu_instance *m) {
  double turned;
  for (int i = 0; i < MODEL->kernel->nsliders; ++i)
    if (tr_within_zone(FMU_SIM(m->ahead), i, &turned)) return 1;
  return 0;
}

/* Advance the copy to time t. Events on the way do not stop the copy, but are added to `sight`. Returns whether the copy reached
 * t. */
static int fmu_go_past(fmu_instance *m, double t, double limit, double from, fmu_sight *sight) {
  tr_sim *sim = FMU_SIM(m->ahead);
  for (;;) {
    const int ended = tr_reach_event(sim, t, fmax(t, limit), (long)MANY_STEPS, FMU_A(m->ahead, row), 0);
    if (ended != TR_EVENT) return ended == TR_DONE;
    const double known = sight->known; /* restored below, because these events are recorded only after the end of the step */
    fmu_new_events(m->ahead, from, sight);
    sight->known = known;
    tr_events_take(sim);
  }
}

/* Advance the copy until all reversals up to `until` are recorded. A reversal inside a proportional zone is recorded only when the
 * pair leaves the zone. */
static void fmu_look_into_zones(fmu_instance *m, double until, double limit, double from, fmu_sight *sight) {
  tr_sim *sim = FMU_SIM(m->ahead);
  if (!fmu_in_zone(m)) return;
  sight->same = 0;
  if (tr_time(sim) < until) fmu_go_past(m, tr_next_end(sim, limit), limit, from, sight);
  const double end = until + LOOK_AHEAD / MODEL->rate;
  for (double t = tr_time(sim); t < end && fmu_unsure(m, until, 0);) {
    t = fmin(end, tr_next_end(sim, fmax(end, limit)));
    if (!fmu_go_past(m, t, limit, from, sight)) break;
  }
  fmu_unsure(m, until, 1);
}

/* Advance a copy of the run to `target` or the next event. */
static fmu_sight fmu_look(fmu_instance *m, double target, double limit) {
  fmu_sight sight = {.same = 1, .time = INFINITY, .known = INFINITY};
  const double from = m->state->time;
  memcpy(m->ahead, m->state, m->state->bytes);
  tr_sim *sim = FMU_SIM(m->ahead);
  do {
    m->before[0] = NAN;
    sight.ended = tr_reach_event(sim, target, limit, fmu_most_steps(m->state), FMU_A(m->ahead, row), m->before);
    if (sight.ended == TR_EVENT && fmu_new_events(m->ahead, from, &sight)) break;
    sight.same = sight.same && sight.ended != TR_EVENT && m->before[0] != m->before[0];
    tr_events_take(sim);
  } while (sight.ended == TR_EVENT);
  if (sight.ended == TR_EVENT) tr_events_take(sim);
  if (sight.ended == TR_EVENT || sight.ended == TR_DONE)
    fmu_look_into_zones(m, sight.ended == TR_EVENT ? tr_time(sim) : target, limit, from, &sight);
  sight.event = sight.event && sight.time <= target;
  return sight;
}

/* Compute the row just before the event that is recorded at `time`, and store the row in `before`. A copy of the run advances to
 * `time` without handling the event. This function is needed if the look-ahead has not stored the row. */
static void fmu_row_up_to(fmu_instance *m, double time, double limit) {
  memcpy(m->ahead, m->state, m->state->bytes);
  if (tr_reach(FMU_SIM(m->ahead), time, limit, (long)MANY_STEPS, m->before) != TR_DONE) m->before[0] = NAN;
}

/* Advance the run to the event that is recorded first. Until the host has handled the event, the outputs keep their values just
 * before the event. */
static fmu_status fmu_stop_at_record(fmu_instance *m, const fmu_sight *sight, double target, double limit) {
  fmu_state *s = m->state;
  const double from = s->time;
  int ended, found;
  if (m->before[0] != m->before[0]) fmu_row_up_to(m, sight->known, limit);
  do {
    ended = tr_reach_event(FMU_SIM(s), target, limit, fmu_most_steps(s), FMU_A(s, row), 0);
    found = fmu_new_events(s, from, 0);
    if (ended == TR_EVENT && !found) fmu_tell_events(m);
  } while (ended == TR_EVENT && !found);
  if (ended != TR_EVENT) return fmu_arrived(m, ended, target);
  fmu_status status = fmu_arrived(m, TR_DONE, tr_time(FMU_SIM(s)));
  if (m->before[0] == m->before[0]) memcpy(FMU_A(s, row), m->before, sizeof(double) * (1 + MODEL->columns->nout)), s->event = 1;
  return status;
}

/* Advance the run to a reversal inside a proportional zone. The reversal is reported now, although it is recorded later. No output
 * jumps at such a reversal. */
static fmu_status fmu_stop_before_record(fmu_instance *m, const fmu_sight *sight, double limit) {
  fmu_state *s = m->state;
  fmu_status status = fmu_arrived(m, tr_reach(FMU_SIM(s), sight->time, limit, fmu_most_steps(s), FMU_A(s, row)), sight->time);
  for (int i = 0; i < sight->ndue; ++i) {
    const tr_event *e = sight->due + i;
    if (!fmu_same_event(e->time, sight->time) || e->kind != TR_EV_REVERSAL) continue;
    FMU_A(s, heard)[(int)e->index] = e->time;
    fmu_tick_now(s, e);
  }
  return status;
}

/* The time up to which there is certainly no event. This time is the end of the pending step. If a friction pair can reverse in the
 * step, the time is the beginning of the step. */
static double fmu_seen(const fmu_instance *m) {
  const tr_sim *sim = FMU_SIM(m->ahead);
  return sim->pending.kind == TR_NOTHING || fmu_in_zone(m) ? tr_time(sim) : sim->pending.t;
}

/* Advance by at most h to `target`, and stop at the next event. */
static fmu_status fmu_go_to_event(fmu_instance *m, double target, double h) {
  const double limit = fmu_limit(m->state, target, h);
  fmu_state *s = m->state;
  fmu_sight sight = {.ended = TR_DONE};
  s->deferred = FMU_COSTLY;
  if (!(target < s->seen) || fmu_same_event(target, s->seen)) {
    sight = fmu_look(m, target, limit);
    if (sight.event && (sight.time > sight.known || fmu_same_event(sight.time, sight.known))) return fmu_stop_at_record(m, &sight, target, limit);
    if (sight.event) return fmu_stop_before_record(m, &sight, limit);
    if (sight.ended == TR_DONE) s->seen = fmu_seen(m);
  }
  if (!sight.same || sight.ended != TR_DONE) return fmu_arrived(m, tr_reach(FMU_SIM(s), target, limit, fmu_most_steps(s), FMU_A(s, row)), target);
  m->ahead->seen = s->seen;
  m->state = m->ahead, m->ahead = s;
  return fmu_arrived(m, TR_DONE, target);
}

/* After the host has handled an event, update the outputs to the values just after the event. */
static fmu_status fmu_after_event(fmu_instance *m) {
  fmu_state *s = m->state;
  fmu_handled(s);
  if (!s->event) return fmu_refresh(m);
  s->event = 0;
  if (s->changed) return fmu_refresh(m);
  const int ended = tr_reach(FMU_SIM(s), s->time, s->time, (long)MANY_STEPS, FMU_A(s, row));
  return ended == TR_DONE ? FMU_OK : fmu_failed(m, ended, FMU_ERROR);
}
