/* Adjoint derivatives of outputs (FMI 3.0). */
/* out = Σ seed · ∂unknown/∂known, a number for each known: the derivatives along each. */
static fmu_status fmu_adjoint(fmu_instance *m, const fmu_reference *unknown, size_t nu, const fmu_reference *known, size_t nk,
                              const double *seed, double *out) {
  tr_signal direction[MODEL->inputs + 1];
  double all[MODEL->outputs + 1];
  fmu_status status = fmu_derivable(m, unknown, nu, known, nk);
  for (size_t j = 0; j < nk && status <= FMU_WARNING; ++j) {
    memset(direction, 0, sizeof direction);
    memset(all, 0, sizeof all);
    fmu_seed(m, known[j], 1.0, direction);
    status = fmu_along(m, direction, all);
    const double *weight = seed;
    out[j] = 0.0;
    for (size_t i = 0; i < nu; ++i)
      for (int r = (int)unknown[i], end = r + fmu_width(unknown[i]); r < end; ++r) out[j] += *weight++ * all[r];
  }
  return status;
}
