/* full_ratio: a `full` frame (1 sample, one point light, textures) against the same rays through bare
 * Embree calls, interleaved in one process on two threads. The ratio must stay below 1.35 on Sponza.
 *
 * Bare: a tile's primary packets are laid out beforehand and only the rtcIntersect16 calls are timed;
 * then its shadow packets likewise with rtcOccluded16. Both sides go through the same tiles and workers,
 * and both are thread CPU time, so that a busy machine disturbs neither. */
#include "platform/files.h"
#include "rt/frame/loop.h"
#include "rt/scene/path.h"
#include "rt/measure/rank.h"
#include "tests/support/program.h"

#include <math.h>

enum { ROUNDS = 15, PACKETS = 64 };
static const double limit = 1.35;

struct bare {
    const struct fv_frame *frame;
    const struct fv_scene *scene;
    int64_t ns[FV_WORKERS_MAX], rays[FV_WORKERS_MAX];
    struct RTCRayHit16 ray[2][PACKETS];
    struct RTCRay16 shadow[2][PACKETS];
    int valid[2][PACKETS][16];
};

static void lay_primary(const struct fv_view *v, int x0, int y0, struct RTCRayHit16 *packet, int *valid, int w, int h)
{
    memset(packet, 0, sizeof *packet);
    for (int i = 0; i < 16; i++) {
        float x = (float)(x0 + i % 4) + 0.5f, y = (float)(y0 + i / 4) + 0.5f;
        float *o[3] = {packet->ray.org_x, packet->ray.org_y, packet->ray.org_z}, *d[3] = {packet->ray.dir_x, packet->ray.dir_y, packet->ray.dir_z};
        for (int k = 0; k < 3; k++) {
            o[k][i] = v->origin[k];
            d[k][i] = v->corner[k] + x * v->dx[k] + y * v->dy[k];
        }
        packet->ray.tfar[i] = INFINITY;
        packet->ray.mask[i] = UINT32_MAX;
        packet->hit.geomID[i] = packet->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        valid[i] = x0 < w && y0 < h ? -1 : 0;
    }
}

static void lay_shadow(const struct RTCRayHit16 *p, const struct fv_light *light, struct RTCRay16 *shadow, int *valid)
{
    memset(shadow, 0, sizeof *shadow);
    for (int i = 0; i < 16; i++) {
        float n[3] = {p->hit.Ng_x[i], p->hit.Ng_y[i], p->hit.Ng_z[i]}, d[3] = {p->ray.dir_x[i], p->ray.dir_y[i], p->ray.dir_z[i]};
        float o[3] = {p->ray.org_x[i], p->ray.org_y[i], p->ray.org_z[i]}, l[3], facing = 0, towards = 0, length = 0;
        float *so[3] = {shadow->org_x, shadow->org_y, shadow->org_z}, *sd[3] = {shadow->dir_x, shadow->dir_y, shadow->dir_z};
        for (int k = 0; k < 3; k++) facing += n[k] * d[k], length += n[k] * n[k];
        for (int k = 0; k < 3; k++) {
            n[k] *= (facing > 0 ? -1 : 1) / sqrtf(length);
            so[k][i] = o[k] + p->ray.tfar[i] * d[k] + 2e-5f * n[k];
            sd[k][i] = l[k] = light->position[k] - so[k][i];
            towards += l[k] * n[k];
        }
        shadow->tfar[i] = 0.99999f;
        shadow->mask[i] = UINT32_MAX;
        if (p->hit.geomID[i] == RTC_INVALID_GEOMETRY_ID || !(towards > 0)) valid[i] = 0;
    }
}

static void bare_tile(void *context, int index, int worker)
{
    struct bare *b = context;
    const struct fv_frame *f = b->frame;
    int per_eye = f->tiles_x * f->tiles_y, eye = index / per_eye, at = index % per_eye;
    int x0 = at % f->tiles_x * FV_TILE, y0 = at / f->tiles_x * FV_TILE;
    struct RTCRayHit16 *ray = b->ray[worker];
    struct fv_ray_context c = {.growth = f->view[eye].pixel_size};
    rtcInitIntersectContext(&c.embree);
    c.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (int p = 0; p < PACKETS; p++)
        lay_primary(&f->view[eye], x0 + p % 8 * 4, y0 + p / 8 * 4, &ray[p], b->valid[worker][p], f->width, f->height);
    int64_t start_ns = fv_clock_thread_ns();
    for (int p = 0; p < PACKETS; p++)
        rtcIntersect16(b->valid[worker][p], f->tracer->scene, &c.embree, &ray[p]);
    b->ns[worker] += fv_clock_thread_ns() - start_ns;
    for (int p = 0; p < PACKETS; p++) {
        for (int i = 0; i < 16; i++) b->rays[worker] += b->valid[worker][p][i] != 0;
        lay_shadow(&ray[p], &b->scene->light[0], &b->shadow[worker][p], b->valid[worker][p]);
    }
    start_ns = fv_clock_thread_ns();
    for (int p = 0; p < PACKETS; p++)
        rtcOccluded16(b->valid[worker][p], f->tracer->scene, &c.embree, &b->shadow[worker][p]);
    b->ns[worker] += fv_clock_thread_ns() - start_ns;
    for (int p = 0; p < PACKETS; p++)
        for (int i = 0; i < 16; i++) b->rays[worker] += b->valid[worker][p][i] != 0;
}

