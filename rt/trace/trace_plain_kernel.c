/* trace_plain_kernel: the tracing of scenes without textures, masks, highlights, mirrors, glass, emission
 * and area lights: what stays is matt surfaces under points and suns. */
#include "rt/trace/variant.h"

#define FV_FEATURES FV_FEATURES_PLAIN
#define FV_TRACE_SAMPLES fv_trace_plain
#include "rt/trace/trace_kernel.c"
