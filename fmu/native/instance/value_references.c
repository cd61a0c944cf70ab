/* Value references. Their order is: outputs, inputs, derivative inputs, sources of inputs, parameters, clocks (FMI 3.0), states,
 * state derivatives, event indicators. */

/* Number of inputs of the scene and of derivative inputs. The sources of inputs follow these. */
static int fmu_first_source(void) { return MODEL->inputs + MODEL->derivatives; }
static int fmu_all_inputs(void) { return fmu_first_source() + MODEL->sources; }

/* Number of values of the variable at a reference. The number is above 1 for an array (only in FMI 3.0), and 0 inside an array. */
static int fmu_width(fmu_reference r) { return MODEL->width ? MODEL->width[r] : 1; }

static int fmu_count(void) { return MODEL->outputs + fmu_all_inputs() + MODEL->settings - MODEL->followers; }

/* Number of continuous states in model exchange. */
static int fmu_states(void) {
  const tr_kernel *k = MODEL->kernel;
  return k->nq + k->nv + k->nb + (MODEL->columns->works ? k->npowers : 0);
}

static int fmu_indicators(void) { return 2 * MODEL->kernel->nsliders + MODEL->kernel->nstops + (MODEL->kernel->neta > 0); }

/* The reference of the first state. The other states, the state derivatives and the event indicators follow. */
static unsigned fmu_first_state(void) {
  return (unsigned)(fmu_count() + (MODEL->clocks ? 1 + 3 * MODEL->clocks->count + (MODEL->clocks->last >= 0) : 0));
}

#if defined FMU_ALONE /* a plain library has no model exchange */
static int fmu_is_exchanged(fmu_reference r) { return (void)r, 0; }
#else
/* Whether a reference belongs to a state, a state derivative or an event indicator. */
static int fmu_is_exchanged(fmu_reference r) {
  const unsigned first = fmu_first_state();
  return MODEL->types & FMU_EXCHANGE && r >= first && r < first + (unsigned)(2 * fmu_states() + fmu_indicators());
}
#endif
