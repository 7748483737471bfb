/* trace_all_kernel: the tracing of scenes in which nothing moves. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_ALL
#define FV_TRACE_SAMPLES fv_trace_all
#include "rt/trace/trace_kernel.c"
