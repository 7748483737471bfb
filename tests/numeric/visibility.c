/* visibility: shadows by lights' maps against shadow rays and against what is known: they differ on few
 * pixels, each within two texels of a shadow's edge; what is too fine for a map is left to rays; and lights in
 * places where maps could break. Every instruction set that this machine has. */
#include "platform/arena.h"
#include "rt/frame/loop.h"
#include "rt/scene/path.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static struct fv_workers workers;
static struct small_scene s;
static struct fv_samples rays, maps;
static int64_t shadow_rays; /* of the newest samples by maps */
static struct fv_error error;

static void open_scene(const char *name, const char *lights, const char *moving)
{
    struct fv_config_request request = {.sets = 4, .set = {name, lights, moving, "method.area_spp=1"}};
    memset(&s, 0, sizeof s);
    if (fv_config_load(&s.config, &request, &error) || fv_scene_load(&s.scene, &s.config, &error) ||
        fv_tracer_open(&s.tracer, &s.scene, &s.config, &error))
        fail_msg("%s", error.text);
}

static void make(int side, int isa)
{
    if (s.tracer.visibility) s.tracer.visibility->side = 0;
    fv_visibility_make(&s.tracer, side, fv_kernels((enum fv_isa)isa)->map_row, &workers);
}

/* 1024 samples of the view, with shadows by rays and by maps. */
static void trace_both(const struct fv_view *view, int isa)
{
    const struct fv_kernels *k = fv_kernels_for((enum fv_isa)isa, fv_variant_for(s.scene.features));
    int64_t cast[FV_RAY_KINDS] = {0};
    small_grid(&rays, view);
    small_grid(&maps, view);
    rays.mapped = false;
    maps.mapped = true;
    k->trace(&s.tracer, view, &rays, 1, cast);
    shadow_rays = -cast[FV_RAY_SHADOW];
    k->trace(&s.tracer, view, &maps, 1, cast);
    shadow_rays += cast[FV_RAY_SHADOW];
    assert_memory_equal(rays.inverse_depth, maps.inverse_depth, sizeof rays.inverse_depth);
}

/* By maps: lighter than by rays 1, darker -1, the same 0. */
static int differs(int i)
{
    float a = rays.red[i], b = maps.red[i];
    return fabsf(a - b) <= 1e-5f * a ? 0 : b > a ? 1 : -1;
}

