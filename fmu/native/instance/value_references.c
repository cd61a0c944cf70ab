/* Value references: outputs, inputs of all kinds, parameters; behind them clocks (FMI 3.0), then states, their derivatives and indicators. */

/* Inputs of all kinds: the scene's, then derivatives of some. */
static int fmu_all_inputs(void) { return MODEL->inputs + MODEL->derivatives; }

/* How many numbers begin at a reference: more than one of an array, which only FMI 3.0 has. */
static int fmu_width(fmu_reference r) { return MODEL->width ? MODEL->width[r] : 1; }

static int fmu_count(void) { return MODEL->outputs + fmu_all_inputs() + MODEL->settings - MODEL->followers; }

/* Continuous states of model exchange. */
static int fmu_states(void) {
  const tr_kernel *k = MODEL->kernel;
  return k->nq + k->nv + k->nb + (MODEL->columns->works ? k->npowers : 0);
}

static int fmu_indicators(void) { return 2 * MODEL->kernel->nsliders + MODEL->kernel->nstops + (MODEL->kernel->neta > 0); }

/* The first reference of a state; behind the states their derivatives and the indicators follow. */
static unsigned fmu_first_state(void) {
  return (unsigned)(fmu_count() + (MODEL->clocks ? 1 + 3 * MODEL->clocks->count + (MODEL->clocks->last >= 0) : 0));
}

#if defined FMU_ALONE /* a plain library has no model exchange */
static int fmu_is_exchanged(fmu_reference r) { return (void)r, 0; }
#else
/* Whether a reference is that of a state, a derivative or an indicator. */
static int fmu_is_exchanged(fmu_reference r) {
  const unsigned first = fmu_first_state();
  return MODEL->types & FMU_EXCHANGE && r >= first && r < first + (unsigned)(2 * fmu_states() + fmu_indicators());
}
#endif
