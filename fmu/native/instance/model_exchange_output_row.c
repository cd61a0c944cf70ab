/* Model exchange: the row of outputs at the time and the state that the importer has set. */

#if defined FMU_ALONE /* a plain library has no model exchange */
static fmu_status fmu_row_here(fmu_instance *m) { return (void)m, FMU_ERROR; }
#else
/* Apply the host's changes at the present state: changes of inputs and, at events, of parameters. After a change of parameters,
 * decide the modes again. */
static fmu_status fmu_take_in(fmu_instance *m) {
  fmu_state *s = m->state;
  const int anew = (s->changed & FMU_NEW_PARAMETERS) != 0;
  if (!s->changed) return FMU_OK;
  const fmu_status together = fmu_together(m);
  if (together != FMU_OK) return together;
  if (anew) fmu_numbers(s);
  fmu_hand_inputs(m, s->time, 0);
  s->changed = 0, s->ready = s->known = 0;
  if (!anew) return FMU_OK;
  const int code = tr_resume(FMU_SIM(s), 1);
  if (code != TR_OK) return fmu_failed(m, code, FMU_ERROR);
  tr_begin_exchange(FMU_SIM(s));
  return FMU_OK;
}

/* Return fmu_discard for a state that has no solution in the present modes. States nearer to the last completed step have a
 * solution. */
static fmu_status fmu_none_there(fmu_instance *m) {
  return fmu_log(m, FMU_DISCARD, "t = %.12g s: the given state has no motion in the present modes, because an event lies before it: make a smaller step", m->state->time);
}

/* The row of outputs at the present time and state. */
static fmu_status fmu_row_here(fmu_instance *m) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_take_in(m);
  if (status > FMU_WARNING || s->ready) return status;
  s->known = 0;
  s->ready = tr_row_in_modes(FMU_SIM(s), FMU_A(s, row)) == TR_OK;
  return s->ready ? FMU_OK : fmu_none_there(m);
}
#endif
