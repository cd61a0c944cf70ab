/* This file includes all C files of an exported model's shell, which compile as one translation unit. Each file is
 * included after the files whose functions it calls. Exactly one of FMU_FMI2, FMU_FMI3 and FMU_ALONE (a plain C library) is
 * defined. */
#if defined FMU_FMI2
#include "fmi2Functions.h"
#endif
#if defined FMU_FMI3
#include "fmi3Functions.h"
#endif
#include "instance/model_and_instance.h"

#include "instance/value_references.c"
#include "instance/event_clocks.c"
#include "instance/host_log.c"
#include "instance/memory_block.c"
#include "instance/failure_diagnosis.c"
#include "instance/audit_warnings.c"
#include "instance/parameter_expressions.c"
#include "instance/input_extrapolation.c"
#include "instance/error_estimate.c"
#include "instance/run_start_and_changes.c"
#include "instance/model_exchange_output_row.c"
#include "instance/communication_steps.c"
#include "instance/model_exchange_values.c"
#include "instance/variable_access.c"
#include "instance/lifecycle.c"

#if defined FMU_ALONE
#include "mechanism.h"
#include "standards/c_library_functions.c"
#else
#include "instance/state_serialization.c"
#include "instance/directional_derivatives.c"
#include "instance/output_time_derivatives.c"
#include "instance/model_exchange.c"
#endif

#if defined FMU_FMI2
#include "standards/fmi2_functions.c"
#include "standards/fmi2_model_exchange.c"
#endif

#if defined FMU_FMI3
#include "instance/adjoint_derivatives.c"
#include "instance/event_lookahead.c"
#include "standards/fmi3_variables.c"
#include "standards/fmi3_error_stubs.c"
#include "standards/fmi3_functions.c"
#include "standards/fmi3_model_exchange.c"
#endif
