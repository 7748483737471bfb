/* trace_mirrored_kernel: the tracing of scenes without area lights. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_MIRRORED
#define FV_TRACE_SAMPLES fv_trace_mirrored
#include "rt/trace/trace_kernel.c"
