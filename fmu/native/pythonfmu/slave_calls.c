/* FMI 2.0 functions of the library of the python flavour. Most functions call the slave; some call the model directly. */

#define BEHIND "\x1f" /* separates the instance name and the address of the bridge in the name that the slave receives */

/* Data that loader and slave share. The slave uses the first six fields (fmu/binaries/python_flavour_slave.py.txt). */
typedef struct fmu_bridge {
  int status;       /* status of the present call, set by the slave */
  int logging;
  const char *guid; /* the GUID that the host expects */
  void *logger;     /* the logger for messages of the model and of the slave */
  void *model;      /* the instance of the model, which the slave has created */
  void *library;    /* the library of the model, which the slave has loaded */
  void *above;      /* pythonfmu's library */
  fmi2Component slave;
  fmi2CallbackFunctions host, own;
  char name[2]; /* the instance name, followed by the GUID */
} fmu_bridge;

static const char *const bridge_category[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

/* Pass a message to the host, with the instance's name and a category. */
static void bridge_log(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
  fmu_bridge *b = environment;
  (void)name;
  if (b->host.logger)
    b->host.logger(b->host.componentEnvironment, b->name, status, category && *category ? category : bridge_category[status], message);
}

/* The worse of two statuses: pythonfmu's `status` and the status of the slave. */
static fmi2Status bridge_worse(const fmu_bridge *b, fmi2Status status) { return (int)status > b->status ? status : (fmi2Status)b->status; }

/* Define a function that pythonfmu passes on to the slave. */
#define SLAVE(name, parameters, arguments) \
  BRIDGE_EXPORT fmi2Status name parameters { \
    fmu_bridge *b = c; \
    if (!b) return fmi2Error; \
    name##TYPE *f = (name##TYPE *)bridge_find(b->above, #name); \
    if (!f) return fmi2Error; \
    b->status = fmi2OK; \
    const tr_environment host = tr_enter(); \
    const fmi2Status status = f arguments; \
    tr_leave(host); \
    return bridge_worse(b, status); \
  }
/* Define a function that pythonfmu does not pass on to the slave. The function calls the model directly. */
#define MODEL(name, parameters, arguments) \
  BRIDGE_EXPORT fmi2Status name parameters { \
    fmu_bridge *b = c; \
    name##TYPE *f = b && b->model ? (name##TYPE *)bridge_find(b->library, #name) : 0; \
    return f ? f arguments : fmi2Error; \
  }
#define PLAIN(name) SLAVE(name, (fmi2Component c), (b->slave))
#define VALUES fmi2Component c, const fmi2ValueReference r[], size_t n

BRIDGE_EXPORT const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
BRIDGE_EXPORT const char *fmi2GetVersion(void) { return fmi2Version; }

BRIDGE_EXPORT void fmi2FreeInstance(fmi2Component c) {
  fmu_bridge *b = c;
  if (!b) return;
  fmi2FreeInstanceTYPE *f = (fmi2FreeInstanceTYPE *)bridge_find(b->above, "fmi2FreeInstance");
  const tr_environment host = tr_enter();
  if (b->slave && f) f(b->slave);
  tr_leave(host);
  free(b);
}

/* Load pythonfmu and create the slave. Returns the error, or NULL. */
static const char *bridge_begin(fmu_bridge *b, fmi2String resources, fmi2Boolean visible, char *text) {
  char path[PATH_MOST], name[PATH_MOST];
  if (!bridge_resources(resources, path)) return "its resources are not where the host says, nor beside its library";
  const char *why = bridge_plain(path);
  if (!why) why = bridge_load(&b->above, text);
  if (why) return why;
  if (snprintf(name, sizeof name, "%s" BEHIND "%llx", b->name, (unsigned long long)(size_t)b) >= (int)sizeof name) return "its name is too long";
  fmi2InstantiateTYPE *make = (fmi2InstantiateTYPE *)bridge_find(b->above, "fmi2Instantiate");
  b->own = (fmi2CallbackFunctions){bridge_log, calloc, free, NULL, b};
  const tr_environment host = tr_enter();
  b->slave = make ? make(name, fmi2CoSimulation, b->guid, path, &b->own, visible, b->logging) : NULL;
  tr_leave(host);
  return b->slave ? NULL : "pythonfmu could not load the slave";
}

BRIDGE_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *host,
                                      fmi2Boolean visible, fmi2Boolean logging) {
  char text[PATH_MOST] = "";
  if (!host) return NULL;
  const size_t length = name ? strlen(name) : 0, more = guid ? strlen(guid) : 0;
  fmu_bridge *b = calloc(1, sizeof *b + length + more);
  if (!b) return NULL;
  if (name) memcpy(b->name, name, length);
  if (guid) memcpy(b->name + length + 1, guid, more);
  b->host = *host, b->logging = logging != fmi2False, b->guid = b->name + length + 1, b->logger = (void *)bridge_log;
  const char *why = !length ? "the instance needs a name" : type != fmi2CoSimulation ? "this FMU is for co-simulation"
                  : bridge_begin(b, resources, visible, text);
  if (!why && b->model) return b;
  if (why) bridge_log(b, b->name, fmi2Error, NULL, why);
  if (*text) bridge_log(b, b->name, fmi2Error, NULL, text);
  fmi2FreeInstance(b);
  return NULL;
}

