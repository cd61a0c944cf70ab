/* Time derivatives of outputs at the present time (fmi2GetRealOutputDerivatives, fmi3GetOutputDerivatives). */

#define AHEAD 1e-6 /* time step of a forward difference, relative to 1/rate; about equal to the relative error of the derivative */

/* Compute the row of outputs a small time step later, in a copy of the state. Returns the time step, or 0 if the row cannot be
 * computed. */
static double fmu_row_ahead(fmu_instance *m, double *row) {
  const double ahead = AHEAD / MODEL->rate;
  fmu_state *copy = fmu_copied(m);
  if (!copy) return 0.0;
  FMU_SIM(copy)->set.brief = 0;
  const int reached = tr_reach(FMU_SIM(copy), copy->time + ahead, copy->time + LOOKAHEAD_STEPS * ahead, (long)MANY_STEPS, row);
  fmu_free(copy);
  return reached == TR_DONE ? ahead : 0.0;
}

/* Time derivatives of outputs. If the derivative of an output is itself an output, the value of that output is used. A discrete
 * output has the derivative 0. For other outputs, the derivative is a forward difference. */
static fmu_status fmu_output_derivatives(fmu_instance *m, const fmu_reference *vr, size_t n, const int *order, double *value) {
  double later[1 + MODEL->columns->nout], ahead = 0.0;
  for (size_t i = 0; i < n; ++i) {
    if (vr[i] >= (unsigned)MODEL->outputs) return fmu_log(m, FMU_ERROR, "value reference %u: only outputs have time derivatives, and this is not an output", vr[i]);
    if (order[i] != 1) return fmu_log(m, FMU_ERROR, "value reference %u: only derivatives of order 1 are available, not of order %d", vr[i], order[i]);
  }
  fmu_status status = n ? fmu_refresh(m) : FMU_OK;
  for (size_t i = 0; i < n && status <= FMU_WARNING; ++i) status = fmu_fresh(m, vr[i]);
  if (status > FMU_WARNING) return status;
  const double *now = FMU_A(m->state, row) + 1;
  for (size_t i = 0; i < n; ++i)
    for (int r = (int)vr[i], end = r + fmu_width(vr[i]); r < end; ++r) {
      const int rate = MODEL->slope[r];
      if (rate == -1 && ahead == 0.0 && (ahead = fmu_row_ahead(m, later)) == 0.0) return fmu_log(m, FMU_DISCARD, "value reference %u: its derivative does not exist at t = %.12g s: ask at another time", vr[i], m->state->time);
      *value++ = rate >= 0 ? now[rate] : rate == -1 ? (later[1 + r] - now[r]) / ahead : 0.0;
    }
  return FMU_OK;
}
