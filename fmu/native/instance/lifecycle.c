/* Life cycle of an instance: creation, times and tolerance of the run, initialization, termination. */

#define LEAST_GIVEN_RTOL 1e-14 /* bounds of relative tolerances: smaller ones are round-off, larger ones give useless results */
#define MOST_RTOL 0.1

/* The reason why an instance of this type and GUID cannot be created; NULL if there is no such reason. */
static const char *fmu_refusal(int type, const char *guid) {
  if (!(MODEL->types & type))
    return type == FMU_EXCHANGE ? "this FMU is only for co-simulation" : "this FMU is only for model exchange";
  if (guid && !strcmp(guid, MODEL->guid)) return NULL;
  return MODEL->clocks ? "the instantiation token is not that of this FMU: use the modelDescription.xml of the same export"
                       : "the GUID is not that of this FMU: use the modelDescription.xml of the same export";
}

/* Create an instance with the exported values. On failure, logs the reason and returns NULL. why: a reason why the instance cannot
 * be created, or NULL. */
static fmu_instance *fmu_create(const fmu_host *host, const char *name, const char *why, int logging) {
  fmu_instance probe = {.host = *host, .name = (char *)(name ? name : ""), .logging = FMU_EVERYTHING};
  fmu_state layout = {0};
  const size_t bytes = fmu_layout(&layout);
  if (!name || !*name) why = "the instance name is empty or NULL: give the instance a name";
  fmu_instance *m = why ? NULL : fmu_allocate(sizeof *m);
  fmu_state *s = m ? fmu_allocate(bytes) : NULL;
  char *own = s ? fmu_allocate(strlen(name) + 1) : NULL;
  if (!own) {
    fmu_log(&probe, FMU_ERROR, "%s", why ? why : "out of memory");
    fmu_free(s);
    fmu_free(m);
    return NULL;
  }
  strcpy(own, name);
  *m = (fmu_instance){.host = *host, .state = s, .name = own, .logging = logging ? FMU_EVERYTHING : 0};
  s->bytes = bytes;
  fmu_defaults(s);
  return m;
}

static void fmu_destroy(fmu_instance *m) {
  if (!m) return;
  fmu_free(m->before);
  fmu_free(m->ahead);
  fmu_free(m->state);
  fmu_free(m->name);
  fmu_free(m);
}

/* Set start time, stop time and tolerance of the run. */
static fmu_status fmu_agree(fmu_instance *m, int tolerance_defined, double tolerance, double start, int stop_defined, double stop) {
  fmu_state *s = m->state;
  FMU_NEED(isfinite(start), "the start time %g s is not a finite number", start);
  FMU_NEED(!stop_defined || stop > start, "the stop time %g s must be after the start time %g s", stop, start);
  FMU_NEED(!tolerance_defined || tolerance > 0.0, "the tolerance %g must be positive", tolerance);
  s->start = s->time = s->reached = start;
  s->has_stop = stop_defined && isfinite(stop), s->stop = stop;
  s->has_tolerance = tolerance_defined != 0, s->tolerance = fmin(fmax(tolerance, LEAST_GIVEN_RTOL), MOST_RTOL);
  s->ready = 0;
  return FMU_OK;
}

/* Complete the initialization. */
static fmu_status fmu_begun(fmu_instance *m) {
  fmu_status status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  const tr_settings *set = &FMU_SIM(m->state)->set;
  m->state->mode = m->exchange ? FMU_EVENTS : FMU_STEPPING;
  fmu_tell(m, FMU_SAYS_PROGRESS, "the run begins at t = %.9g s: tolerance %g, %s", m->state->time, set->rtol, MODEL->bounded ? "bounded steps" : set->hfixed > 0.0 ? "fixed steps" : "error control");
  return status;
}

static fmu_status fmu_terminate(fmu_instance *m) {
  const tr_stats *said = &FMU_SIM(m->state)->stats;
  if (!m->exchange && (m->state->mode == FMU_STEPPING || m->state->mode == FMU_EVENTS))
    fmu_tell(m, FMU_SAYS_PROGRESS, "the run ends at t = %.9g s: %ld steps, %ld rejected, %ld evaluations, %ld events", m->state->time, said->steps,
             said->rejected, said->rhs_evaluations, said->events);
  m->state->mode = FMU_TERMINATED;
  return FMU_OK;
}