SLAVE(fmi2SetupExperiment, (fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real t0, fmi2Boolean sd, fmi2Real t1), (b->slave, td, tol, t0, sd, t1))
PLAIN(fmi2EnterInitializationMode)
PLAIN(fmi2ExitInitializationMode)
PLAIN(fmi2Terminate)
SLAVE(fmi2GetReal, (VALUES, fmi2Real v[]), (b->slave, r, n, v))
SLAVE(fmi2SetReal, (VALUES, const fmi2Real v[]), (b->slave, r, n, v))
SLAVE(fmi2DoStep, (fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean last), (b->slave, t, h, last))

/* The slave has no integers and no state of its own. The states of pythonfmu hold only the registered variables, and pythonfmu
 * accepts any bytes as a state. */
MODEL(fmi2GetInteger, (VALUES, fmi2Integer v[]), (b->model, r, n, v))
MODEL(fmi2SetInteger, (VALUES, const fmi2Integer v[]), (b->model, r, n, v))
MODEL(fmi2GetBoolean, (VALUES, fmi2Boolean v[]), (b->model, r, n, v))
MODEL(fmi2SetBoolean, (VALUES, const fmi2Boolean v[]), (b->model, r, n, v))
MODEL(fmi2GetString, (VALUES, fmi2String v[]), (b->model, r, n, v))
MODEL(fmi2SetString, (VALUES, const fmi2String v[]), (b->model, r, n, v))
MODEL(fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *s), (b->model, s))
MODEL(fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate s), (b->model, s))
MODEL(fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *s), (b->model, s))
MODEL(fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate s, size_t *n), (b->model, s, n))
MODEL(fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate s, fmi2Byte v[], size_t n), (b->model, s, v, n))
MODEL(fmi2DeSerializeFMUstate, (fmi2Component c, const fmi2Byte v[], size_t n, fmi2FMUstate *s), (b->model, v, n, s))
MODEL(fmi2Reset, (fmi2Component c), (b->model))

/* pythonfmu lacks these functions, or returns fmi2Error. */
MODEL(fmi2GetDirectionalDerivative, (VALUES, const fmi2ValueReference k[], size_t nk, const fmi2Real s[], fmi2Real v[]), (b->model, r, n, k, nk, s, v))
MODEL(fmi2SetRealInputDerivatives, (VALUES, const fmi2Integer o[], const fmi2Real v[]), (b->model, r, n, o, v))
MODEL(fmi2GetRealOutputDerivatives, (VALUES, const fmi2Integer o[], fmi2Real v[]), (b->model, r, n, o, v))
MODEL(fmi2GetStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Status *v), (b->model, k, v))
MODEL(fmi2GetRealStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Real *v), (b->model, k, v))
MODEL(fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Integer *v), (b->model, k, v))
MODEL(fmi2GetBooleanStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v), (b->model, k, v))
MODEL(fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind k, fmi2String *v), (b->model, k, v))

MODEL(fmi2CancelStep, (fmi2Component c), (b->model))

BRIDGE_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String category[]) {
  fmu_bridge *b = c;
  fmi2SetDebugLoggingTYPE *f = b && b->model ? (fmi2SetDebugLoggingTYPE *)bridge_find(b->library, "fmi2SetDebugLogging") : 0;
  if (b) b->logging = on != fmi2False;
  return f ? f(b->model, on, n, category) : fmi2Error;
}