static void open_all(struct fv_config *config, struct fv_scene *scene, struct fv_tracer *tracer,
                     struct fv_workers *workers, struct fv_loop *loop, const char *library)
{
    static struct fv_plan plan;
    static struct fv_session session;
    static char set[600];
    struct fv_error error;
    snprintf(set, sizeof set, "scene.library=%s", library);
    struct fv_config_request request = {.sets = 6, .set = {"scene.name=sponza", set, "method.name=full", "display.eyes=1",
                                                           "display.headset=rift-dk2", "display.sink=none"}};
    if (fv_config_load(config, &request, &error) || fv_scene_load(scene, config, &error) ||
        fv_tracer_open(tracer, scene, config, &error))
        fail_msg("%s", error.text);
    fv_frame_size(&loop->frame, config);
    fv_plan_make(&plan, fv_method_find("full"), scene, config, &loop->frame);
    fv_workers_start(workers, 2);
    if (fv_workers_pin(workers, &error)) print_message("workers stay unpinned: %s\n", error.text);
    fv_loop_open(loop, config, &plan, tracer, workers, &session, 1);
}

static void full_against_bare_embree(void **state)
{
    (void)state;
    static struct fv_config config;
    static struct fv_scene scene;
    static struct fv_tracer tracer;
    static struct fv_workers workers;
    static struct fv_loop loop;
    static struct bare bare;
    const char *library = FV_SOURCE_DIR "/../shared/data/scenes";
    double ratio[ROUNDS], full_ms[ROUNDS], bare_ms[ROUNDS];
    if (!fv_file_exists(library)) {
        print_message("Sponza is not in %s: skipped\n", library);
        skip();
    }
    open_all(&config, &scene, &tracer, &workers, &loop, library);
    if (tracer.isa != FV_ISA_AVX512) print_message("note: this machine has no AVX-512; bare calls are 16 wide all the same\n");
    bare.frame = &loop.frame;
    bare.scene = &scene;
    for (int round = 0; round < ROUNDS; round++) {
        struct fv_pose pose;
        struct fv_frame_record record;
        const double gaze[2][3] = {{0, 0, -1}, {0, 0, -1}};
        fv_path_pose(&config.scene_path, config.scene_path_seconds, (int64_t)round * 1200000000, &pose);
        fv_loop_frame(&loop, &pose, gaze, 0, 0, &record);
        memset(bare.ns, 0, sizeof bare.ns);
        memset(bare.rays, 0, sizeof bare.rays);
        fv_workers_run(&workers, loop.frame.tiles, bare_tile, &bare);
        full_ms[round] = (double)record.cpu_ms;
        bare_ms[round] = (double)(bare.ns[0] + bare.ns[1]) * 1e-6;
        ratio[round] = full_ms[round] / bare_ms[round];
        int64_t rays = record.rays[FV_RAY_PRIMARY] + record.rays[FV_RAY_SHADOW], bare_rays = bare.rays[0] + bare.rays[1];
        assert_true(llabs(rays - bare_rays) < bare_rays / 20); /* the same rays, but for shading normals */
    }
    fv_rank_sort(ratio, ROUNDS);
    fv_rank_sort(full_ms, ROUNDS);
    fv_rank_sort(bare_ms, ROUNDS);
    print_message("full / bare Embree on Sponza, 1182 x 1464, %d poses: median %.3f (%.3f to %.3f); CPU ms %.1f / %.1f\n",
                  ROUNDS, ratio[ROUNDS / 2], ratio[0], ratio[ROUNDS - 1], full_ms[ROUNDS / 2], bare_ms[ROUNDS / 2]);
    assert_true(ratio[ROUNDS / 2] <= limit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(full_against_bare_embree)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
