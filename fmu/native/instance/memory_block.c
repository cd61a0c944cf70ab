/* The memory block of an instance: allocation, layout, exported values. */

#if defined FMU_ALONE /* a plain library allocates no memory */
static void *fmu_allocate(size_t bytes) { return (void)bytes, NULL; }
static void fmu_free(void *p) { (void)p; }
#else
#include <stdlib.h>
static void *fmu_allocate(size_t bytes) { return calloc(1, bytes); }
static void fmu_free(void *p) { free(p); }
#endif

/* Set the offsets of the arrays behind fmu_state. Returns the size of the block, bytes. */
static size_t fmu_layout(fmu_state *s) {
  int at = 0;
  s->settings = at, at += MODEL->settings;
  s->trial = at, at += MODEL->settings;
  s->inputs = at, at += TR_DOUBLES(fmu_input) * MODEL->inputs;
  s->sources = at, at += SOURCE_VALUES * MODEL->sources;
  s->row = at, at += 1 + MODEL->columns->nout;
  s->ticks = at, at += MODEL->clocks ? TR_DOUBLES(fmu_tick) * MODEL->clocks->count : 0;
  s->heard = at, at += MODEL->clocks ? MODEL->kernel->nsliders : 0;
  s->given_up = at, at += MODEL->clocks ? MODEL->kernel->nsliders : 0;
  s->errors = at, at += MODEL->erring ? MODEL->outputs : 0;
  s->other = at, at += MODEL->erring ? 1 + MODEL->columns->nout : 0;
  s->sim = at = (at + 7) & ~7;
  const size_t bytes = tr_size(MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events);
  s->second = at + (((int)(bytes / sizeof(double)) + 8) & ~7);
  return sizeof(fmu_state) + (MODEL->erring ? sizeof(double) * s->second : sizeof(double) * at) + bytes;
}

/* Set all values of the block to the exported values. */
static void fmu_defaults(fmu_state *s) {
  size_t bytes = s->bytes;
  memset(s, 0, bytes);
  fmu_layout(s);
  s->bytes = bytes;
  strncpy(s->guid, MODEL->guid, sizeof s->guid - 1);
  for (int i = 0; i < MODEL->settings; ++i) FMU_A(s, settings)[i] = MODEL->setting[i].start;
  for (int i = 0; i < MODEL->inputs; ++i) FMU_INPUTS(s)[i].value = ((const tr_input *)(MODEL->tables + (int)MODEL->tables[i]))->u[0];
  for (int i = 0; i < MODEL->sources; ++i) FMU_A(s, sources)[SOURCE_VALUES * i] = MODEL->source[i].start;
}

/* The value of the first parameter of a kind, or `otherwise` if the model has no such parameter. */
static double fmu_setting_of(const fmu_state *s, int kind, double otherwise) {
  for (int i = 0; i < MODEL->settings; ++i)
    if (MODEL->setting[i].kind == kind) return FMU_A(s, settings)[i];
  return otherwise;
}

/* Exchange the roles of the run and the second run. */
static void fmu_swap(fmu_state *s) {
  const int sim = s->sim;
  s->sim = s->second, s->second = sim;
}

/* Set the pointers in a run that was copied from another address. */
static void fmu_adopt_run(fmu_state *s) {
  tr_sim *sim = FMU_SIM(s);
  sim->k = MODEL->kernel, sim->o = MODEL->columns, sim->j = MODEL->jacobian;
  if (!sim->k->scene) return;
  /* the constants of a parts kernel begin with the address of its scene (engine/parts/bytecode/interpreter.h) */
  memcpy(TR_A(sim, c), &sim->k->scene, sizeof(void *));
  memcpy(TR_A(sim, co), &sim->o->scene, sizeof(void *));
  memcpy(TR_A(sim, cj), &sim->j->scene, sizeof(void *));
}

/* Set the pointers in a block that was copied from another address. */
static void fmu_adopt(fmu_state *s) {
  fmu_adopt_run(s);
  if (!s->certified) return;
  fmu_swap(s), fmu_adopt_run(s), fmu_swap(s);
}

/* A copy of the state, in which the run can be continued; NULL if memory is lacking. The caller frees the copy. */
static fmu_state *fmu_copied(const fmu_instance *m) {
  fmu_state *copy = fmu_allocate(m->state->bytes);
  if (!copy) return NULL;
  memcpy(copy, m->state, m->state->bytes);
  fmu_adopt(copy);
  return copy;
}
