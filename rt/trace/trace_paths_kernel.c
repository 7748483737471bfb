/* trace_paths_kernel: paths (path.h) in any scene. */
#define FV_PATHS 1
#define FV_TRACE_SAMPLES fv_trace_paths
#include "rt/trace/trace_kernel.c"
