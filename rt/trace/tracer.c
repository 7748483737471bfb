/* tracer: Embree's device and scenes over our arrays: one of what stands still, and one of each moving object.
 * Opaque and masked triangles are two geometries, so that opaque ones never pay for the alpha test. */
#include "rt/trace/tracer.h"

#include "platform/arena.h"
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

/* Geometry of the triangles [first, first + count), nothing where count is 0. `masked`: for the alpha test. */
static void attach(const struct fv_tracer *t, RTCScene to, unsigned id, int64_t first, int64_t count,
                   struct fv_masked *masked)
{
    const struct fv_scene *s = t->data;
    if (count == 0) return;
    RTCGeometry g = rtcNewGeometry(t->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0, 12,
                               (size_t)s->vertices);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->index, (size_t)first * 12, 12,
                               (size_t)count);
    if (id == FV_GEOMETRY_MASKED) {
        *masked = (struct fv_masked){s, first};
        rtcSetGeometryUserData(g, masked);
        rtcSetGeometryIntersectFilterFunction(g, fv_alpha_test);
        rtcSetGeometryOccludedFilterFunction(g, fv_alpha_test);
    }
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(to, g, id);
    rtcReleaseGeometry(g);
}

/* A scene of the triangles [first, first + count), of which `opaque` come first. */
static RTCScene make_scene(const struct fv_tracer *t, int64_t first, int64_t count, int64_t opaque,
                           struct fv_masked *masked)
{
    RTCScene s = rtcNewScene(t->device);
    rtcSetSceneBuildQuality(s, RTC_BUILD_QUALITY_MEDIUM);
    attach(t, s, FV_GEOMETRY_OPAQUE, first, opaque, NULL);
    attach(t, s, FV_GEOMETRY_MASKED, first + opaque, count - opaque, masked);
    rtcCommitScene(s);
    return s;
}

static void make_instances(struct fv_tracer *t)
{
    const struct fv_scene *s = t->data;
    struct fv_pose pose[FV_MOVING_MAX];
    if (!(s->features & FV_SCENE_MOVING)) return;
    t->instances = s->objects;
    t->instance = fv_arena_take(fv_arena(), "moving objects", (size_t)s->objects * sizeof *t->instance, 64);
    for (int i = 0; i < s->objects; i++) {
        const struct fv_object *o = &s->object[i];
        struct fv_instance *to = &t->instance[i];
        to->first = (int32_t)o->first;
        to->opaque = (int32_t)o->opaque_triangles;
        to->scene = make_scene(t, o->first, o->triangles, o->opaque_triangles, &to->masked);
        fv_moving_pose(&o->moving, 0, &pose[i]);
    }
    fv_tracer_move(t, pose);
}

/* Lights that move need a place of their own, since scenes are read-only. */
static void take_lights(struct fv_tracer *t)
{
    const struct fv_scene *s = t->data;
    bool moving = false;
    for (int i = 0; i < s->objects; i++) moving |= s->object[i].moving.body == FV_BODY_LIGHT;
    t->light = s->light;
    if (!moving) return;
    t->moved = fv_arena_take(fv_arena(), "moving lights", sizeof s->light, 64);
    memcpy(t->moved, s->light, sizeof s->light);
    t->light = t->moved;
}

static enum fv_isa wanted_isa(const char *word)
{
    enum fv_isa best = fv_cpu_isa();
    enum fv_isa wanted = strcmp(word, "base") == 0   ? FV_ISA_BASE
                         : strcmp(word, "avx2") == 0 ? FV_ISA_AVX2
                                                     : FV_ISA_AVX512;
    return wanted < best ? wanted : best;
}

static enum fv_stepping stepping_of(const char *word)
{
    return strcmp(word, "relaxed") == 0  ? FV_STEPPING_RELAXED
           : strcmp(word, "balint") == 0 ? FV_STEPPING_BALINT
                                         : FV_STEPPING_PLAIN;
}

int fv_tracer_open(struct fv_tracer *t, const struct fv_scene *scene, const struct fv_config *config,
                   struct fv_error *error)
{
    static char message[200]; /* outlive the call: Embree keeps the pointers */
    static int64_t bytes;
    char settings[64];
    *t = (struct fv_tracer){.data = scene,
                            .noise = scene->features & FV_SCENE_STOCHASTIC ? fv_noise() : NULL,
                            .depth = (int)config->method_depth,
                            .area_spp = (int)config->method_area_spp,
                            .ao_spp = (int)config->method_ao_spp,
                            .ao_radius = (float)config->method_ao_radius,
                            .epsilon_grazing = (float)config->method_epsilon_grazing,
                            .phong = strcmp(config->denoise_specular, "phong") == 0,
                            .stepping = stepping_of(config->method_stepping),
                            .march_steps = (int)config->method_march_steps,
                            .march_far = (float)config->method_march_far,
                            .culling = strcmp(config->method_culling, "on") == 0,
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
    t->scene = make_scene(t, 0, scene->still_triangles, scene->opaque_triangles, &t->masked);
    make_instances(t);
    take_lights(t);
    t->visibility = fv_visibility_take(scene);
    t->bytes = bytes;
    if (message[0]) return fv_error_set(error, "Embree: %s", message);
    return 0;
}

void fv_tracer_move(const struct fv_tracer *t, const struct fv_pose *pose)
{
    for (int i = 0; i < t->instances; i++) {
        const struct fv_object *o = &t->data->object[i];
        struct fv_instance *to = &t->instance[i];
        double axis[3], ball[3] = {o->centre[0], o->centre[1], o->centre[2]};
        fv_quat_rotate(pose[i].rotation, ball, ball);
        for (int c = 0; c < 3; c++) {
            for (int r = 0; r < 3; r++) axis[r] = r == c;
            fv_quat_rotate(pose[i].rotation, axis, axis);
            for (int r = 0; r < 3; r++) to->turn[r][c] = (float)axis[r];
            to->at[c] = (float)pose[i].position_m[c];
            to->ball[c] = (float)(pose[i].position_m[c] + ball[c]);
        }
        to->ball[3] = o->triangles > 0 ? o->radius : -1;
    }
    for (int i = 0; i < t->data->objects; i++)
        for (int c = 0; c < 3 && t->data->object[i].light >= 0; c++)
            t->moved[t->data->object[i].light].position[c] = (float)pose[i].position_m[c];
}

void fv_tracer_close(struct fv_tracer *t)
{
    for (int i = 0; i < t->instances; i++) rtcReleaseScene(t->instance[i].scene);
    rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
}
