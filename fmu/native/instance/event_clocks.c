/* FMI 3.0 clocks that tick at events. The look-ahead can report a reversal before the run records this reversal. The clock then
 * does not tick again when the run records the reversal. */

#define SAME_EVENT 1e-9 /* relative to 1/rate: events at most this far apart count as the same event */

/* Whether events at the times a and b count as the same event. */
static int fmu_same_event(double a, double b) { return fabs(a - b) <= SAME_EVENT / MODEL->rate; }

/* Clear all data about past events and about events that the look-ahead found. */
static void fmu_forget_events(fmu_state *s) {
  s->ticking = s->event = s->midway = 0, s->seen = s->start, s->stride = 0.0;
  if (!MODEL->clocks) return;
  memset(FMU_TICKS(s), 0, sizeof(fmu_tick) * MODEL->clocks->count);
  for (int i = 0; i < MODEL->kernel->nsliders; ++i) FMU_A(s, heard)[i] = FMU_A(s, given_up)[i] = -INFINITY;
}

/* Whether event e is a reversal that a look-ahead reported before the run recorded the event. */
static int fmu_is_heard(const fmu_state *s, const tr_event *e) {
  return e->kind == TR_EV_REVERSAL && fmu_same_event(e->time, FMU_A(s, heard)[(int)e->index]);
}

/* The index of the clock of an event; -1 if the event has no clock. */
static int fmu_clock_of(const tr_event *e) {
  const int kind = (int)e->kind, of_stop = TR_IS_OF_STOP(kind);
  const int watched = (of_stop ? MODEL->kernel->nsliders : 0) + (int)e->index;
  return kind < MODEL->clocks->kinds ? MODEL->clocks->of[watched * MODEL->clocks->kinds + kind] : -1;
}

/* Tick the clock of an event. */
static void fmu_tick_now(fmu_state *s, const tr_event *e) {
  const int clock = fmu_clock_of(e);
  s->ticking = 1;
  if (clock < 0) return;
  fmu_tick *tick = FMU_TICKS(s) + clock;
  tick->time = e->time, tick->count += 1.0, tick->active = 1.0;
}

/* Mark past events as handled by the host. */
static void fmu_handled(fmu_state *s) {
  s->ticking = 0;
  for (int i = 0; MODEL->clocks && i < MODEL->clocks->count; ++i) FMU_TICKS(s)[i].active = 0.0;
}
