/* Access to variables. value_references.c defines the order of value references. */

/* Address of the value of input r. r counts the inputs, then the derivative inputs, then the sources of inputs. */
static double *fmu_input_at(const fmu_state *s, int r) {
  if (r < MODEL->inputs) return &FMU_INPUTS(s)[r].value;
  if (r >= fmu_first_source()) return FMU_A(s, sources) + SOURCE_VALUES * (r - fmu_first_source());
  const int which = MODEL->derivative[r - MODEL->inputs];
  return FMU_INPUTS(s)[which / 2].given + which % 2;
}

/* Add the costly outputs to the row of outputs, from a copy of the run, if rows omit them. */
static fmu_status fmu_add_costly(fmu_instance *m) {
  fmu_state *s = m->state, *copy = 0;
  if (!(s->deferred & FMU_COSTLY) || !FMU_SIM(s)->set.brief || s->failed) return FMU_OK;
  copy = fmu_copied(m);
  FMU_NEED(copy, "out of memory");
  FMU_SIM(copy)->set.brief = 0;
  const int code = tr_reach(FMU_SIM(copy), s->time, s->time, (long)MANY_STEPS, FMU_A(copy, row));
  for (int i = 0; i < MODEL->outputs && code == TR_DONE; ++i)
    if (MODEL->costly[i]) FMU_A(s, row)[1 + i] = FMU_A(copy, row)[1 + i];
  fmu_free(copy);
  s->deferred = 0;
  return code == TR_DONE ? FMU_OK : fmu_log(m, FMU_DISCARD, "the residuals and the contraction number do not exist at t = %.12g s: read them at another time", s->time);
}

/* Update the row of outputs if r is an output. */
static fmu_status fmu_fresh(fmu_instance *m, fmu_reference r) {
  const fmu_state *s = m->state;
  const fmu_status status = (int)r >= MODEL->outputs || (s->ready && !s->changed && !(s->deferred & FMU_ROW)) ? FMU_OK : fmu_refresh(m);
  return status > FMU_WARNING || (int)r >= MODEL->outputs || !MODEL->costly[r] ? status : fmu_add_costly(m);
}

/* The value at reference r. */
static double fmu_value(const fmu_state *s, int r) {
  const int no = MODEL->outputs, ni = fmu_all_inputs();
  if (r < no && s->certified && !MODEL->whole[r]) return s->certified > 0 ? FMU_A(s, errors)[r] : NAN;
  return r < no ? FMU_A(s, row)[1 + r] : r < no + ni ? *fmu_input_at(s, r - no) : FMU_A(s, settings)[r - no - ni];
}

static fmu_status fmu_get(fmu_instance *m, const fmu_reference *vr, size_t n, double *value) {
  const int all = fmu_count();
  for (size_t i = 0; i < n; ++i) {
    const int exchanged = fmu_is_exchanged(vr[i]);
    if (vr[i] >= (unsigned)all && !exchanged) return fmu_log(m, FMU_ERROR, "value reference %u: there is no real variable with this reference", vr[i]);
    fmu_status status = exchanged ? fmu_exchanged(m, vr[i], value++) : fmu_fresh(m, vr[i]);
    if (status > FMU_WARNING) return status;
    if (exchanged) continue;
    const int end = (int)vr[i] + fmu_width(vr[i]);
    for (int r = (int)vr[i]; r < end; ++r) *value++ = fmu_value(m->state, r);
  }
  return FMU_OK;
}

/* Check a value of a parameter. Logs the reason if the value is not allowed. */
static fmu_status fmu_check_setting(fmu_instance *m, const fmu_setting *g, double value) {
  int within = (g->open ? value > g->min : value >= g->min) && value <= g->max && !(g->nonzero && value == 0.0);
  if (!within) return fmu_log(m, FMU_DISCARD, "%s: %s %s (it is %g)", g->name, g->key, g->rule, value);
  if (m->state->mode == FMU_TERMINATED) return fmu_log(m, FMU_ERROR, "%s: a parameter cannot be set after termination: reset the instance first", g->name);
  if (m->state->mode >= FMU_STEPPING && !g->tunable)
    return fmu_log(m, FMU_ERROR, "%s: this parameter is fixed: set it before the initialization ends, or reset the instance", g->name);
  if (m->state->mode == FMU_CONTINUOUS) return fmu_log(m, FMU_ERROR, "%s: a parameter can be set only in event mode, not in continuous-time mode", g->name);
  return FMU_OK;
}

/* Compute in `trial` the numbers that depend on changed parameters, and check these numbers. Logs the reason if a number is not
 * allowed. */
