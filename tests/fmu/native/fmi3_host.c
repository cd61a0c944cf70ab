/* A host without Python for FMI 3.0: makes invalid calls, creates and frees many instances that each pass an event, and makes a
 * run in event mode. It prints the growth of the process in kB, then the times of the events. Usage: host LIBRARY TOKEN INSTANCES
 * UNTIL */
#include "fmi3Functions.h"
#include "dynamic_library.h"
#define HAVE(name) name##TYPE *p##name = (name##TYPE *)FIND(h, #name)

static int told;
static void hear(fmi3InstanceEnvironment e, fmi3Status s, fmi3String c, fmi3String m) {
  (void)e, (void)s, (void)c, (void)m;
  told++;
}

int main(int argc, char **argv) {
  NEED(argc == 5);
  void *h = (void *)OPEN(argv[1]);
  char text[40];
  NEED(h);
  HAVE(fmi3InstantiateCoSimulation);
  HAVE(fmi3InstantiateModelExchange);
  HAVE(fmi3EnterInitializationMode);
  HAVE(fmi3ExitInitializationMode);
  HAVE(fmi3EnterEventMode);
  HAVE(fmi3EnterStepMode);
  HAVE(fmi3UpdateDiscreteStates);
  HAVE(fmi3DoStep);
  HAVE(fmi3GetFloat64);
  HAVE(fmi3FreeInstance);
  fmi3ValueReference first = 0, none = 4000000000u;
  fmi3Float64 value[8], reached = 0.0, next;
  fmi3Boolean event, ended, early, a, b, c, d, e;
  NEED(!pfmi3InstantiateCoSimulation("a", "another", "", 0, 0, 1, 1, NULL, 0, NULL, hear, NULL) && told == 1);
  NEED(!pfmi3InstantiateCoSimulation("", argv[2], "", 0, 0, 1, 1, NULL, 0, NULL, hear, NULL) && told == 2);
  NEED(!pfmi3InstantiateCoSimulation(NULL, NULL, NULL, 0, 0, 1, 1, NULL, 0, NULL, NULL, NULL));
  NEED(!pfmi3InstantiateCoSimulation("a", argv[2], "", 0, 0, 1, 1, &none, 1, NULL, hear, NULL) && told == 3);
  NEED(!pfmi3InstantiateModelExchange("a", argv[2], "", 0, 0, NULL, hear) && told == 4);
  NEED(pfmi3DoStep(NULL, 0, 1, 1, &event, &ended, &early, &reached) == fmi3Error);
  long before = 0, count = atol(argv[3]);
  double until = atof(argv[4]);
  for (long i = 0; i <= count; ++i) {
    if (i == count / 10) before = resident();
    if (i == count) snprintf(text, sizeof text, "%ld", resident() - before), fputs(text, stdout);
    fmi3Instance m = pfmi3InstantiateCoSimulation("a", argv[2], NULL, 0, 0, 1, 1, NULL, 0, NULL, hear, NULL);
    NEED(m && pfmi3DoStep(m, 0, 1, 1, &event, &ended, &early, &reached) == fmi3Error);
    NEED(pfmi3DoStep(m, 0, 1, 1, NULL, NULL, NULL, NULL) == fmi3Error && pfmi3GetFloat64(m, &none, 1, value, 1) == fmi3Error);
    NEED(!pfmi3EnterInitializationMode(m, 0, 0, 0, 0, 0) && !pfmi3ExitInitializationMode(m) && !pfmi3EnterStepMode(m));
    NEED(pfmi3GetFloat64(m, &first, 1, value, 2) == fmi3Error && pfmi3GetFloat64(m, NULL, 1, value, 1) == fmi3Error);
    for (double t = 0.0; t < (i == count ? until : 1.0); t = reached) {
      NEED(!pfmi3DoStep(m, t, (i == count ? until : 1.0) - t, 1, &event, &ended, &early, &reached) && reached > t);
      if (!event) continue;
      if (i == count) snprintf(text, sizeof text, " %.17g", reached), fputs(text, stdout);
      NEED(!pfmi3EnterEventMode(m) && !pfmi3UpdateDiscreteStates(m, &a, &b, &c, &d, &e, &next) && !a && !pfmi3EnterStepMode(m));
    }
    NEED(!pfmi3GetFloat64(m, &first, 1, value, 3));
    pfmi3FreeInstance(m);
  }
  pfmi3FreeInstance(NULL);
  fputs("\n", stdout);
  return 0;
}
