/* A second run at a tighter tolerance beside the run itself. By what the two differ, the errors of the outputs are told (METHOD, "Global error"). */

#define RESOLVED 3e-3   /* of the tolerance, of an output's size: below it two runs tell nothing */
#define ROUND_OFF 1e-13 /* of an output's size and of its unit's */
#define LINEAR 0.3      /* of an output's size and of its unit's: errors beyond are no longer small */
#define WHOLE_TURN 6.283185307179586
#define DECIDED_LATE 1.0 /* of 1/rate: so long two runs may differ in the number of their events before they have decided otherwise */

/* Begin the second run where the run itself has begun, as `begin` does that for either. */
static void fmu_begin_second(fmu_instance *m, fmu_status (*begin)(fmu_instance *m, double tighter)) {
  fmu_state *s = m->state;
  const fmu_instance quiet = {.host = {.allocate = m->host.allocate, .release = m->host.release}, .state = s, .name = m->name};
  fmu_instance other = quiet;
  s->certified = MODEL->erring && fmu_setting_of(s, FMU_ERRORS, 0.0) >= 1.0;
  if (!s->certified) return;
  memset(FMU_A(s, errors), 0, sizeof(double) * MODEL->outputs);
  memcpy(FMU_A(s, other), FMU_A(s, row), sizeof(double) * (1 + MODEL->columns->nout));
  fmu_swap(s);
  const int done = begin(&other, MODEL->tighter) == FMU_OK;
  fmu_swap(s);
  memcpy(FMU_A(s, row), FMU_A(s, other), sizeof(double) * (1 + MODEL->columns->nout));
  s->certified = done ? 1 : -1, s->apart = s->start;
}

/* What the two runs differ by now, into the errors of the outputs; alike: whether they have had as many events. Whether it is still small. */
static int fmu_compare(fmu_state *s, int alike) {
  const double *row = FMU_A(s, row) + 1, *other = FMU_A(s, other) + 1, rtol = FMU_SIM(s)->set.rtol;
  double *error = FMU_A(s, errors);
  int small = 1;
  for (int i = 0; i < MODEL->outputs; ++i) {
    const fmu_erring *kind = MODEL->erring + i;
    if (kind->jumps && !alike) continue;
    double apart = fabs(row[i] - other[i]), size = fabs(row[i]);
    if (kind->wraps) apart = fmod(apart, WHOLE_TURN), apart = fmin(apart, WHOLE_TURN - apart);
    error[i] = kind->errs ? fmax(error[i], fmax(MODEL->larger * apart, fmax(RESOLVED * rtol * size, ROUND_OFF * fmax(size, kind->scale)))) : NAN;
    if (kind->tells && error[i] > LINEAR * (kind->scale + size)) small = 0;
  }
  return small;
}

/* Let the second run follow to where the run itself is. reach: how far its steps may reach. */
static void fmu_second_follows(fmu_instance *m, double reach) {
  fmu_state *s = m->state;
  if (s->certified <= 0) return;
  fmu_swap(s);
  const int done = tr_reach(FMU_SIM(s), s->time, reach, (long)MANY_STEPS, FMU_A(s, other)) == TR_DONE;
  const long events = FMU_SIM(s)->stats.events;
  tr_events_take(FMU_SIM(s));
  fmu_swap(s);
  const int alike = FMU_SIM(s)->stats.events == events;
  if (alike) s->apart = s->time;
  if (!done || s->time - s->apart > DECIDED_LATE / MODEL->rate || !fmu_compare(s, alike)) s->certified = -1;
}
