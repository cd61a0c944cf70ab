/* Error estimates of outputs, computed from the difference between the run and a second run with a tighter tolerance (theory,
 * "Global error"). */

#define RESOLVED 3e-3   /* smallest meaningful difference of the runs, relative to tolerance times size of an output */
#define LEAST_STATED_ERROR 1e-13 /* smallest error, relative to an output or to the scale of its unit, whichever is larger */
#define LINEAR 0.3      /* largest error that counts as small, relative to the size of an output plus the scale of its unit */
#define DECIDED_LATE 1.0 /* if the numbers of events differ for longer than this, relative to 1/rate, the two runs have diverged */

/* Start the second run with the start values of the first run. begin: function that starts a run. */
static void fmu_begin_second(fmu_instance *m, fmu_status (*begin)(fmu_instance *m, double tighter)) {
  fmu_state *s = m->state;
  const fmu_instance quiet = {.state = s, .name = m->name};
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

/* Update the error estimates of the outputs, and return whether the errors are small. alike: whether both runs had the same number
 * of events. */
static int fmu_compare(fmu_state *s, int alike) {
  const double *row = FMU_A(s, row) + 1, *other = FMU_A(s, other) + 1, rtol = FMU_SIM(s)->set.rtol;
  double *error = FMU_A(s, errors);
  int small = 1;
  for (int i = 0; i < MODEL->outputs; ++i) {
    const fmu_erring *kind = MODEL->erring + i;
    if (kind->jumps && !alike) continue;
    double apart = fabs(row[i] - other[i]), size = fabs(row[i]);
    if (kind->wraps) apart = fmod(apart, TURN), apart = fmin(apart, TURN - apart);
    const double least = fmax(RESOLVED * rtol * size, LEAST_STATED_ERROR * fmax(size, kind->scale));
    error[i] = kind->errs ? fmax(error[i], fmax(MODEL->larger * apart, least)) : NAN;
    if (kind->tells && error[i] > LINEAR * (kind->scale + size)) small = 0;
  }
  return small;
}

/* Advance the second, more accurate run to the time that the first run has reached, and compare the two runs. No internal step ends
 * after `reach`. If the runs differ too much, estimates end (certified = -1). */
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
