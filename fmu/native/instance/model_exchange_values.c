/* Values at the references of states, state derivatives and event indicators. */

#if defined FMU_ALONE /* a plain library has no model exchange */
static fmu_status fmu_exchanged(fmu_instance *m, fmu_reference r, double *value) { return (void)m, (void)r, (void)value, FMU_ERROR; }
#else
/* Evaluate the state derivatives ẏ and the event indicators, unless the stored values are valid. *rates: ẏ. */
static fmu_status fmu_rates(fmu_instance *m, const double **rates) {
  fmu_state *s = m->state;
  fmu_status status = s->mode < FMU_STEPPING ? fmu_refresh(m) : fmu_take_in(m);
  if (status > FMU_WARNING) return status;
  *rates = s->known ? tr_rates_known(FMU_SIM(s)) : tr_rates_in_modes(FMU_SIM(s));
  s->known = *rates != 0;
  return s->known ? FMU_OK : fmu_none_there(m);
}

/* The value at place `at` of the states, the state derivatives `rates` and the event indicators. */
static double fmu_exchanged_at(tr_sim *sim, const double *rates, int at) {
  const int n = fmu_states();
  return at < n ? tr_array(sim, TR_ARRAY_STATE)[at] : at < 2 * n ? rates[at - n] : tr_indicators(sim)[at - 2 * n];
}

/* The value of a state, state derivative or event indicator of a co-simulation instance. The internal time of the run can be ahead
 * of the communication point. Therefore the value is computed in a copy of the run. */
static fmu_status fmu_exchanged_inside(fmu_instance *m, int at, double *value) {
  const fmu_status status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  fmu_state *copy = fmu_copied(m);
  if (!copy) return fmu_log(m, FMU_ERROR, "out of memory");
  tr_sim *sim = FMU_SIM(copy);
  const double *rates = tr_cut(sim, copy->time) == TR_OK ? tr_begin_exchange(sim) : 0;
  if (rates) *value = fmu_exchanged_at(sim, rates, at);
  fmu_free(copy);
  return rates ? FMU_OK : fmu_none_there(m);
}

/* The value at the reference of a state, a state derivative or an event indicator. */
static fmu_status fmu_exchanged(fmu_instance *m, fmu_reference r, double *value) {
  const int at = (int)(r - fmu_first_state());
  const double *rates = 0;
  if (!m->exchange) return fmu_exchanged_inside(m, at, value);
  const fmu_status status = fmu_rates(m, &rates);
  if (status > FMU_WARNING) return status;
  *value = fmu_exchanged_at(FMU_SIM(m->state), rates, at);
  return FMU_OK;
}
#endif
