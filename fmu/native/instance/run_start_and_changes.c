/* Start of a run, and changes of inputs and parameters during a run. */

/* Pass the parameters of the equations to the simulation. */
static void fmu_numbers(fmu_state *s) {
  double *p = tr_array(FMU_SIM(s), TR_ARRAY_PARAMETERS);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (g->kind == FMU_NUMBER) p[g->index] = FMU_A(s, settings)[i];
    if (g->kind == FMU_NUMBER && g->also >= 0) p[g->also] = FMU_A(s, settings)[i];
  }
}

/* Pass start values of coordinates and rates to the simulation; assembly normalises the quaternions. */
static void fmu_start_values(fmu_state *s) {
  double *y = tr_array(FMU_SIM(s), TR_ARRAY_STATE);
  memcpy(y, MODEL->q, sizeof(double) * MODEL->kernel->nq);
  memcpy(y + MODEL->kernel->nq, MODEL->v, sizeof(double) * MODEL->kernel->nv);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (g->kind == FMU_START_Q) y[g->index] = FMU_A(s, settings)[i];
    if (g->kind == FMU_START_QD) y[MODEL->kernel->nq + g->index] = FMU_A(s, settings)[i];
  }
}

/* Check the parameters that limit each other, and log a violation. The check is made when the parameters take effect, because hosts
 * set parameters one by one. After a violation, the host can correct the parameters and continue. */
static fmu_status fmu_together(fmu_instance *m) {
  const double *value = FMU_A(m->state, settings);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i, *low = MODEL->setting + g->above;
    if (g->above >= 0 && !(g->strict ? value[g->above] < value[i] : value[g->above] <= value[i]))
      return fmu_log(m, FMU_DISCARD, "%s: %s must %s %s: %g is %s %g", g->name, g->key, g->strict ? "be above" : "not be below", low->key,
                     value[i], g->strict ? "not above" : "below", value[g->above]);
    if (g->rotation && value[i] == 0.0 && value[i + 1] == 0.0 && value[i + 2] == 0.0 && value[i + 3] == 0.0)
      return fmu_log(m, FMU_DISCARD, "%s: a quaternion of four zeros is not a rotation: set at least one component", g->name);
  }
  return FMU_OK;
}

/* The relative tolerance of the run: solver.tolerance, or the host's tolerance. If the two differ, the choice is logged. */
static double fmu_tolerance(const fmu_instance *m) {
  const fmu_state *s = m->state;
  const double own = fmu_setting_of(s, FMU_TOLERANCE, DEFAULT_RTOL);
  const int rule = (int)fmu_setting_of(s, FMU_HOST_TOLERANCE, FMU_HOST_TIGHTER);
  if (!s->has_tolerance || s->tolerance == own) return own;
  const int taken = rule == FMU_HOST_COUNTS || (rule == FMU_HOST_TIGHTER && s->tolerance < own);
  fmu_log(m, FMU_OK, "the run uses the tolerance %g of %s, not %g of %s, because of solver.host_tolerance = %d", taken ? s->tolerance : own,
          taken ? "the host" : "solver.tolerance", taken ? own : s->tolerance, taken ? "solver.tolerance" : "the host", rule);
  return taken ? s->tolerance : own;
}

/* Pass the bounds of real-time steps to the simulation. */
static void fmu_bound(fmu_state *s) {
  tr_settings *set = &FMU_SIM(s)->set;
  if (!MODEL->bounded) return;
  set->events = (int)fmu_setting_of(s, FMU_MOST_EVENTS, 0.0);
  set->evaluations = (int)fmu_setting_of(s, FMU_MOST_EVALUATIONS, 1.0), set->iterations = (int)fmu_setting_of(s, FMU_MOST_ITERATIONS, 1.0);
}

/* Whether rows omit costly outputs. If so, fmu_add_costly computes these outputs when a host reads one of them. This requires a
 * copy of the state, which a plain library cannot make. */
static int fmu_omits_costly(const fmu_instance *m) {
#if defined FMU_ALONE
  (void)m;
  return 0;
#else
  return !m->exchange && !m->ahead && !m->between && !MODEL->erring;
#endif
}

