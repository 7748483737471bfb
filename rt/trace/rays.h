/* rays: the kinds of rays that are counted. */
#ifndef FV_TRACE_RAYS_H
#define FV_TRACE_RAYS_H

enum fv_ray_kind { FV_RAY_PRIMARY, FV_RAY_SHADOW, FV_RAY_SECONDARY, FV_RAY_MARCH_STEPS, FV_RAY_KINDS };

#endif
