/* Getting and setting variables. Value references count outputs, then inputs, then parameters. */
#include <string.h>
#include "fmu.h"
#include "following.c"

/* Inputs of all kinds: the scene's, then derivatives of some. */
static int fmu_all_inputs(void) { return MODEL->inputs + MODEL->derivatives; }

static int fmu_count(void) { return MODEL->outputs + fmu_all_inputs() + MODEL->settings - MODEL->followers; }

/* Where the value of an input is kept: r counts inputs of all kinds. */
static double *fmu_input_at(const fmu_state *s, int r) {
  if (r < MODEL->inputs) return &FMU_INPUTS(s)[r].value;
  const int which = MODEL->derivative[r - MODEL->inputs];
  return FMU_INPUTS(s)[which / 2].given + which % 2;
}

static fmi2Status fmu_get(fmu_instance *m, const fmi2ValueReference *vr, size_t n, double *value) {
  fmu_state *s = m->state;
  const double *row = FMU_A(s, row) + 1, *settings = FMU_A(s, settings);
  int no = MODEL->outputs, ni = fmu_all_inputs(), all = fmu_count(), fresh = s->ready && !s->changed;
  for (size_t i = 0; i < n; ++i) {
    int r = (int)vr[i];
    if (vr[i] >= (unsigned)all) return fmu_log(m, fmi2Error, "there is no real variable with value reference %u", vr[i]);
    if (r < no) {
      if (!fresh) {
        fmi2Status status = fmu_refresh(m);
        if (status > fmi2Warning) return status;
        fresh = 1;
      }
      value[i] = row[r];
    } else {
      value[i] = r < no + ni ? *fmu_input_at(s, r - no) : settings[r - no - ni];
    }
  }
  return fmi2OK;
}

/* Whether a parameter may have this value now; says why not. */
static fmi2Status fmu_check_setting(fmu_instance *m, const fmu_setting *g, double value) {
  int within = (g->open ? value > g->min : value >= g->min) && value <= g->max && !(g->nonzero && value == 0.0);
  if (!within) return fmu_log(m, fmi2Discard, "%s: %s %s (it is %g)", g->name, g->key, g->rule, value);
  if (m->state->mode == FMU_STEPPING && !g->tunable)
    return fmu_log(m, fmi2Error, "%s is fixed: set it before the initialization ends, or reset", g->name);
  if (m->state->mode == FMU_TERMINATED) return fmu_log(m, fmi2Error, "%s cannot be set after termination", g->name);
  return fmi2OK;
}

/* What follows the parameters of the scene in `trial`, where one of them is new; says which number may not have its value. */
static fmi2Status fmu_check_followers(fmu_instance *m, double *trial) {
  const double *settings = FMU_A(m->state, settings);
  int first = MODEL->settings - MODEL->followers, anew = 0;
  for (int i = 0; i < first; ++i) anew |= MODEL->setting[i].kind == FMU_PARAMETER && trial[i] != settings[i];
  if (!anew) return fmi2OK;
  fmu_follow(trial);
  for (int i = first; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (!isfinite(trial[i])) return fmu_log(m, fmi2Discard, "%s: its expression has no value", g->name);
    fmi2Status status = trial[i] == settings[i] ? fmi2OK : fmu_check_setting(m, g, trial[i]);
    if (status != fmi2OK) return status;
  }
  return fmi2OK;
}

