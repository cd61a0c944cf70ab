/* Clocks that tick at events (FMI 3.0), and which events have been told ahead of their record. */

#define SAME_EVENT 1e-9 /* of 1/rate: events that are nearer to each other are one instant; what is found again after a change is as near */

/* Whether two times of events are the same. */
static int fmu_same_event(double a, double b) { return fabs(a - b) <= SAME_EVENT / MODEL->rate; }

/* No event has happened, and none is foreseen. */
static void fmu_forget_events(fmu_state *s) {
  s->ticking = s->event = s->midway = 0, s->seen = s->start, s->stride = 0.0;
  if (!MODEL->clocks) return;
  memset(FMU_TICKS(s), 0, sizeof(fmu_tick) * MODEL->clocks->count);
  for (int i = 0; i < MODEL->kernel->nsliders; ++i) FMU_A(s, heard)[i] = FMU_A(s, given_up)[i] = -INFINITY;
}

/* A reversal is recorded only once it is sure: whether this one has been told before. */
static int fmu_is_heard(const fmu_state *s, const tr_event *e) {
  return e->kind == TR_EV_REVERSAL && fmu_same_event(e->time, FMU_A(s, heard)[(int)e->index]);
}

/* The clock of an event, -1 where there is none. */
static int fmu_clock_of(const tr_event *e) {
  const int kind = (int)e->kind, of_stop = TR_IS_OF_STOP(kind);
  const int watched = (of_stop ? MODEL->kernel->nsliders : 0) + (int)e->index;
  return kind < MODEL->clocks->kinds ? MODEL->clocks->of[watched * MODEL->clocks->kinds + kind] : -1;
}

/* The clock of an event ticks. */
static void fmu_tick_now(fmu_state *s, const tr_event *e) {
  const int clock = fmu_clock_of(e);
  s->ticking = 1;
  if (clock < 0) return;
  fmu_tick *tick = FMU_TICKS(s) + clock;
  tick->time = e->time, tick->count += 1.0, tick->active = 1.0;
}

/* The clock of an event that has been recorded ticks, unless it did so ahead of that. */
static void fmu_tick_of(const fmu_instance *m, const tr_event *e) {
  if (!fmu_is_heard(m->state, e)) fmu_tick_now(m->state, e);
}

/* The host has handled what has happened so far. */
static void fmu_handled(fmu_state *s) {
  s->ticking = 0;
  for (int i = 0; MODEL->clocks && i < MODEL->clocks->count; ++i) FMU_TICKS(s)[i].active = 0.0;
}
