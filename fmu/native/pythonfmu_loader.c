/* The library that hosts load from an FMU of the python flavour. The library passes calls on to pythonfmu's library in the same
 * folder, and corrects faults of pythonfmu. `library_search.c` corrects paths: pythonfmu decodes only "%20", fails on Linux without
 * libpython, and fails on Windows if a path is not ASCII. `slave_calls.c` corrects calls. pythonfmu does not check the GUID, turns
 * every status of a slave into OK or a fatal error, and hides errors while logging is off. As a state, pythonfmu keeps only
 * registered variables, and accepts any bytes. pythonfmu has no derivatives. Calls run in the default floating-point
 * environment. */
#if !defined _WIN32 && !defined _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
#include "base/floating_point_environment.h"

#include "pythonfmu/library_search.c"
#include "pythonfmu/slave_calls.c"