static fmu_status fmu_check_followers(fmu_instance *m, double *trial) {
  const double *settings = FMU_A(m->state, settings);
  int first = MODEL->settings - MODEL->followers, anew = 0;
  for (int i = 0; i < first; ++i) anew |= MODEL->setting[i].kind == FMU_PARAMETER && trial[i] != settings[i];
  if (!anew) return FMU_OK;
  fmu_follow(trial);
  for (int i = first; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (!isfinite(trial[i])) return fmu_log(m, FMU_DISCARD, "%s: the expression of this number has no finite value with the present parameters", g->name);
    fmu_status status = trial[i] == settings[i] ? FMU_OK : fmu_check_setting(m, g, trial[i]);
    if (status != FMU_OK) return status;
  }
  return FMU_OK;
}

/* The value (order 0) or a derivative of an input that is the sum of its sources. */
static double fmu_sum_of_sources(const fmu_state *s, int to, int order) {
  double sum = 0.0;
  for (int i = 0; i < MODEL->sources; ++i) {
    const fmu_source *x = MODEL->source + i;
    if (x->to == to) sum += x->factor * FMU_A(s, sources)[SOURCE_VALUES * i + order] + (order ? 0.0 : x->offset);
  }
  return sum;
}

/* Whether input r is the sum of its sources. */
static int fmu_is_sum(int r) {
  for (int i = 0; i < MODEL->sources; ++i)
    if (MODEL->source[i].to == r) return 1;
  return 0;
}

/* Check a value for reference r, and store the value of a parameter in `trial`. Logs the reason if the value is not allowed. */
static fmu_status fmu_try(fmu_instance *m, int r, double value, double *trial) {
  const int no = MODEL->outputs, ni = fmu_all_inputs();
  if (r < no) return fmu_log(m, FMU_ERROR, "value reference %u: an output cannot be set", (unsigned)r);
  if (!isfinite(value)) return fmu_log(m, FMU_ERROR, "value reference %u: the value %g is not a finite number", (unsigned)r, value);
  FMU_NEED(r >= no + ni || !fmu_is_sum(r - no), "value reference %u: this input is the sum of its sources: set these", (unsigned)r);
  if (r < no + ni) return FMU_OK;
  if (m->state->mode == FMU_BETWEEN) return fmu_log(m, FMU_ERROR, "value reference %u: only inputs can be set between communication points, not parameters", (unsigned)r);
  fmu_status status = fmu_check_setting(m, MODEL->setting + (r - no - ni), value);
  if (status == FMU_OK) trial[r - no - ni] = value;
  return status;
}

/* Check a value for the reference of a state. In FMI, SetContinuousStates sets the states, but some importers set states as
 * variables. */
static fmu_status fmu_try_state(fmu_instance *m, fmu_reference r, double value) {
  const int in_run = m->state->mode == FMU_EVENTS || m->state->mode == FMU_CONTINUOUS;
  FMU_NEED(m->exchange && in_run && r < fmu_first_state() + (unsigned)fmu_states(),
           "value reference %u: only states can be set here, in event mode or continuous-time mode of model exchange", r);
  FMU_NEED(isfinite(value), "value reference %u: the value %g is not a finite number", r, value);
  return FMU_OK;
}

static void fmu_put_state(fmu_state *s, fmu_reference r, double value) {
  double *state = tr_array(FMU_SIM(s), TR_ARRAY_STATE) + (r - fmu_first_state());
  if (*state == value) return;
  *state = value;
  s->known = s->ready = 0;
}

/* Set input r. r counts the inputs, then the derivative inputs, then the sources of inputs. */
static void fmu_put_input(fmu_state *s, int r, double value) {
  if (r >= fmu_first_source()) {
    double *source = fmu_input_at(s, r);
    source[0] = value, source[1] = source[2] = 0.0;
    r = MODEL->source[r - fmu_first_source()].to;
    value = fmu_sum_of_sources(s, r, 0);
  }
  fmu_input *in = r < MODEL->inputs ? FMU_INPUTS(s) + r : 0;
  double *at = fmu_input_at(s, r);
  int moving = in && (in->told[0] != 0.0 || in->told[1] != 0.0 || in->given[0] != 0.0 || in->given[1] != 0.0);
  if (*at == value && !moving) return;
  *at = value;
  if (in) in->told[0] = in->told[1] = 0.0; /* a host sets the derivatives after the value */
  s->changed |= FMU_NEW_INPUTS;
}

