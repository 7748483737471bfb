/* rays: the kinds of rays that are counted; of what is marched through fields, the steps, and the rays that took
 * as many as they may (method.march_steps), which meet nothing. */
#ifndef FV_TRACE_RAYS_H
#define FV_TRACE_RAYS_H

enum fv_ray_kind { FV_RAY_PRIMARY, FV_RAY_SHADOW, FV_RAY_SECONDARY, FV_RAY_MARCH_STEPS, FV_RAY_MARCH_LIMITED, FV_RAY_KINDS };

#endif
