/* The library of the python flavour that hosts load; pythonfmu's own library lies beside it. It passes calls on and adds: statuses of the slave,
 * any path, a check of the GUID, messages without logging, and the functions that pythonfmu lacks, which go to the model. */
#if !defined _WIN32 && !defined _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

#include "pythonfmu/library_search.c"
#include "pythonfmu/slave_calls.c"
