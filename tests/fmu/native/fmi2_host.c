/* A host without Python: loads the library, makes invalid calls, then creates, steps and frees many instances. It prints the growth
 * of the process in kB and the time of a step in microseconds. Usage: host LIBRARY GUID INSTANCES */
#include <time.h>
#include "fmi2Functions.h"
#include "dynamic_library.h"

static int told;
static void hear(void *e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
  (void)e, (void)n, (void)s, (void)c, (void)m;
  told++;
}

static void *refuse(size_t count, size_t bytes) { return (void)count, (void)bytes, NULL; }

int main(int argc, char **argv) {
  NEED(argc == 4);
  void *h = (void *)OPEN(argv[1]);
  NEED(h);
  fmi2InstantiateTYPE *make = (fmi2InstantiateTYPE *)FIND(h, "fmi2Instantiate");
  fmi2SetupExperimentTYPE *setup = (fmi2SetupExperimentTYPE *)FIND(h, "fmi2SetupExperiment");
  fmi2EnterInitializationModeTYPE *enter = (fmi2EnterInitializationModeTYPE *)FIND(h, "fmi2EnterInitializationMode");
  fmi2ExitInitializationModeTYPE *leave = (fmi2ExitInitializationModeTYPE *)FIND(h, "fmi2ExitInitializationMode");
  fmi2DoStepTYPE *step = (fmi2DoStepTYPE *)FIND(h, "fmi2DoStep");
  fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)FIND(h, "fmi2GetReal");
  fmi2FreeInstanceTYPE *drop = (fmi2FreeInstanceTYPE *)FIND(h, "fmi2FreeInstance");
  NEED(make && setup && enter && leave && step && get && drop);
  fmi2CallbackFunctions host = {hear, refuse, free, NULL, NULL}, bare = {NULL, NULL, NULL, NULL, NULL};
  fmi2ValueReference first = 0, none = 4000000000u;
  fmi2Real value = 0.0;
  NEED(!make("a", fmi2CoSimulation, "another", "", &host, 0, 0) && told == 1);
  NEED(!make("a", fmi2ModelExchange, argv[2], "", &host, 0, 0));
  NEED(!make("", fmi2CoSimulation, argv[2], "", &host, 0, 0));
  NEED(!make(NULL, fmi2CoSimulation, NULL, NULL, &host, 0, 0));
  NEED(!make("a", fmi2CoSimulation, argv[2], "", NULL, 0, 0));
  NEED(step(NULL, 0, 1, 1) == fmi2Error && get(NULL, &first, 1, &value) == fmi2Error);
  fmi2Component c = make("a", fmi2CoSimulation, argv[2], NULL, &bare, 0, 0);
  NEED(c && step(c, 0, 1, 1) == fmi2Error && get(c, NULL, 1, &value) == fmi2Error && get(c, &none, 1, &value) == fmi2Error);
  drop(c);
  drop(NULL);
  long before = 0, count = atol(argv[3]);
  for (long i = 0; i < count; ++i) {
    if (i == count / 100) before = resident();
    c = make("a", fmi2CoSimulation, argv[2], "", &host, 0, 0);
    NEED(c && !setup(c, 0, 0, 0, 0, 0) && !enter(c) && !leave(c));
    for (int k = 0; k < 3; ++k) NEED(!step(c, 0.01 * k, 0.01, 1));
    NEED(!get(c, &first, 1, &value));
    drop(c);
  }
  long grown = resident() - before;
  c = make("a", fmi2CoSimulation, argv[2], "", &host, 0, 0);
  NEED(c && !setup(c, 0, 0, 0, 0, 0) && !enter(c) && !leave(c));
  clock_t t0 = clock();
  for (int k = 0; k < 10000; ++k) NEED(!step(c, 1e-4 * k, 1e-4, 1));
  double each = (double)(clock() - t0) / CLOCKS_PER_SEC * 1e2;
  get(c, &first, 1, &value);
  drop(c);
  char line[100];
  snprintf(line, sizeof line, "%ld %.3f %.17g\n", grown, each, value);
  fputs(line, stdout);
  return 0;
}
