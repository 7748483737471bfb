/* tracer: Embree's device and scene over our arrays. Opaque and masked triangles are two
 * geometries, so that opaque ones never pay for the alpha test. */
#include "rt/trace/tracer.h"

#include "rt/fovea/foveal.h"
#include "rt/trace/alpha.h"

#include <stdio.h>
#include <string.h>

static void on_error(void *context, enum RTCError code, const char *text)
{
    (void)code;
    if (text) snprintf(context, 200, "%s", text);
}

/* Adds up what Embree takes and gives back; never objects. */
static bool count_bytes(void *counter, ssize_t bytes, bool post)
{
    (void)post;
    *(int64_t *)counter += bytes;
    return true;
}

/* Geometry of the triangles [first, first + count), nothing where count is 0. */
static void attach(const struct fv_tracer *t, unsigned id, int64_t first, int64_t count)
{
    const struct fv_scene *s = t->data;
    if (count == 0) return;
    RTCGeometry g = rtcNewGeometry(t->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0, 12,
                               (size_t)s->vertices);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->index, (size_t)first * 12, 12,
                               (size_t)count);
    if (id == FV_GEOMETRY_MASKED) {
        rtcSetGeometryUserData(g, (void *)s);
        rtcSetGeometryIntersectFilterFunction(g, fv_alpha_test);
        rtcSetGeometryOccludedFilterFunction(g, fv_alpha_test);
    }
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(t->scene, g, id);
    rtcReleaseGeometry(g);
}

static enum fv_isa wanted_isa(const char *word)
{
    enum fv_isa best = fv_cpu_isa();
    enum fv_isa wanted = strcmp(word, "base") == 0   ? FV_ISA_BASE
                         : strcmp(word, "avx2") == 0 ? FV_ISA_AVX2
                                                     : FV_ISA_AVX512;
    return wanted < best ? wanted : best;
}

int fv_tracer_open(struct fv_tracer *t, const struct fv_scene *scene, const struct fv_config *config,
                   struct fv_error *error)
{
    static char message[200]; /* outlive the call: Embree keeps the pointers */
    static int64_t bytes;
    char settings[64];
    *t = (struct fv_tracer){.data = scene,
                            .noise = scene->features & FV_SCENE_AREA_LIGHTS ? fv_noise() : NULL,
                            .depth = (int)config->method_depth,
                            .area_spp = (int)config->method_area_spp,
                            .isa = wanted_isa(config->threads_isa)};
    message[0] = 0;
    snprintf(settings, sizeof settings, "threads=1,set_affinity=0,isa=%s",
             t->isa == FV_ISA_BASE ? "sse4.2" : fv_cpu_isa_name(t->isa));
#ifndef __x86_64__
    snprintf(settings, sizeof settings, "threads=1,set_affinity=0");
#endif
    t->device = rtcNewDevice(settings);
    if (!t->device) return fv_error_set(error, "Embree gives no device (error %d); it needs SSE4.2 or NEON", rtcGetDeviceError(NULL));
    rtcSetDeviceErrorFunction(t->device, on_error, message);
    bytes = 0;
    rtcSetDeviceMemoryMonitorFunction(t->device, count_bytes, &bytes);
    t->scene = rtcNewScene(t->device);
    rtcSetSceneBuildQuality(t->scene, RTC_BUILD_QUALITY_MEDIUM);
    attach(t, FV_GEOMETRY_OPAQUE, 0, scene->opaque_triangles);
    attach(t, FV_GEOMETRY_MASKED, scene->opaque_triangles, scene->triangles - scene->opaque_triangles);
    rtcCommitScene(t->scene);
    t->bytes = bytes;
    if (message[0]) return fv_error_set(error, "Embree: %s", message);
    return 0;
}

void fv_tracer_close(struct fv_tracer *t)
{
    rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
}