static fmu_status fmu_set(fmu_instance *m, const fmu_reference *vr, size_t n, const double *value) {
  fmu_state *s = m->state;
  int no = MODEL->outputs, ni = fmu_all_inputs(), all = fmu_count();
  double *settings = FMU_A(s, settings), *trial = FMU_A(s, trial);
  const double *next = value;
  fmu_status status = FMU_OK;
  memcpy(trial, settings, sizeof(double) * MODEL->settings);
  for (size_t i = 0; i < n && status == FMU_OK; ++i) { /* check all values before setting any value */
    if (fmu_is_exchanged(vr[i])) status = fmu_try_state(m, vr[i], *next++);
    else if (vr[i] >= (unsigned)all) return fmu_log(m, FMU_ERROR, "value reference %u: there is no variable with this reference that can be set", vr[i]);
    else for (int r = (int)vr[i], end = r + fmu_width(vr[i]); r < end && status == FMU_OK; ++r) status = fmu_try(m, r, *next++, trial);
  }
  if (status == FMU_OK) status = fmu_check_followers(m, trial);
  if (status != FMU_OK) return status;
  for (size_t i = 0; i < n; ++i) {
    if (fmu_is_exchanged(vr[i])) fmu_put_state(s, vr[i], *value++);
    else for (int r = (int)vr[i], end = r + fmu_width(vr[i]); r < end; ++r, ++value)
      if (r < no + ni) fmu_put_input(s, r - no, *value);
  }
  for (int i = 0; i < MODEL->settings; ++i)
    if (settings[i] != trial[i]) s->changed |= FMU_NEW_PARAMETERS;
  memcpy(settings, trial, sizeof(double) * MODEL->settings);
  return FMU_OK;
}

/* Whether a reference is an input whose derivatives a host can set. */
static int fmu_told_of(fmu_reference vr) {
  const int r = (int)vr - MODEL->outputs, first = fmu_first_source();
  if (r < 0 || r >= fmu_all_inputs()) return 0;
  return r < MODEL->inputs ? !fmu_is_sum(r) : r >= first && MODEL->source[r - first].to < MODEL->inputs;
}

/* Set the first or second derivatives of inputs from the present communication point on. */
static fmu_status fmu_set_derivatives(fmu_instance *m, const fmu_reference *vr, size_t n, const int *order,
                                      const double *value) {
  fmu_state *s = m->state;
  for (size_t i = 0; i < n; ++i) {
    if (!fmu_told_of(vr[i]))
      return fmu_log(m, FMU_ERROR, "value reference %u: only inputs have derivatives that can be set, and this is not an input", vr[i]);
    if (order[i] < 1 || order[i] > 2) return fmu_log(m, FMU_ERROR, "value reference %u: only derivatives of order 1 and 2 can be set, not of order %d", vr[i], order[i]);
    if (!isfinite(value[i])) return fmu_log(m, FMU_ERROR, "value reference %u: the derivative %g is not a finite number", vr[i], value[i]);
  }
  for (size_t i = 0; i < n; ++i) {
    const int r = (int)vr[i] - MODEL->outputs, source = r - fmu_first_source(), to = source < 0 ? r : MODEL->source[source].to;
    if (source >= 0) FMU_A(s, sources)[SOURCE_VALUES * source + order[i]] = value[i];
    const double told = source < 0 ? value[i] : fmu_sum_of_sources(s, to, order[i]);
    double *at = FMU_INPUTS(s)[to].told + order[i] - 1;
    if (*at == told) continue;
    *at = told;
    s->changed |= FMU_NEW_INPUTS;
  }
  return FMU_OK;
}

/* Check that the references are integers or enumerations. */
static fmu_status fmu_are_whole(const fmu_instance *m, const fmu_reference *vr, size_t n) {
  for (size_t i = 0; i < n; ++i)
    if (vr[i] >= (unsigned)fmu_count() || !MODEL->whole[vr[i]])
      return fmu_log(m, FMU_ERROR, "value reference %u: there is no Integer variable or enumeration with this reference", vr[i]);
  return FMU_OK;
}

/* Get integer variables and enumerations. */
static fmu_status fmu_get_whole(fmu_instance *m, const fmu_reference *vr, size_t n, int *value) {
  fmu_status status = fmu_are_whole(m, vr, n);
  for (size_t i = 0; i < n && status <= FMU_WARNING; ++i) {
    double x = 0.0;
    status = fmu_get(m, vr + i, 1, &x);
    value[i] = (int)x;
  }
  return status;
}

static fmu_status fmu_set_whole(fmu_instance *m, const fmu_reference *vr, size_t n, const int *value) {
  fmu_status status = fmu_are_whole(m, vr, n);
  for (size_t i = 0; i < n && status == FMU_OK; ++i) {
    const double x = (double)value[i];
    status = fmu_set(m, vr + i, 1, &x);
  }
  return status;
}