/* Assemble and start a run at the start time, with the tolerance divided by `tighter`. */
static fmu_status fmu_begin_run(fmu_instance *m, double tighter) {
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  memset(sim, 0, tr_size(MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events));
  tr_init(sim, MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events);
  memcpy(tr_array(sim, TR_ARRAY_PARAMETERS), MODEL->p, sizeof(double) * MODEL->kernel->np);
  memcpy(tr_array(sim, TR_ARRAY_BREAKS), MODEL->breaks, sizeof(tr_break) * MODEL->nbreaks);
  memcpy(tr_array(sim, TR_ARRAY_TABLES), MODEL->tables, sizeof(double) * MODEL->ntables);
  fmu_numbers(s);
  tr_set_parameters(sim);
  const tr_settings set = {.rtol = fmu_tolerance(m) / tighter, .hmax = INFINITY, .hfixed = fmu_setting_of(s, FMU_STEP, 0.0), .length = MODEL->length,
                           .rate = MODEL->rate, .energy = MODEL->energy, .method = MODEL->method, .project = 1, .locate = 1,
                           .through_jams = MODEL->through_jams, .brief = fmu_omits_costly(m)};
  tr_configure(sim, &set);
  fmu_bound(s);
  fmu_start_values(s);
  s->time = s->reached = s->point = s->start, s->failed = s->why = s->told = s->tenths = 0;
  fmu_forget_events(s);
  fmu_hand_inputs(m, s->start, 1);
  int closed = tr_assemble(sim, s->start, MODEL->q_given, MODEL->v_given);
  if (closed != 1) {
    s->failed = TR_FAIL_CLOSURE;
    return fmu_log(m, FMU_ERROR, "open_loop: no start %s near the given values close the loops: check lengths and start values",
                   closed ? "velocities" : "positions");
  }
  int status = tr_start(sim, s->start, s->start, INFINITY, FMU_A(s, row));
  if (status == TR_NEED_REDUNDANT) {
    s->failed = status;
    return fmu_log(m, FMU_ERROR, "with the present parameters the loops are redundant, and friction depends on this: export the scene again with these parameters");
  }
  if (status != TR_OK) return fmu_failed(m, status, FMU_ERROR);
  return FMU_OK;
}

/* Assemble and start the run at the start time. */
static fmu_status fmu_begin(fmu_instance *m) {
  fmu_state *s = m->state;
  fmu_status status = fmu_together(m);
  if (status == FMU_OK) status = fmu_begin_run(m, 1.0);
  if (status != FMU_OK) return status;
  if (!m->exchange) fmu_begin_second(m, fmu_begin_run);
  s->ready = 1, s->deferred = FMU_COSTLY, s->changed = s->known = 0;
  if (m->exchange) tr_begin_exchange(FMU_SIM(s));
  return FMU_OK;
}

/* Apply the host's changes to a run. */
static int fmu_change_run(fmu_instance *m) {
  fmu_state *s = m->state;
  int status = tr_cut(FMU_SIM(s), s->time), anew = (s->changed & FMU_NEW_PARAMETERS) != 0;
  if (status == TR_OK && anew) fmu_numbers(s), fmu_bound(s);
  fmu_hand_inputs(m, s->time, 0);
  return status == TR_OK ? tr_resume(FMU_SIM(s), anew) : status;
}

/* Apply the host's changes at the present time to the run and to the second run. */
static fmu_status fmu_take_over(fmu_instance *m) {
  fmu_state *s = m->state;
  if (!s->changed) return FMU_OK;
  fmu_status together = fmu_together(m);
  if (together != FMU_OK) return together;
  const int status = fmu_change_run(m);
  if (status != TR_OK) return fmu_failed(m, status, FMU_DISCARD);
  if (s->certified > 0) {
    fmu_swap(s);
    if (fmu_change_run(m) != TR_OK) s->certified = -1;
    fmu_swap(s);
  }
  s->changed = 0, s->ready = 0, s->moved = 1, s->event = 0, s->seen = s->time;
  return FMU_OK;
}
