/* Adjoint derivatives (FMI 3.0). */
/* For each known j: out[j] = Σ_i seed_i · ∂unknown_i/∂known_j. Each known needs its own computation of the derivatives. */
static fmu_status fmu_adjoint(fmu_instance *m, const fmu_reference *unknown, size_t nu, const fmu_reference *known, size_t nk,
                              const double *seed, double *out) {
  tr_signal inputs[MODEL->inputs + 1];
  double all[MODEL->outputs + 1], states[fmu_states() + 1], rates[fmu_states() + 1];
  fmu_direction d = {inputs, states, fmu_asks_outputs(unknown, nu)};
  fmu_status status = fmu_derivable(m, unknown, nu, known, nk);
  for (size_t j = 0; j < nk && status <= FMU_WARNING; ++j) {
    memset(inputs, 0, sizeof inputs), memset(states, 0, sizeof states), memset(rates, 0, sizeof rates), memset(all, 0, sizeof all);
    fmu_seed(m, known[j], 1.0, &d);
    status = fmu_along(m, &d, all, rates);
    const double *weight = seed;
    out[j] = 0.0;
    for (size_t i = 0; i < nu; ++i) {
      int n;
      for (const double *x = fmu_numbers_of(unknown[i], all, rates, &n), *end = x + n; x < end; ++x) out[j] += *weight++ * *x;
    }
  }
  return status;
}
