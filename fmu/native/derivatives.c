/* Directional derivatives of outputs with inputs at the present state: exact, from the kernel's own derivatives. */
#include "fmu.h"

/* ∂out/∂inputs · direction at the present state, found in a copy of it: asking changes nothing. */
static fmi2Status fmu_along(fmu_instance *m, const tr_signal *direction, double *all) {
  fmu_instance copy = *m;
  copy.state = fmu_allocate(&m->host, m->state->bytes);
  if (!copy.state) return fmu_log(m, fmi2Error, "out of memory");
  memcpy(copy.state, m->state, m->state->bytes);
  fmu_adopt(copy.state);
  tr_sim *sim = FMU_SIM(copy.state);
  int ny = MODEL->kernel->nq + MODEL->kernel->nv;
  double none[ny + 1], rates[ny + 1];
  memset(none, 0, sizeof none);
  int ok = tr_cut(sim, copy.state->time) == TR_OK && tr_directional(sim, MODEL->linear, direction, none, rates, all);
  fmu_free(&m->host, copy.state);
  return ok ? fmi2OK : fmu_log(m, fmi2Error, "there are no derivatives at this state");
}

/* out = Σ seed · ∂unknown/∂known. */
static fmi2Status fmu_directional(fmu_instance *m, const fmi2ValueReference *unknown, size_t nu, const fmi2ValueReference *known,
                                  size_t nk, const double *seed, double *out) {
  int no = MODEL->outputs, ni = MODEL->inputs;
  tr_signal direction[ni + 1];
  double all[no + 1];
  for (size_t i = 0; i < nu; ++i)
    if (unknown[i] >= (unsigned)no) return fmu_log(m, fmi2Error, "derivatives are of outputs; %u is none", unknown[i]);
  for (size_t i = 0; i < nk; ++i)
    if (known[i] < (unsigned)no || known[i] >= (unsigned)(no + ni))
      return fmu_log(m, fmi2Error, "derivatives are with inputs; %u is none", known[i]);
  fmi2Status status = fmu_refresh(m);
  if (status > fmi2Warning) return status;
  memset(direction, 0, sizeof direction);
  for (size_t i = 0; i < nk; ++i) {
    int input = (int)known[i] - no;
    const tr_input *in = tr_input_record(FMU_SIM(m->state), input);
    if (in->followed == 0.0) direction[input].value += seed[i];
    else direction[input].second += in->bandwidth * in->bandwidth * seed[i]; /* a motion that follows an input answers with its acceleration at once */
  }
  memset(all, 0, sizeof all);
  if (nk) status = fmu_along(m, direction, all);
  if (status > fmi2Warning) return status;
  for (size_t i = 0; i < nu; ++i) out[i] = all[unknown[i]];
  return fmi2OK;
}
