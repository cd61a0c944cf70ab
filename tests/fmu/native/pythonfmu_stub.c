/* Replacement of pythonfmu's library on Windows without Python. It acts as the slave, with the native library in the resources. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>
#include "fmi2Functions.h"

/* The fields of fmu_bridge (fmu/native/pythonfmu/slave_calls.c) that slaves use. */
typedef struct bridge {
  int status, logging;
  const char *guid;
  void *logger, *model, *library;
} bridge;

#define EXPORT __declspec(dllexport)
#define MODEL(b, name) ((name##TYPE *)GetProcAddress((b)->library, #name))

EXPORT fmi2Component fmi2Instantiate(fmi2String n, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f, fmi2Boolean v, fmi2Boolean l) {
  char where[4096], own[100];
  const char *behind = strchr(n, '\x1f');
  (void)t, (void)g, (void)f, (void)v, (void)l;
  if (!behind) return NULL;
  bridge *b = (bridge *)(size_t)strtoull(behind + 1, NULL, 16);
  snprintf(where, sizeof where, "%s/native.dll", r);
  b->library = LoadLibraryA(where);
  if (!b->library) return NULL;
  fmi2CallbackFunctions host = {(fmi2CallbackLogger)b->logger, NULL, NULL, NULL, b};
  snprintf(own, sizeof own, "%.*s", (int)(behind - n), n);
  b->model = MODEL(b, fmi2Instantiate)(own, fmi2CoSimulation, b->guid, "", &host, 0, b->logging);
  return b;
}

EXPORT void fmi2FreeInstance(fmi2Component c) {
  bridge *b = c;
  if (b->model) MODEL(b, fmi2FreeInstance)(b->model);
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real t0, fmi2Boolean sd, fmi2Real t1) {
  bridge *b = c;
  b->status = MODEL(b, fmi2SetupExperiment)(b->model, td, tol, t0, sd, t1);
  return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  bridge *b = c;
  b->status = MODEL(b, fmi2EnterInitializationMode)(b->model);
  return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  bridge *b = c;
  b->status = MODEL(b, fmi2ExitInitializationMode)(b->model);
  return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean last) {
  bridge *b = c;
  b->status = MODEL(b, fmi2DoStep)(b->model, t, h, last);
  return b->status > fmi2Warning ? fmi2Discard : fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  bridge *b = c;
  b->status = MODEL(b, fmi2GetReal)(b->model, r, n, v);
  return fmi2OK;
}
