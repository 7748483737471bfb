/* trace_moving_kernel: the tracing of all that triangles can be: of scenes without fields, where something
 * moves. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_MOVING
#define FV_TRACE_SAMPLES fv_trace_moving
#include "rt/trace/trace_kernel.c"
