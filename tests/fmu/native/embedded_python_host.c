/* A C host of an FMU that contains Python code. It loads the library, makes runs, frees the instance and unloads the library. It
 * prints the first variable of the last run. Usage: embedding LIBRARY GUID RESOURCES RUNS */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include "fmi2Functions.h"

static void hear(void *e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) { (void)e, (void)n, (void)c, fprintf(stderr, "%d %s\n", s, m); }

#define FIND(name) name##TYPE *name##_ = (name##TYPE *)dlsym(h, #name)
#define NEED(condition) \
  if (!(condition)) return fputs("failed: " #condition "\n", stderr), 1

int main(int argc, char **argv) {
  NEED(argc == 5);
  void *h = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (!h) return fputs(dlerror(), stderr), 1;
  FIND(fmi2Instantiate);
  FIND(fmi2SetupExperiment);
  FIND(fmi2EnterInitializationMode);
  FIND(fmi2ExitInitializationMode);
  FIND(fmi2DoStep);
  FIND(fmi2GetReal);
  FIND(fmi2FreeInstance);
  fmi2CallbackFunctions host = {hear, calloc, free, NULL, NULL};
  fmi2ValueReference first = 0;
  fmi2Real value = 0.0;
  for (int run = 0; run < atoi(argv[4]); ++run) {
    fmi2Component c = fmi2Instantiate_("a", fmi2CoSimulation, argv[2], argv[3], &host, 0, 0);
    NEED(c && !fmi2SetupExperiment_(c, 0, 0, 0, 0, 0) && !fmi2EnterInitializationMode_(c) && !fmi2ExitInitializationMode_(c));
    for (int k = 0; k < 100; ++k) NEED(!fmi2DoStep_(c, 0.01 * k, 0.01, 1));
    NEED(!fmi2GetReal_(c, &first, 1, &value));
    fmi2FreeInstance_(c);
  }
  NEED(!dlclose(h));
  printf("%.17g\n", value);
  return 0;
}