static fmi2Status fmu_set(fmu_instance *m, const fmi2ValueReference *vr, size_t n, const double *value) {
  fmu_state *s = m->state;
  int no = MODEL->outputs, ni = fmu_all_inputs(), all = fmu_count();
  double *settings = FMU_A(s, settings), *trial = FMU_A(s, trial);
  memcpy(trial, settings, sizeof(double) * MODEL->settings);
  for (size_t i = 0; i < n; ++i) { /* check all values before setting any */
    int r = (int)vr[i];
    if (vr[i] >= (unsigned)all) return fmu_log(m, fmi2Error, "there is no real variable with value reference %u", vr[i]);
    if (r < no) return fmu_log(m, fmi2Error, "value reference %u is an output: it cannot be set", vr[i]);
    if (!isfinite(value[i])) return fmu_log(m, fmi2Error, "value reference %u: the value is not a finite number", vr[i]);
    if (r >= no + ni) {
      fmi2Status status = fmu_check_setting(m, MODEL->setting + (r - no - ni), value[i]);
      if (status != fmi2OK) return status;
      trial[r - no - ni] = value[i];
    }
  }
  fmi2Status status = fmu_check_followers(m, trial);
  if (status != fmi2OK) return status;
  for (size_t i = 0; i < n; ++i) {
    int r = (int)vr[i] - no;
    if (r >= ni) continue;
    fmu_input *in = r < MODEL->inputs ? FMU_INPUTS(s) + r : 0;
    double *at = fmu_input_at(s, r);
    int moving = in && (in->told[0] != 0.0 || in->told[1] != 0.0 || in->given[0] != 0.0 || in->given[1] != 0.0);
    if (*at == value[i] && !moving) continue;
    *at = value[i];
    if (in) in->told[0] = in->told[1] = 0.0; /* a host sets derivatives after the value */
    s->changed |= FMU_NEW_INPUTS;
  }
  for (int i = 0; i < MODEL->settings; ++i)
    if (settings[i] != trial[i]) s->changed |= FMU_NEW_PARAMETERS;
  memcpy(settings, trial, sizeof(double) * MODEL->settings);
  return fmi2OK;
}

/* First or second derivative of inputs from the present communication point on. */
static fmi2Status fmu_set_derivatives(fmu_instance *m, const fmi2ValueReference *vr, size_t n, const fmi2Integer *order,
                                      const double *value) {
  fmu_state *s = m->state;
  for (size_t i = 0; i < n; ++i) {
    if (vr[i] < (unsigned)MODEL->outputs || vr[i] >= (unsigned)(MODEL->outputs + MODEL->inputs))
      return fmu_log(m, fmi2Error, "value reference %u is no input", vr[i]);
    if (order[i] < 1 || order[i] > 2) return fmu_log(m, fmi2Error, "derivatives of order 1 and 2 are taken, not %d", order[i]);
    if (!isfinite(value[i])) return fmu_log(m, fmi2Error, "value reference %u: the derivative is not a finite number", vr[i]);
  }
  for (size_t i = 0; i < n; ++i) {
    double *at = FMU_INPUTS(s)[vr[i] - MODEL->outputs].told + order[i] - 1;
    if (*at == value[i]) continue;
    *at = value[i];
    s->changed |= FMU_NEW_INPUTS;
  }
  return fmi2OK;
}

/* Whether these are references of variables that are whole numbers. */
static fmi2Status fmu_are_whole(const fmu_instance *m, const fmi2ValueReference *vr, size_t n) {
  for (size_t i = 0; i < n; ++i)
    if (vr[i] >= (unsigned)fmu_count() || !MODEL->whole[vr[i]])
      return fmu_log(m, fmi2Error, "there is no Integer variable or enumeration with value reference %u", vr[i]);
  return fmi2OK;
}

/* Integer variables and enumerations. */
static fmi2Status fmu_get_whole(fmu_instance *m, const fmi2ValueReference *vr, size_t n, fmi2Integer *value) {
  fmi2Status status = fmu_are_whole(m, vr, n);
  for (size_t i = 0; i < n && status <= fmi2Warning; ++i) {
    double x = 0.0;
    status = fmu_get(m, vr + i, 1, &x);
    value[i] = (fmi2Integer)x;
  }
  return status;
}

static fmi2Status fmu_set_whole(fmu_instance *m, const fmi2ValueReference *vr, size_t n, const fmi2Integer *value) {
  fmi2Status status = fmu_are_whole(m, vr, n);
  for (size_t i = 0; i < n && status == fmi2OK; ++i) {
    const double x = (double)value[i];
    status = fmu_set(m, vr + i, 1, &x);
  }
  return status;
}
