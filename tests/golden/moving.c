/* moving: what moves looks, and shades, and is mirrored, as the same triangles do where they stand still at the
 * same place: for textured, bent, masked, mirroring and glass bodies, on every instruction set; and samples know
 * which object they saw. */
#include "tests/support/random.h"
#include "tests/support/room.h"

enum { OBJECTS = 3, PLATES = 4 };

/* Of each object, in its own space, which lies at its origin in the scene. */
static const struct {
    double origin[3], corner[3], u[3], v[3];
    int object; /* 0: stands still */
    int material;
} plates[PLATES] = {
    {{0, 0, 0}, {-1.5, -1.5, -4.5}, {3, 0, 0}, {0, 3, 0}, 0, 0},
    {{-0.4, 0.1, -3}, {-0.4, -0.4, 0.1}, {0.8, 0, 0.1}, {0, 0.8, 0.1}, 1, 0},
    {{0.5, -0.2, -2.6}, {-0.3, -0.5, 0}, {0.6, 0, 0.2}, {0.1, 1, 0}, 2, 1},
    {{0.2, 0.6, -2.2}, {-0.25, -0.25, 0.2}, {0.5, 0, -0.2}, {0, 0.5, 0}, 3, 2},
};

/* The room's lights and materials, with the plates as objects (poses NULL) or standing at their poses. */
static void open_scene(struct small_scene *s, uint32_t features, const struct fv_pose *poses)
{
    static const struct fv_moving none[OBJECTS];
    struct fv_error error;
    int material[3];
    small_begin(s);
    s->config.method_ao_spp = features & FV_SCENE_AO ? 4 : 0;
    room_materials(s->build, features, material);
    room_lights(s->build, features);
    if (!poses) fv_build_moving(s->build, none, OBJECTS);
    for (int p = 0; p < PLATES; p++) {
        double corner[3], u[3], v[3];
        const double *rotation = poses && plates[p].object ? poses[plates[p].object - 1].rotation : NULL;
        memcpy(corner, plates[p].corner, sizeof corner);
        memcpy(u, plates[p].u, sizeof u);
        memcpy(v, plates[p].v, sizeof v);
        if (rotation) {
            fv_quat_rotate(rotation, corner, corner);
            fv_quat_rotate(rotation, u, u);
            fv_quat_rotate(rotation, v, v);
        }
        for (int i = 0; i < 3; i++)
            corner[i] += rotation ? poses[plates[p].object - 1].position_m[i] : plates[p].origin[i];
        if (!poses && plates[p].object) fv_build_object(s->build, plates[p].object, plates[p].origin, &error);
        small_plate(s, corner, u, v, 6, material[plates[p].material]);
    }
    small_finish(s);
}

static void random_poses(uint64_t *random, struct fv_pose poses[OBJECTS])
{
    for (int o = 0; o < OBJECTS; o++) {
        double axis[3];
        random_direction(random, axis);
        for (int i = 0; i < 3; i++) {
            axis[i] *= random_between(random, 0, 1.2);
            poses[o].position_m[i] = plates[o + 1].origin[i] + random_between(random, -0.2, 0.2);
        }
        fv_quat_from_vector(axis, poses[o].rotation);
    }
}

static void trace(const struct small_scene *s, int isa, struct fv_samples *samples)
{
    static const double at[3] = {0, 0, 0}, no_turn[4] = {1, 0, 0, 0};
    int64_t rays[FV_RAY_KINDS] = {0};
    struct fv_view view = small_view(at, no_turn, 35, 256);
    small_grid(samples, &view);
    fv_kernels((enum fv_isa)isa)->trace(&s->tracer, &view, samples, 3, rays);
}

static bool alike(float a, float b)
{
    return fabsf(a - b) <= 5e-3f * (fabsf(a) + fabsf(b)) + 2e-3f;
}

static void moving_is_as_standing_there(void **state)
{
    (void)state;
    static const uint32_t features[] = {
        FV_SCENE_POINT_LIGHTS,
        FV_SCENE_SUN | FV_SCENE_TEXTURES | FV_SCENE_NORMAL_MAPS | FV_SCENE_SPECULAR,
        FV_SCENE_POINT_LIGHTS | FV_SCENE_ALPHA | FV_SCENE_TEXTURES,
        FV_FEATURES_ALL,
    };
    static struct small_scene moving, standing;
    static struct fv_samples a, b;
    uint64_t random = 11;
    for (unsigned f = 0; f < sizeof features / sizeof features[0]; f++) {
        open_scene(&moving, features[f], NULL);
        assert_int_equal(moving.scene.features, features[f] | FV_SCENE_MOVING);
        int seen[OBJECTS + 1] = {0}; /* samples that saw an object, of all pictures */
        for (int n = 0; n < 6; n++) {
            struct fv_pose poses[OBJECTS];
            random_poses(&random, poses);
            open_scene(&standing, features[f], poses);
            fv_tracer_move(&moving.tracer, poses);
            for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
                int off = 0;
                trace(&moving, isa, &a);
                trace(&standing, isa, &b);
                for (int i = 0; i < a.count; i++) {
                    int object = a.surface[i] & FV_SURFACE_OBJECT;
                    off += !alike(a.red[i], b.red[i]) || !alike(a.green[i], b.green[i]) ||
                           !alike(a.inverse_depth[i], b.inverse_depth[i]);
                    assert_true(object <= OBJECTS && (b.surface[i] & FV_SURFACE_OBJECT) == 0);
                    seen[object]++;
                }
                /* Rays that pass edges of plates, texels and shadows may fall to the other side. */
                if (off > 12) fail_msg("features %u, pose %d: %d of %d samples differ", features[f], n, off, a.count);
            }
            fv_tracer_close(&standing.tracer);
        }
        for (int o = 0; o <= OBJECTS; o++)
            if (seen[o] < 50) fail_msg("features %u: object %d seen by %d samples only", features[f], o, seen[o]);
        fv_tracer_close(&moving.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(moving_is_as_standing_there)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
