/* trace_paths_textured_kernel: paths (path.h) in scenes of what trace_textured_kernel shows. */
#include "rt/trace/variant.h"

#define FV_PATHS 1
#define FV_FEATURES FV_FEATURES_TEXTURED
#define FV_TRACE_SAMPLES fv_trace_paths_textured
#include "rt/trace/trace_kernel.c"
