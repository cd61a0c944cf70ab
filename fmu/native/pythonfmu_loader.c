/* The library that hosts load from an FMU of the python flavour. It passes calls on to pythonfmu's library in the same folder, and
 * adds what that library lacks. `library_search.c`: pythonfmu decodes only "%20" in paths, fails on Linux without libpython, and on
 * Windows with paths that are not ASCII. `slave_calls.c`: pythonfmu does not check the GUID; it turns every status of a slave into OK
 * or a fatal error; without logging it hides errors; it keeps only registered variables as state, accepts any bytes as a state, and
 * lacks derivatives. Calls run in the default floating-point environment. */
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
