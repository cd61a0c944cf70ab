/* The library that hosts load from an FMU of the python flavour. The library passes calls on to pythonfmu's library, which is in
 * the same folder. In addition, it returns the statuses of the slave, accepts any path, checks the GUID, and sends messages even
 * when logging is off. Calls of functions that pythonfmu lacks go directly to the model. */
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