/* `footprint`: for alpha masks, at the way's end. */
static struct RTCRayHit first_hit(const double from[3], const double way[3], double footprint)
{
    struct fv_ray_context context = {.growth = (float)footprint};
    struct RTCRayHit r = {.ray = {.tfar = INFINITY, .mask = UINT32_MAX},
                          .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    r.ray.org_x = (float)from[0], r.ray.org_y = (float)from[1], r.ray.org_z = (float)from[2];
    r.ray.dir_x = (float)way[0], r.ray.dir_y = (float)way[1], r.ray.dir_z = (float)way[2];
    rtcInitIntersectContext(&context.embree);
    rtcIntersect1(s.tracer.scene, &context.embree, &r);
    return r;
}

/* Least and greatest way (of `to` - light, 1 is there) that rays of the light take to their first hit in
 * directions up to two texels from `to`; in `texel` a texel's width at `to`, in the same measure. */
static void look_around(const struct fv_light_map *m, const double to[3], double range[2], double *texel)
{
    double from[3], way[3], unit[2][3] = {{0}}, length = 0;
    int axis = 0;
    for (int c = 0; c < 3; c++) {
        way[c] = m->faces == 1 ? -20 * (double)m->at[c] : to[c] - (double)m->at[c];
        from[c] = to[c] - way[c];
        if (fabs(way[c]) > fabs(way[axis])) axis = c;
    }
    for (int c = 0; c < 3; c++) length += way[c] * way[c];
    length = sqrt(length);
    /* A texel sideways at `to`. */
    double width = m->faces == 1 ? fmax((double)m->texel[0], (double)m->texel[1])
                                 : fabs(way[axis]) * (double)m->texel[0];
    if (m->faces == 1)
        for (int c = 0; c < 3; c++) unit[0][c] = (double)m->across[c], unit[1][c] = (double)m->along[c];
    else unit[0][(axis + 1) % 3] = unit[1][(axis + 2) % 3] = 1;
    *texel = width / (m->faces == 1 ? length : fabs(way[axis]));
    range[0] = INFINITY, range[1] = 0;
    for (int i = 0; i < 25; i++) {
        double start[3], along[3];
        for (int c = 0; c < 3; c++) {
            double aside = width * ((i % 5 - 2) * unit[0][c] + (i / 5 - 2) * unit[1][c]);
            start[c] = from[c] + (m->faces == 1 ? aside : 0);
            along[c] = way[c] + (m->faces == 1 ? 0 : aside);
        }
        struct RTCRayHit r = first_hit(start, along, width);
        range[0] = fmin(range[0], (double)r.ray.tfar);
        range[1] = fmax(range[1], (double)r.ray.tfar);
    }
}

/* What differs lies where nearby rays of the light meet something nearer than the surface, but do not all end
 * well before it. */
static void assert_near_edge(const struct fv_view *view, int i, const struct fv_light_map *m)
{
    double eye[3], way[3], at[3], range[2], texel;
    for (int c = 0; c < 3; c++) {
        eye[c] = (double)view->origin[c];
        way[c] = (double)view->corner[c] + (double)maps.x[i] * (double)view->dx[c] +
                 (double)maps.y[i] * (double)view->dy[c];
    }
    struct RTCRayHit r = first_hit(eye, way, (double)view->pixel_size);
    for (int c = 0; c < 3; c++) at[c] = eye[c] + (double)r.ray.tfar * way[c];
    look_around(m, at, range, &texel);
    if (differs(i) < 0 ? range[0] < 1 - 1e-5 : range[1] > 1 - 9.5 * texel) return;
    fail_msg("at %g %g %g: maps are %s, rays of the light around end from %g to %g of the way, a texel is %g",
             at[0], at[1], at[2], differs(i) < 0 ? "darker" : "lighter", range[0], range[1], texel);
}

static void compare(const char *what, int side, double allowed)
{
    enum { VIEWS = 24 };
    struct fv_pose pose;
    const double ahead[3] = {0, 0, -1};
    struct fv_lens lens = {1, 1, 1, 1, 512, 512};
    int first = 0; /* the light that has a map */
    while (!fv_light_mappable(&s.scene, first)) first++;
    FOR_EACH_ISA
    {
        int hits = 0, different = 0, lighter = 0;
        make(side, isa);
        for (int v = 0; v < VIEWS; v++) {
            struct fv_view view;
            fv_path_pose(&s.config.scene_path, s.config.scene_path_seconds, (int64_t)v * 1200000000, &pose);
            fv_view_set(&view, &lens, &pose, ahead);
            trace_both(&view, isa);
            for (int i = 0; i < 1024; i++) {
                hits += rays.inverse_depth[i] > 0;
                if (!differs(i)) continue;
                different++;
                lighter += differs(i) > 0;
                assert_near_edge(&view, i, &s.tracer.visibility->map[first]);
            }
        }
        print_message("%s, %d texels, %s: %d of %d differ, %d lighter\n", what, side,
                      fv_cpu_isa_name((enum fv_isa)isa), different, hits, lighter);
        if (hits < 5000 || different > allowed * hits) fail_msg("%s: %d of %d differ", what, different, hits);
    }
    fv_tracer_close(&s.tracer);
}

static void maps_agree_with_rays(void **state)
{
    (void)state;
    open_scene("scene.name=atrium", "scene.sky=1 1 1", "scene.moving=");
    compare("atrium", 1024, 0.008);
    open_scene("scene.name=cornell", "scene.point_lights=0.5 1.5 0.6  3 3 3", "scene.moving=");
    compare("cornell, a point", 128, 0.005);
    open_scene("scene.name=cornell", "scene.sun=0.3 0.4 1  3 3 3", "scene.moving=");
    compare("cornell, a sun", 256, 0.005);
}

/* A white floor of 20 x 20 m about the origin, turned by `tilt` about z, and a lid of 2 x 2 m so high. */
static void build_floor(double tilt, double lid, const struct fv_light *light, double away)
{
    struct fv_material white = fv_material_default();
    double c = cos(tilt), d = sin(tilt);
    for (int i = 0; i < 3; i++) white.diffuse[i] = 1;
    small_begin(&s);
    int m = fv_build_material(s.build, &white);
    small_plate(&s, (double[]){away - 10 * c, -10 * d, 10}, (double[]){20 * c, 20 * d, 0},
                (double[]){0, 0, -20}, 4, m);
    if (lid > 0)
        small_plate(&s, (double[]){away - 1, lid, 1}, (double[]){2, 0, 0}, (double[]){0, 0, -2}, 1, m);
    if (fv_build_light(s.build, light, &error)) fail_msg("%s", error.text);
    small_finish(&s);
}

static struct fv_light light_at(enum fv_light_kind kind, double x, double y, double z)
{
    return (struct fv_light){.kind = kind, .position = {(float)x, (float)y, (float)z}, .colour = {9, 9, 9}};
}

/* From above, 5 m up, 90 degrees wide. */
static struct fv_view view_down(double away)
{
    const double at[3] = {away, 5, 0}, turn[4] = {sqrt(0.5), -sqrt(0.5), 0, 0};
    return small_view(at, turn, 45, 512);
}

/* However coarse the map and slanted the floor, up to where grazing begins. */
static void planes_do_not_shadow_themselves(void **state)
{
    (void)state;
    static const int sides[] = {1, 2, 7, 64, 256};
    static const double tilts[] = {0, 0.3, 0.9}, aways[] = {0, 1e4};
    for (int n = 0; n < 2 * 3 * 2; n++) {
        bool sun = n % 2;
        double tilt = tilts[n / 2 % 3], away = aways[n / 6];
        struct fv_light light =
            sun ? light_at(FV_LIGHT_SUN, -0.35, 1, 0.2) : light_at(FV_LIGHT_POINT, away - 0.7, 2.5, 0.3);
        build_floor(tilt, 0, &light, away);
        struct fv_view view = view_down(away);
        for (unsigned k = 0; k < sizeof sides / sizeof sides[0]; k++) FOR_EACH_ISA
            {
                make(sides[k], isa);
                trace_both(&view, isa);
                for (int i = 0; i < 1024; i++)
                    if (differs(i))
                        fail_msg("%s, tilt %g, %g m off, %d texels: pixel %d is %g, by rays %g",
                                 sun ? "sun" : "point", tilt, away, sides[k], i, (double)maps.red[i],
                                 (double)rays.red[i]);
            }
        fv_tracer_close(&s.tracer);
    }
}

/* The lid's shadow, whose edges are known: within a texel of them anything, elsewhere what is known. */
static void edges_are_where_they_are(void **state)
{
    (void)state;
    static const int sides[] = {32, 64, 256}; /* half a texel is less than the lid is high */
    const double lid = 0.5, high = 2;
    for (int sun = 0; sun < 2; sun++) {
        struct fv_light light = light_at(sun ? FV_LIGHT_SUN : FV_LIGHT_POINT, 0, high, 0);
        double half = sun ? 1 : high / (high - lid);
        build_floor(0, lid, &light, 0);
        for (unsigned k = 0; k < 3; k++) FOR_EACH_ISA
            {
                /* From the side, below the lid's edge. */
                const double at[3] = {0, 0.45, 3}, turn[4] = {cos(-0.1), sin(-0.1), 0, 0};
                struct fv_view view = small_view(at, turn, 40, 512);
                int dark = 0, edge = 0;
                make(sides[k], isa);
                trace_both(&view, isa);
                assert_true(shadow_rays == 0 && s.tracer.visibility->map[0].coarse <= 0);
                for (int i = 0; i < 1024; i++) {
                    const struct fv_light_map *m = &s.tracer.visibility->map[0];
                    double p[3], texel = (double)m->texel[0] * (sun ? 1 : high), nearest;
                    for (int c = 0; c < 3; c++)
                        p[c] = (double)view.origin[c] +
                               ((double)view.corner[c] + (double)maps.x[i] * (double)view.dx[c] +
                                (double)maps.y[i] * (double)view.dy[c]) /
                                   (double)maps.inverse_depth[i];
                    if (!(maps.inverse_depth[i] > 0) || fabs(p[1]) > 1e-3) continue;
                    nearest = fmax(fabs(p[0]), fabs(p[2])) - half;
                    bool lit = maps.red[i] > 0;
                    dark += !lit;
                    edge += fabs(nearest) < texel;
                    if (fabs(nearest) >= texel && lit != (nearest > 0))
                        fail_msg("%d texels: %s at %g %g, %g m from the edge, a texel is %g m", sides[k],
                                 lit ? "light" : "dark", p[0], p[2], nearest, texel);
                }
                if (dark < 20 || edge > (sides[k] < 256 ? 1000 : 200))
                    fail_msg("%d texels: %d dark, %d at the edge", sides[k], dark, edge);
            }
        fv_tracer_close(&s.tracer);
    }
}

/* White floor of 20 x 20 m, and 0.8 m above it `bars` bars across, up to 5 cm wide, in random places of 20 m. */
static void build_bars(int bars, const struct fv_light *light)
{
    struct fv_material white = fv_material_default();
    uint64_t random = 3;
    for (int c = 0; c < 3; c++) white.diffuse[c] = 1;
    small_begin(&s);
    int m = fv_build_material(s.build, &white);
    small_plate(&s, (double[]){-10, 0, 10}, (double[]){20, 0, 0}, (double[]){0, 0, -20}, 4, m);
    for (int i = 0; i < bars; i++) {
        double x = -10 + 19.9 * (i + random_between(&random, 0, 1)) / bars, wide = random_between(&random, 0.02, 0.05);
        small_plate(&s, (double[]){x, 0.8, 10}, (double[]){wide, 0, 0}, (double[]){0, 0, -20}, 1, m);
    }
    if (fv_build_light(s.build, light, &error)) fail_msg("%s", error.text);
    small_finish(&s);
}

static int count_different(const struct fv_view *view, int isa)
{
    int different = 0;
    trace_both(view, isa);
    for (int i = 0; i < 1024; i++) different += differs(i) != 0;
    return different;
}

/* A floor below bars that are thinner than texels: by its map a fifth is wrong, and the map knows. Below as many
 * as a texel shows, or a single one, it is left to the map. */
static void what_is_too_fine_is_left_to_rays(void **state)
{
    (void)state;
    static const struct {
        int bars, side;
        bool coarse;
    } rows[] = {{200, 64, true}, {200, 150, true}, {200, 100, true}, {40, 1000, false}, {1, 64, false}, {0, 64, false}};
    struct fv_view view = view_down(0);
    for (unsigned r = 0; r < 2 * sizeof rows / sizeof rows[0]; r++) {
        struct fv_light light = r % 2 ? light_at(FV_LIGHT_SUN, -0.2, 1, 0.1) : light_at(FV_LIGHT_POINT, 0.3, 3, 0.2);
        int bars = rows[r / 2].bars, side = rows[r / 2].side;
        build_bars(bars, &light);
        FOR_EACH_ISA
        {
            make(side, isa);
            const struct fv_light_map *m = &s.tracer.visibility->map[0];
            uint32_t *word = (uint32_t *)(uintptr_t)m->nearness;
            int by_both = count_different(&view, isa);
            int64_t cast = shadow_rays;
            for (int64_t i = 0; i < (int64_t)m->faces * (side + 1) * (side + 1); i++) word[i] &= ~(uint32_t)FV_NODE_COARSE;
            int by_map = count_different(&view, isa);
            print_message("%s, %d bars, %d texels, isa %d: %.2f coarse, %lld rays; of 1024 %d differ, by the map alone %d\n",
                          r % 2 ? "sun" : "point", bars, side, isa, (double)m->coarse, (long long)cast, by_both, by_map);
            assert_int_equal(shadow_rays, 0);
            if (rows[r / 2].coarse) assert_true(by_map > 60 && by_both * 20 <= by_map && cast > 500);
            else assert_true(cast == 0 && by_map < 60);
        }
        fv_tracer_close(&s.tracer);
    }
}

/* A closed room of 4 x 4 x 4 m around the origin, and a closed box in its middle. */
static void build_room(const struct fv_light *light)
{
    struct fv_material white = fv_material_default();
    static const double walls[6][3][3] = {
        {{-2, -2, 2}, {4, 0, 0}, {0, 4, 0}},  {{-2, -2, -2}, {4, 0, 0}, {0, 4, 0}},
        {{-2, -2, -2}, {0, 0, 4}, {0, 4, 0}}, {{2, -2, -2}, {0, 0, 4}, {0, 4, 0}},
        {{-2, -2, -2}, {4, 0, 0}, {0, 0, 4}}, {{-2, 2, -2}, {4, 0, 0}, {0, 0, 4}}};
    small_begin(&s);
    int m = fv_build_material(s.build, &white);
    for (int i = 0; i < 6; i++) small_plate(&s, walls[i][0], walls[i][1], walls[i][2], 2, m);
    for (int i = 0; i < 6; i++) { /* the box: the same, a tenth as large */
        double corner[3], u[3], v[3];
        for (int c = 0; c < 3; c++)
            corner[c] = walls[i][0][c] / 10, u[c] = walls[i][1][c] / 10, v[c] = walls[i][2][c] / 10;
        small_plate(&s, corner, u, v, 1, m);
    }
    if (fv_build_light(s.build, light, &error)) fail_msg("%s", error.text);
    small_finish(&s);
}

/* Inside the box, on its surface, in the corner of the bounds, on the ceiling, outside; suns from every side,
 * along walls. Seen from within the room: as by rays but for edges, and for what is too dim to be seen. */
static void lights_in_odd_places(void **state)
{
    (void)state;
    static const struct {
        enum fv_light_kind kind;
        double at[3];
        int lit; /* of the samples, by rays: 0 none, 1 some */
    } rows[] = {{FV_LIGHT_POINT, {0, 0, 0}, 0},       {FV_LIGHT_POINT, {0.2, 0, 0}, 1},
                {FV_LIGHT_POINT, {0.2, 0.2, 0.2}, 1}, {FV_LIGHT_POINT, {2, 2, 2}, 1},
                {FV_LIGHT_POINT, {0.5, 2, 0.5}, 1},   {FV_LIGHT_POINT, {0.5, 1.99999, 0.5}, 1},
                {FV_LIGHT_POINT, {0, 8, 0}, 0},       {FV_LIGHT_POINT, {1, 1, 1}, 1},
                {FV_LIGHT_SUN, {1, 0, 0}, 0},         {FV_LIGHT_SUN, {0, 1e-4, 1}, 0},
                {FV_LIGHT_SUN, {0, -1, 0}, 0}};
    const double at[3] = {-1.5, 0.7, 1.5}, turn[4] = {cos(-0.4), 0, sin(-0.4), 0};
    for (unsigned r = 0; r < sizeof rows / sizeof rows[0]; r++) {
        struct fv_light light = light_at(rows[r].kind, rows[r].at[0], rows[r].at[1], rows[r].at[2]);
        build_room(&light);
        for (int side = 1; side <= 256; side *= 256) FOR_EACH_ISA
            {
                struct fv_view view = small_view(at, turn, 45, 512);
                int lit = 0, different = 0;
                make(side, isa);
                trace_both(&view, isa);
                for (int i = 0; i < 1024; i++) {
                    assert_true(maps.red[i] >= 0 && maps.red[i] <= FV_RADIANCE_MAX);
                    lit += rays.red[i] > 0;
                    different += fabsf(maps.red[i] - rays.red[i]) > 0.01f;
                }
                if (side > 1 && different > 20) fail_msg("row %u: %d of 1024 differ", r, different);
                if (rows[r].lit != (lit > 0)) fail_msg("row %u: %d are lit", r, lit);
            }
        fv_tracer_close(&s.tracer);
    }
}

/* Fields, nothing that stands still, points far off and area lights have no map; rays then answer. */
static void lights_without_maps(void **state)
{
    (void)state;
    struct fv_light far = light_at(FV_LIGHT_POINT, 0, 1e4, 0);
    struct fv_view view = view_down(0);
    build_floor(0, 0.5, &far, 0);
    assert_false(fv_light_mappable(&s.scene, 0));
    assert_null(s.tracer.visibility);
    assert_int_equal(fv_visibility_bytes(&s.scene, 64), 0);
    make(64, 0);
    trace_both(&view, 0);
    assert_memory_equal(rays.red, maps.red, sizeof rays.red);
    fv_tracer_close(&s.tracer);
    open_scene("scene.name=primitives", "scene.sun=0.3 1 0.4  3 3 3", "scene.moving=");
    for (int i = 0; i < s.scene.lights; i++) assert_false(fv_light_mappable(&s.scene, i));
    fv_tracer_close(&s.tracer);
    open_scene("scene.name=cornell", "scene.point_lights=0 1 0.5  1 1 1",
               "scene.moving=light 1 1 1 at 0 1 1 0");
    int maps_there = 0;
    for (int i = 0; i < s.scene.lights; i++) maps_there += fv_light_mappable(&s.scene, i);
    assert_int_equal(s.scene.lights, 3);
    assert_int_equal(maps_there, 1);
    s.scene.still_triangles = 0;
    for (int i = 0; i < s.scene.lights; i++) assert_false(fv_light_mappable(&s.scene, i));
    fv_tracer_close(&s.tracer);
}

/* Rays tell of a ball that goes through the light of a point with a map; and a moving light's all come from
 * rays. */
static void what_moves_throws_shadows(void **state)
{
    (void)state;
    static const char *const moving[] = {"scene.moving=sphere 0.25 at -0.6 0.9 0.7 0 at 0.6 0.9 0.7 0 in 4",
                                         "scene.moving=light 3 3 3 at -0.5 1.5 0.6 0 at 0.5 1.5 0.6 0 in 4"};
    const double at[3] = {0, 1, 2.6}, turn[4] = {1, 0, 0, 0};
    struct fv_view view = small_view(at, turn, 30, 512);
    for (int n = 0; n < 2; n++) {
        open_scene("scene.name=cornell", n == 0 ? "scene.point_lights=0.1 1.7 0.7  3 3 3" : "scene.sky=0 0 0",
                   moving[n]);
        FOR_EACH_ISA
        {
            static float without[1024];
            make(256, isa);
            for (int k = 0; k < 5; k++) {
                struct fv_pose pose;
                int different = 0, moved = 0;
                fv_moving_pose(&s.scene.object[0].moving, (int64_t)k * 1000000000, &pose);
                fv_tracer_move(&s.tracer, &pose);
                trace_both(&view, isa);
                for (int i = 0; i < 1024; i++)
                    different += differs(i) != 0, moved += maps.red[i] != without[i];
                if (different > (n == 0 ? 5 : 0))
                    fail_msg("%s, second %d: %d differ", moving[n], k, different);
                assert_true(moved > 20);
                memcpy(without, maps.red, sizeof without);
            }
        }
        fv_tracer_close(&s.tracer);
    }
}

/* In a mirror shadows are those of rays, whatever the map says. */
static void mirrors_keep_rays(void **state)
{
    (void)state;
    struct fv_material mirror = fv_material_default(), white = mirror;
    for (int c = 0; c < 3; c++) mirror.diffuse[c] = 0, mirror.mirror[c] = 1;
    struct fv_light light = light_at(FV_LIGHT_POINT, 0, 1, -1);
    const double at[3] = {0, 0, 0}, turn[4] = {1, 0, 0, 0};
    struct fv_view view = small_view(at, turn, 40, 512);
    small_begin(&s);
    int m = fv_build_material(s.build, &mirror), w = fv_build_material(s.build, &white);
    small_plate(&s, (double[]){-9, -9, -3}, (double[]){18, 0, 0}, (double[]){0, 18, 0}, 1, m);
    small_plate(&s, (double[]){-9, -9, 3}, (double[]){18, 0, 0}, (double[]){0, 18, 0}, 1, w);
    if (fv_build_light(s.build, &light, &error)) fail_msg("%s", error.text);
    small_finish(&s);
    FOR_EACH_ISA
    {
        static float dark[6 * 4 + 1];
        make(1, isa);
        for (int i = 0; i < 25; i++) dark[i] = 1e30f;
        s.tracer.visibility->map[0].nearness = dark;
        trace_both(&view, isa);
        assert_memory_equal(rays.red, maps.red, sizeof rays.red);
        for (int i = 0; i < 1024; i++) assert_true(maps.red[i] > 0);
    }
    fv_tracer_close(&s.tracer);
}

/* A loop whose method asks makes the maps, once for all loops over a scene; the plan says of which lights, or
 * why not. */
static void plans_make_maps(void **state)
{
    (void)state;
    static struct fv_plan plan;
    static struct fv_session session;
    static struct fv_loop loop;
    static struct fv_pass pass;
    struct fv_method method = {.name = "mapping", .what = "", .pass = {&pass}, .levels = 1, .measured = 1};
    method.parameters = fv_method_find("full")->parameters;
    for (int n = 0; n < 4; n++) {
        open_scene(n == 3 ? "scene.name=primitives" : "scene.name=cornell",
                   "scene.point_lights=0.5 1.5 0.6  3 3 3", "scene.moving=");
        pass = fv_pass_sample_all;
        if (n != 0) pass.needs = FV_NEEDS_MAPS;
        s.config.selective_map = n == 1 ? 0 : 32;
        s.config.display_width = s.config.display_height = 64;
        fv_frame_size(&loop.frame, &s.config);
        fv_plan_make(&plan, &method, &s.scene, &s.config, &loop.frame);
        const struct fv_plan_row *row = plan.row;
        while (strcmp(row->what, "light maps") != 0) row++;
        assert_int_equal(row->kept, n == 2);
        assert_int_equal(plan.map_side, n == 2 ? 32 : 0);
        if (n == 2) assert_int_equal(row->bytes, 4 * (6 * 33 * 33 + 1));
        if (n == 3) assert_non_null(strstr(row->reason, "fields"));
        for (int k = 0; k < 2; k++) {
            size_t before = fv_arena_bytes(fv_arena(), "light maps");
            fv_loop_open(&loop, &s.config, &plan, &s.tracer, &workers, &session, 1);
            size_t taken = fv_arena_bytes(fv_arena(), "light maps") - before;
            assert_true(n == 2 && k == 0 ? taken >= (size_t)row->bytes && taken < (size_t)row->bytes + 128
                                         : taken == 0);
        }
        fv_tracer_close(&s.tracer);
    }
}

static int start_workers(void **state)
{
    (void)state;
    return fv_workers_start(&workers, 2) < 1;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(maps_agree_with_rays),     cmocka_unit_test(planes_do_not_shadow_themselves),
        cmocka_unit_test(edges_are_where_they_are), cmocka_unit_test(what_is_too_fine_is_left_to_rays), cmocka_unit_test(lights_in_odd_places),
        cmocka_unit_test(lights_without_maps),      cmocka_unit_test(what_moves_throws_shadows),
        cmocka_unit_test(mirrors_keep_rays),        cmocka_unit_test(plans_make_maps)};
    return cmocka_run_group_tests(tests, start_workers, NULL);
}
