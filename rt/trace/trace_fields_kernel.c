/* trace_fields_kernel: the tracing of scenes that are fields alone, under points and suns. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_FIELDS
#define FV_TRACE_SAMPLES fv_trace_fields
#include "rt/trace/trace_kernel.c"
