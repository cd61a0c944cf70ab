/* Directional derivatives of outputs with respect to inputs. In model exchange, state derivatives can also be unknowns, and states
 * can also be knowns. All derivatives come from the exact derivatives of the kernel. */

/* A direction: changes of the input signals and of the states. columns: whether the host requests derivatives of outputs. */
typedef struct fmu_direction {
  tr_signal *inputs;
  double *states;
  int columns;
} fmu_direction;

/* Compute the derivatives of all outputs (`all`) and of all state derivatives (`rates`) along a direction. The computation uses a
 * copy of the state. */
static fmu_status fmu_along(fmu_instance *m, const fmu_direction *d, double *all, double *rates) {
  fmu_instance copy = *m;
  copy.state = fmu_copied(m);
  if (!copy.state) return fmu_log(m, FMU_ERROR, "out of memory");
  tr_sim *sim = FMU_SIM(copy.state);
  int ok;
  if (m->exchange) ok = tr_directional_in_modes(sim, MODEL->linear, d->columns ? MODEL->integral : 0, d->inputs, d->states, rates, all);
  else ok = tr_cut(sim, copy.state->time) == TR_OK && tr_directional(sim, MODEL->linear, d->inputs, d->states, rates, all);
  fmu_free(copy.state);
  return ok ? FMU_OK : fmu_log(m, m->exchange ? FMU_DISCARD : FMU_ERROR, "t = %.12g s: the derivatives do not exist at this state, for example at an event: ask at another time", m->state->time);
}

/* Whether a reference belongs to a state (behind = 0) or to a state derivative (behind = 1) in model exchange. */
static int fmu_is_exchanged_state(const fmu_instance *m, fmu_reference r, int behind) {
  const unsigned first = fmu_first_state() + (unsigned)(behind * fmu_states());
  return m->exchange && r >= first && r < first + (unsigned)fmu_states();
}

/* Check a request for derivatives. Logs the reason if the request is not allowed. */
static fmu_status fmu_derivable(fmu_instance *m, const fmu_reference *unknown, size_t nu, const fmu_reference *known, size_t nk) {
  const int no = MODEL->outputs, ni = fmu_all_inputs();
  const char *also = m->exchange ? " or a derivative of a state" : "", *with = m->exchange ? " or a state" : "";
  for (size_t i = 0; i < nu; ++i)
    if (unknown[i] >= (unsigned)no && !fmu_is_exchanged_state(m, unknown[i], 1)) return fmu_log(m, FMU_ERROR, "value reference %u: an unknown of a derivative must be an output%s", unknown[i], also);
  for (size_t i = 0; i < nk; ++i)
    if ((known[i] < (unsigned)no || known[i] >= (unsigned)(no + ni)) && !fmu_is_exchanged_state(m, known[i], 0))
      return fmu_log(m, FMU_ERROR, "value reference %u: a known of a derivative must be an input%s", known[i], with);
  return fmu_refresh(m);
}

/* Add the seed of an input or a state to a direction. */
static void fmu_seed(const fmu_instance *m, fmu_reference known, double seed, fmu_direction *d) {
  if (fmu_is_exchanged_state(m, known, 0)) {
    d->states[known - fmu_first_state()] += seed;
    return;
  }
  int at = (int)known - MODEL->outputs;
  if (at >= fmu_first_source()) {
    const fmu_source *source = MODEL->source + (at - fmu_first_source());
    seed *= source->factor, at = source->to;
  }
  const int which = at < MODEL->inputs ? 2 * at : MODEL->derivative[at - MODEL->inputs];
  const tr_input *in = tr_input_record(FMU_SIM(m->state), which / 2);
  if (m->state->time < in->begin) return; /* the input has no effect yet */
  const double w = in->bandwidth, answer = at >= MODEL->inputs ? which % 2 ? 1.0 : 2.0 * w : w * w;
  if (in->followed == 0.0) d->inputs[which / 2].value += seed;
  else d->inputs[which / 2].second += answer * seed; /* the acceleration of a motion that follows the input changes at once */
}

/* Whether any of the unknowns is an output. */
static int fmu_asks_outputs(const fmu_reference *unknown, size_t nu) {
  for (size_t i = 0; i < nu; ++i)
    if (unknown[i] < (unsigned)MODEL->outputs) return 1;
  return 0;
}

/* The values of an unknown, in the array of outputs or of state derivatives. *n: number of these values. */
static const double *fmu_numbers_of(fmu_reference unknown, const double *all, const double *rates, int *n) {
  const int column = unknown < (unsigned)MODEL->outputs;
  *n = column ? fmu_width(unknown) : 1;
  return column ? all + unknown : rates + (unknown - fmu_first_state() - (unsigned)fmu_states());
}

/* For each unknown i: out_i = Σ_j seed_j · ∂unknown_i/∂known_j. */
static fmu_status fmu_directional(fmu_instance *m, const fmu_reference *unknown, size_t nu, const fmu_reference *known,
                                  size_t nk, const double *seed, double *out) {
  tr_signal inputs[MODEL->inputs + 1];
  double all[MODEL->outputs + 1], states[fmu_states() + 1], rates[fmu_states() + 1];
  fmu_direction d = {inputs, states, fmu_asks_outputs(unknown, nu)};
  fmu_status status = fmu_derivable(m, unknown, nu, known, nk);
  if (status > FMU_WARNING) return status;
  memset(inputs, 0, sizeof inputs), memset(states, 0, sizeof states), memset(rates, 0, sizeof rates), memset(all, 0, sizeof all);
  for (size_t i = 0; i < nk; ++i) fmu_seed(m, known[i], seed[i], &d);
  if (nk) status = fmu_along(m, &d, all, rates);
  if (status > FMU_WARNING) return status;
  for (size_t i = 0; i < nu; ++i) {
    int n;
    for (const double *x = fmu_numbers_of(unknown[i], all, rates, &n), *end = x + n; x < end; ++x) *out++ = *x;
  }
  return FMU_OK;
}
