/* alpha: the test of masked texels, called by Embree inside traversal. */
#ifndef FV_TRACE_ALPHA_H
#define FV_TRACE_ALPHA_H

#include <embree3/rtcore.h>

/* Embree's geometry numbers; triangle record = primID, plus opaque_triangles for masked ones, plus the first
 * record of a moving object (instance.h). */
enum { FV_GEOMETRY_OPAQUE, FV_GEOMETRY_MASKED };

/* Rejects hits whose texel lies below the material's cutoff, at the mip level of the ray cone in
 * struct fv_ray_context. User data of the geometry: struct fv_masked. */
void fv_alpha_test(const struct RTCFilterFunctionNArguments *arguments);

#endif
