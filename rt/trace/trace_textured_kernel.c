/* trace_textured_kernel: the tracing of scenes without mirrors, glass, emission and area lights. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_TEXTURED
#define FV_TRACE_SAMPLES fv_trace_textured
#include "rt/trace/trace_kernel.c"
