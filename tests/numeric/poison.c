/* poison: NaN, infinities, huge numbers and denormals put into one pixel, node, sample, material, vertex,
 * texture coordinate, texel, light or sensor reading. What was there for one frame is gone in the next; what
 * stays, stays where it is: nothing spreads, no depth is ever anything but a depth. Methods full and
 * reproject, on every instruction set that this machine has. Two loops render the same frames, one of them
 * poisoned. */
#include "tests/support/shown.h"
#include "tests/support/small_scene.h"

#include "rt/frame/loop.h"
#include "rt/pass/cache.h"
#include "rt/scene/texture.h"

#include <float.h>

enum { WIDTH = 112, HEIGHT = 96, FIRST = 3, FRAMES = 10 }; /* the poison comes in frame FIRST */

static const uint32_t odd_bits[] = {0x7fc00000, 0xffc00000, 0x7f800001, 0x7f800000, 0xff800000, 0x7f7fffff,
                                    0xff7fffff, 0x00000001, 0x80000001, 0x80000000, 0xbf800000, 0xffffffff, 0xff00ff00, 0xfeffff00, 0xfffeff00, 0x0000ff00};
enum { ODD = sizeof odd_bits / sizeof *odd_bits };

struct rig {
    struct small_scene s;
    struct fv_workers workers;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

enum { WALL, FLOOR, MIRROR, SPARK, LEAF, MATERIALS };

static struct rig clean, poisoned;

/* A wall with a smooth picture, a floor, a mirror, a masked leaf and a spark of a few pixels, in that order.
 */
static void collect(struct small_scene *s, int workless)
{
    static uint8_t smooth[64 * 64 * 3], holes[16 * 16];
    for (int i = 0; i < 64 * 64; i++)
        for (int c = 0; c < 3; c++)
            smooth[3 * i + c] =
                (uint8_t)(128 + 40 * sin(2 * M_PI * (i % 64) / 64 + c) * cos(2 * M_PI * (i / 64) / 64));
    for (int i = 0; i < 256; i++) holes[i] = i % 16 < 8 ? 255 : 0;
    struct fv_material m[MATERIALS];
    for (int i = 0; i < MATERIALS; i++) m[i] = fv_material_default();
    m[WALL].base_texture = fv_build_texture(s->build, FV_TEXEL_COLOUR, smooth, 64, 64, 3, 0);
    m[LEAF].alpha_texture = fv_build_texture(s->build, FV_TEXEL_ALPHA, holes, 16, 16, 1, 0.5f);
    for (int c = 0; c < 3; c++)
        m[MIRROR].diffuse[c] = 0, m[MIRROR].mirror[c] = 0.8f, m[SPARK].emission[c] = 0.2f;
    static const double plates[MATERIALS][9] = {{-6, -5, -4, 12, 0, 0, 0, 10, 0},
                                                {-6, -1.5, 2, 12, 0, 0, 0, 0, -6},
                                                {-3, -1, -3, 1, 0, -0.5, 0, 2, 0},
                                                {1.20, 0.9, -3, 0.1, 0, 0, 0, 0.1, 0},
                                                {0.5, -1.4, -2.5, 0.8, 0, 0, 0, 0.8, 0}};
    for (int i = 0; i < MATERIALS; i++) {
        int material = fv_build_material(s->build, &m[i]);
        if (i != workless)
            small_plate(s, plates[i], plates[i] + 3, plates[i] + 6, i == SPARK ? 1 : 4, material);
    }
}

static void open_tracer(struct rig *r, int isa)
{
    struct fv_error error;
    static const char *const names[] = {"base", "avx2", "avx512"};
    snprintf(r->s.config.threads_isa, sizeof r->s.config.threads_isa, "%s", names[isa]);
    if (fv_tracer_open(&r->s.tracer, &r->s.scene, &r->s.config, &error)) fail_msg("%s", error.text);
}

static void open_loop(struct rig *r, const char *method)
{
    struct fv_frame *f = &r->loop.frame;
    fv_workers_start(&r->workers, 1);
    fv_frame_size(f, &r->s.config);
    fv_plan_make(&r->plan, fv_method_find(method), &r->s.scene, &r->s.config, f);
    fv_loop_open(&r->loop, &r->s.config, &r->plan, &r->s.tracer, &r->workers, &r->session, 1);
}

/* `without`: a plate to leave out, or -1. The tracer is left to open, so that the scene can be poisoned
 * before. */
static void build_rig(struct rig *r, int without)
{
    struct fv_error error;
    memset(r, 0, sizeof *r);
    small_begin(&r->s);
    struct fv_config *c = &r->s.config;
    c->display_eyes = 1, c->display_width = WIDTH, c->display_height = HEIGHT, c->method_spp = 2,
    c->method_area_spp = 1;
    collect(&r->s, without);
    if (fv_build_finish(r->s.build, &r->s.scene, &error)) fail_msg("%s", error.text);
    struct fv_scene *scene = &r->s.scene;
    scene->exposure = 1;
    for (int i = 0; i < 3; i++) scene->ambient[i] = 0.3f, scene->sky[i] = 0.5f;
    scene->lights = 2;
    scene->features |= FV_SCENE_POINT_LIGHTS | FV_SCENE_AREA_LIGHTS;
    scene->light[0] = (struct fv_light){.kind = FV_LIGHT_POINT, .position = {1, 2, 0}, .colour = {9, 9, 9}};
    scene->light[1] = (struct fv_light){
        .kind = FV_LIGHT_AREA, .position = {-1, 2, -1}, .u = {1, 0, 0}, .v = {0, 0, 1}, .colour = {2, 2, 2}};
}

static void close_rig(struct rig *r)
{
    fv_workers_stop(&r->workers);
    fv_tracer_close(&r->s.tracer);
}

static struct fv_pose pose_at(int frame)
{
    struct fv_pose p = {{0.004 * frame, 0.001 * frame, -0.003 * frame}, {1, 0, 0, 0}};
    fv_quat_from_yaw_pitch_roll(0.004 * frame, -0.002 * frame, 0, p.rotation);
    return p;
}

static const double straight[2][3] = {{0.1, -0.05, -0.99}, {0.1, -0.05, -0.99}};

static void render(struct rig *r, int frame)
{
    struct fv_frame_record record;
    struct fv_pose p = pose_at(frame);
    fv_loop_frame(&r->loop, &p, straight, 0.3, 0, &record);
}

struct difference {
    int pixels, largest; /* pixels that differ at all; the largest difference of a channel, of 1023 */
    int darkest; /* channel of the poisoned picture's where they differ */
    int64_t sum, squares;
};

/* Every depth that a raster keeps of the picture is one. */
static void check_depths(const struct fv_frame *f, int density)
{
    const struct fv_raster *r = &f->raster[density][0];
    for (int y = 0; y < r->height && r->cache; y++)
        for (int x = 0; x < r->width; x++) {
            uint32_t cache = r->cache[y * r->stride + x], bits = cache >> 1 & 0x7fff8000;
            float w;
            memcpy(&w, &bits, 4);
            if (cache < FV_CACHE_NONE && !(w >= 0 && w <= FV_INVERSE_DEPTH_MAX))
                fail_msg("cache %08x at %d %d, density %d", cache, x, y, density);
        }
}

/* Of the newest frames. */
static struct difference compare(void)
{
    struct difference d = {.darkest = 1023};
    const struct fv_frame *a = &clean.loop.frame, *b = &poisoned.loop.frame;
    for (int i = 0; i < FV_DENSITIES; i++) check_depths(b, i);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            uint32_t ca = shown_pixel(a, 0, x, y), cb = shown_pixel(b, 0, x, y);
            int most = 0;
            for (int shift = 0; shift < 30; shift += 10) {
                int is = (int)(cb >> shift & 1023), by = abs((int)(ca >> shift & 1023) - is);
                most = by > most ? by : most;
                if (by && is < d.darkest) d.darkest = is;
                d.sum += by;
                d.squares += by * by;
            }
            d.pixels += most > 0;
            d.largest = most > d.largest ? most : d.largest;
        }
    return d;
}

/* Where a value is put, between passes: buffer, element, bits. */
static struct {
    enum fv_buffer buffer;
    int64_t at;
    uint32_t bits;
} poison;

static int put_poison(struct fv_frame *f, const struct fv_tile *tile)
{
    if (tile->index == 0) memcpy((uint32_t *)f->buffer[poison.buffer][0] + poison.at, &poison.bits, 4);
    return 1;
}

static const struct fv_pass poison_pass = {.name = "poison", .run = put_poison};

/* Renders the frame with the poison put in before pass `before`. */
static void render_poisoned(struct rig *r, int frame, int before)
{
    struct fv_plan usual = r->plan;
    for (int i = r->plan.passes++; i > before; i--) r->plan.pass[i] = r->plan.pass[i - 1];
    r->plan.pass[before] = &poison_pass;
    render(r, frame);
    r->plan = usual;
}

/* What one poisoned value may cost: in its frame it shows in the pixels around it; from the next frame on
 * they look like their surroundings (at most 24 of 1023 off, where the support image stood in for lost
 * history). */
enum { PIXELS_MAX = 100, TRACE_MAX = 24 };

static void check_gone(const char *what, uint32_t bits, int frame, bool any, const struct difference *d)
{
    if (d->pixels <= PIXELS_MAX && (any || d->largest <= TRACE_MAX)) return;
    fail_msg("%s %08x: in frame %d %d pixels differ, by up to %d", what, bits, frame, d->pixels, d->largest);
}

static void both_open(int isa, const char *method)
{
    build_rig(&clean, -1);
    build_rig(&poisoned, -1);
    open_tracer(&clean, isa);
    open_tracer(&poisoned, isa);
    open_loop(&clean, method);
    open_loop(&poisoned, method);
}

static void both_close(void)
{
    close_rig(&clean);
    close_rig(&poisoned);
}

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

/* All values on the widest instruction set, a third of them on each of the others. */
#define FOR_EACH_ODD(k, n)                                                                                   \
    for (int k = isa == (int)fv_cpu_isa() ? 0 : isa; k < (n); k += isa == (int)fv_cpu_isa() ? 1 : 3)

/* The whole picture fine, or its outer tiles of that density. */
static void restart_both(int density)
{
    struct rig *const rigs[] = {&clean, &poisoned};
    for (int i = 0; i < 2; i++) {
        struct fv_config *c = &rigs[i]->s.config;
        fv_loop_restart(&rigs[i]->loop);
        for (int d = FV_COARSE; d < FV_DENSITIES; d++) rigs[i]->loop.frame.density_deg[d] = d <= density ? 0 : 181;
        c->fovea_inner_deg = density ? 2 : 10, c->fovea_outer_deg = density ? 3 : 20;
    }
}

/* Elements in a row of a buffer. */
static int64_t row_of(const struct fv_frame *f, enum fv_buffer buffer)
{
    return buffer == FV_SUPPORT_DEPTH                                             ? f->stride / f->spacing
           : buffer == FV_COARSE_CACHE || buffer == FV_COARSE_HISTORY_CACHE     ? f->stride / 2
           : buffer == FV_COARSEST_CACHE || buffer == FV_COARSEST_HISTORY_CACHE ? f->stride / 4
                                                                                  : f->stride;
}

enum shows { NEVER, MAY, MUST };

/* select, support, reproject, sample: the order of the method's passes. */
static const struct place {
    const char *what;
    int density; /* of the outer tiles */
    enum fv_buffer buffer;
    int before, x, y;
    bool rough; /* surroundings that the support image cannot tell, or new to the view */
    enum shows shows;
} places[] = {{"history", FV_FINE, FV_HISTORY_CACHE, 0, 91, 23, false, MUST},
              {"history, fovea", FV_FINE, FV_HISTORY_CACHE, 0, 61, 50, false, MUST},
              {"history, corner", FV_FINE, FV_HISTORY_CACHE, 0, 0, 0, true, MAY},
              {"history, near the corner", FV_FINE, FV_HISTORY_CACHE, 0, 5, 5, true, MUST},
              {"history, mirror", FV_FINE, FV_HISTORY_CACHE, 0, 24, 52, true, MUST},
              {"support depth", FV_FINE, FV_SUPPORT_DEPTH, 2, 11, 3, false, MUST},
              {"support depth, fovea", FV_FINE, FV_SUPPORT_DEPTH, 2, 7, 6, false, MAY},
              {"support depth, corner", FV_FINE, FV_SUPPORT_DEPTH, 2, 0, 0, true, MUST},
              {"cache", FV_FINE, FV_CACHE, 3, 91, 23, false, MUST},
              {"cache, last row", FV_FINE, FV_CACHE, 3, WIDTH - 9, HEIGHT - 1, true, MUST},
              {"cache, last column", FV_FINE, FV_CACHE, 3, WIDTH - 1, 40, true, MUST},
              {"cache, last pixel", FV_FINE, FV_CACHE, 3, WIDTH - 1, HEIGHT - 1, true, MAY},
              {"coarse history", FV_COARSE, FV_COARSE_HISTORY_CACHE, 0, 50, 11, false, MUST},
              {"coarse history, corner", FV_COARSE, FV_COARSE_HISTORY_CACHE, 0, 0, 0, true, MAY},
              {"coarse support depth", FV_COARSE, FV_SUPPORT_DEPTH, 2, 12, 2, false, MUST},
              {"coarse cache", FV_COARSE, FV_COARSE_CACHE, 3, 50, 11, false, MUST},
              {"coarse cache, last row", FV_COARSE, FV_COARSE_CACHE, 3, WIDTH / 2 - 5, HEIGHT / 2 - 1, true, MUST},
              {"coarsest history", FV_COARSEST, FV_COARSEST_HISTORY_CACHE, 0, 25, 5, false, MUST},
              {"coarsest history, corner", FV_COARSEST, FV_COARSEST_HISTORY_CACHE, 0, 0, 0, true, MAY},
              {"coarsest support depth", FV_COARSEST, FV_SUPPORT_DEPTH, 2, 12, 2, false, MUST},
              {"coarsest cache", FV_COARSEST, FV_COARSEST_CACHE, 3, 27, 2, false, MUST},
              {"coarse history of a coarsest tile", FV_COARSEST, FV_COARSE_HISTORY_COLOUR, 0, 50, 11, false, NEVER},
              {"fine history of a coarse tile", FV_COARSE, FV_HISTORY_COLOUR, 0, 100, 22, false, NEVER},
              {"the same, beside a fine tile", FV_COARSE, FV_COLOUR, 2, 96, 22, false, NEVER},
              {"the same, within its filter's reach", FV_COARSE, FV_COLOUR, 2, 97, 22, false, NEVER},
              {"the same, above a fine tile", FV_COARSE, FV_COLOUR, 2, 100, 31, false, NEVER}};
enum { PLACES = sizeof places / sizeof *places };

/* Returns whether the poison showed. */
static bool put_into(const struct place *p, uint32_t bits)
{
    bool shows = false;
    poison.buffer = p->buffer;
    poison.at = p->y * row_of(&poisoned.loop.frame, p->buffer) + p->x;
    poison.bits = bits;
    restart_both(p->density);
    for (int n = 0; n < FIRST + 3; n++) {
        render(&clean, n);
        if (n == FIRST) render_poisoned(&poisoned, n, p->before);
        else render(&poisoned, n);
        /* What is put in after all passes that could refuse it is there until the next frame. */
        if (n == FIRST && p->before == 3) continue;
        struct difference d = compare();
        shows |= d.pixels > 0;
        if (n < FIRST) assert_int_equal(d.pixels, 0);
        else check_gone(p->what, bits, n, n == FIRST || p->rough, &d);
    }
    return shows;
}

static void buffers(void **state)
{
    (void)state;
    FOR_EACH_ISA
    {
        both_open(isa, "reproject");
        for (int p = 0; p < PLACES; p++) {
            bool shows = false;
            FOR_EACH_ODD(k, ODD)
            shows |= put_into(&places[p], odd_bits[k]);
            if (places[p].shows == (shows ? NEVER : MUST))
                fail_msg("%s: the poison %s", places[p].what, shows ? "shows" : "did not arrive");
        }
        both_close();
    }
}

/* A pixel's flags, whatever they are, do not outlive its frame; a wrong colour is one that the lamp could
 * have made: it fades where it is. */
static void colours(void **state)
{
    (void)state;
    FOR_EACH_ISA
    {
        both_open(isa, "reproject");
        for (uint32_t flags = 0; flags < 4; flags++)
            for (int wrong = 0; wrong < 3; wrong++) {
                int64_t before = 0;
                restart_both(false);
                for (int n = 0; n < FRAMES; n++) {
                    const uint32_t *last = clean.loop.frame.buffer[FV_COLOUR][0];
                    poison.buffer = FV_HISTORY_COLOUR;
                    poison.at = 23 * clean.loop.frame.stride + 91;
                    poison.bits = (wrong == 0   ? last[poison.at] & 0x3fffffff
                                   : wrong == 1 ? 0
                                                : 0x3fffffff) |
                                  flags << 30;
                    render(&clean, n);
                    if (n == FIRST) render_poisoned(&poisoned, n, 0);
                    else render(&poisoned, n);
                    struct difference d = compare();
                    if (n < FIRST || wrong == 0) assert_int_equal(d.pixels, 0);
                    if (n == FIRST) assert_true(d.pixels <= 16); /* as many as the cubic filter reaches */
                    if (n > FIRST && d.squares > before + before / 20 + 3 * d.pixels)
                        fail_msg("colour: squares of %lld, then %lld", (long long)before, (long long)d.squares);
                    before = d.squares;
                }
            }
        both_close();
    }
}

/* A material that for one frame holds what none can: one in which the spark's block is sampled. */
enum { SPARKLES = 2 };
static void materials(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) FOR_EACH_ISA
        {
            both_open(isa, method ? "reproject" : "full");
            struct fv_material *m = (struct fv_material *)poisoned.s.scene.material;
            float *const fields[] = {&m[SPARK].emission[1], &m[SPARK].diffuse[0], &m[SPARK].diffuse[2]};
            m[SPARK].flags |= FV_MATERIAL_EMISSIVE;
            for (int i = 0; i < 3; i++) FOR_EACH_ODD(k, 7)
                {
                    float usual = *fields[i];
                    fv_loop_restart(&clean.loop);
                    fv_loop_restart(&poisoned.loop);
                    for (int n = 0; n < FIRST + 3; n++) {
                        if (n == SPARKLES) memcpy(fields[i], &odd_bits[k], 4);
                        render(&clean, n);
                        render(&poisoned, n);
                        *fields[i] = usual;
                        struct difference d = compare();
                        if (n < SPARKLES || (n > SPARKLES && !method)) assert_int_equal(d.pixels, 0);
                        else check_gone(i ? "diffuse" : "emission", odd_bits[k], n, true, &d);
                        if (k >= 5) continue;
                        /* No numbers: the sample is lost; the wall, nowhere below 250, stays as it was. */
                        if (n == SPARKLES) assert_true(d.pixels > 0);
                        if (method && d.darkest < 200)
                            fail_msg("%08x: in frame %d a pixel of %d", odd_bits[k], n, d.darkest);
                    }
                }
            both_close();
        }
}

/* Heads and gazes that are none: the head stays where it was, the gaze counts as straight ahead, and the
 * frame after is as good as ever. */
static void readings(void **state)
{
    (void)state;
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e38, 4e-320};
    FOR_EACH_ISA
    {
        both_open(isa, "reproject");
        for (int field = 0; field < 14; field++) FOR_EACH_ODD(k, 7)
            {
                fv_loop_restart(&clean.loop);
                fv_loop_restart(&poisoned.loop);
                for (int n = 0; n < FIRST + 4; n++) {
                    struct fv_frame_record record;
                    struct fv_pose p = pose_at(n);
                    double gaze[2][3], uncertainty = 0.3;
                    memcpy(gaze, straight, sizeof gaze);
                    double *const fields[] = {p.position_m,   p.position_m + 1, p.position_m + 2, p.rotation,
                                              p.rotation + 1, p.rotation + 2,   p.rotation + 3,   gaze[0],
                                              gaze[0] + 1,    gaze[0] + 2,      gaze[1],          gaze[1] + 1,
                                              gaze[1] + 2,    &uncertainty};
                    if (n == FIRST) *fields[field] = odd[k];
                    fv_loop_frame(&poisoned.loop, &p, gaze, uncertainty, 0, &record);
                    render(&clean, n);
                    struct difference d = compare();
                    if (n < FIRST) assert_int_equal(d.pixels, 0);
                    assert_true(isfinite(record.gaze_px[0][0]) && isfinite(record.gaze_px[0][1]));
                    /* Both resample the view after a step: a mean of 1 % a channel apart at most. */
                    if (n > FIRST && d.sum > 10 * 3 * WIDTH * HEIGHT)
                        fail_msg("reading %d, %g: a mean of %.1f apart", field, odd[k],
                                 (double)d.sum / (3 * WIDTH * HEIGHT));
                }
            }
        both_close();
    }
}

enum { SPOILT = 5 };
static int64_t of_full[FV_ISA_COUNT][ODD][SPOILT][FRAMES];

/* Poison that stays: with history, the picture differs in sum as much as it does without (full: `sums` is
 * written), give or take half; what is spoilt does not spread from frame to frame. */
static void stays_where_it_is(const char *what, uint32_t bits, bool full, int64_t sums[FRAMES])
{
    for (int n = 0; n < FRAMES; n++) {
        render(&clean, n);
        render(&poisoned, n);
        struct difference d = compare();
        if (full) sums[n] = d.sum;
        else if (d.sum > sums[n] + sums[n] / 2 + 2000)
            fail_msg("%s %08x: after %d frames %lld differs, %lld without history", what, bits, n,
                     (long long)d.sum, (long long)sums[n]);
    }
}

static void coordinates_and_texels(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) FOR_EACH_ISA
        {
            both_open(isa, method ? "reproject" : "full");
            struct fv_scene *s = &poisoned.s.scene;
            struct fv_triangle *t = (struct fv_triangle *)s->triangle;
            const struct fv_texture *picture = &s->texture[s->material[WALL].base_texture],
                                    *holes = &s->texture[s->material[LEAF].alpha_texture];
            uint32_t *texel = (uint32_t *)s->texel;
            FOR_EACH_ODD(k, ODD)
            {
                uint32_t *const spoilt[] = {(uint32_t *)&t[9].uv[1][0], (uint32_t *)&t[9].uv_per_metre,
                                            (uint32_t *)&t[s->opaque_triangles + 9].uv[0][0],
                                            texel + picture->offset[0] + 65 * 40 + 40,
                                            texel + holes->offset[0] + 17 * 8 + 5};
                static const char *const names[] = {"uv", "texels a metre", "masked uv", "texel",
                                                    "masked texel"};
                for (int p = 0; p < SPOILT; p++) {
                    uint32_t usual = *spoilt[p];
                    fv_loop_restart(&clean.loop);
                    fv_loop_restart(&poisoned.loop);
                    *spoilt[p] = odd_bits[k];
                    stays_where_it_is(names[p], odd_bits[k], !method, of_full[isa][k][p]);
                    *spoilt[p] = usual;
                }
            }
            both_close();
        }
}

/* A vertex that is nowhere: to the bit the picture without its triangles. */
static void vertices(void **state)
{
    (void)state;
    FOR_EACH_ISA
    FOR_EACH_ODD(k, 7)
    {
        build_rig(&clean, SPARK);
        build_rig(&poisoned, -1);
        const uint32_t *index = poisoned.s.scene.index;
        const struct fv_triangle *t = poisoned.s.scene.triangle;
        for (int64_t i = 0; i < poisoned.s.scene.triangles; i++)
            if (t[i].material == SPARK)
                memcpy((float *)poisoned.s.scene.position + 3 * index[3 * i] + k % 3, &odd_bits[k], 4);
        open_tracer(&clean, isa);
        open_tracer(&poisoned, isa);
        open_loop(&clean, "full");
        open_loop(&poisoned, "full");
        for (int n = 0; n < 2; n++) {
            render(&clean, n);
            render(&poisoned, n);
            struct difference d = compare();
            if (d.pixels) fail_msg("vertex %08x: %d pixels differ", odd_bits[k], d.pixels);
        }
        both_close();
    }
}

/* Where light l reaches in the first frames: the pixels that it changes, however little. */
static bool lit[2][3][HEIGHT][WIDTH];

static bool differ(int x, int y)
{
    return shown_pixel(&clean.loop.frame, 0, x, y) != shown_pixel(&poisoned.loop.frame, 0, x, y);
}

static void find_lit(int l)
{
    struct fv_light *a = &clean.s.scene.light[l], *b = &poisoned.s.scene.light[l], usual = *a;
    for (int c = 0; c < 3; c++) a->colour[c] = 0, b->colour[c] = 1e20f;
    fv_loop_restart(&clean.loop);
    fv_loop_restart(&poisoned.loop);
    for (int n = 0; n < 3; n++) {
        render(&clean, n);
        render(&poisoned, n);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) lit[l][n][y][x] = differ(x, y);
    }
    *a = *b = usual;
}

/* Frame n with odd_bits[k] as the green of light l, against none: what is hardly any changes hardly anything,
 * and nothing finite shows where the light does not reach. */
static void check_green(int l, int k, int n, bool full, const struct difference *d)
{
    bool finite = k >= 5 && k <= 10, small = k >= 7 && k <= 10; /* denormals, -0 and -1 */
    for (int y = 0; y < HEIGHT && full && finite; y++)
        for (int x = 0; x < WIDTH; x++)
            if (!lit[l][n][y][x] && differ(x, y))
                fail_msg("light %d of %08x shows at %d %d, where it does not reach", l, odd_bits[k], x, y);
    if (small && d->largest > (k == 10 ? 24 : 0))
        fail_msg("light %d of %08x: off by up to %d", l, odd_bits[k], d->largest);
}

/* A light that is nowhere, or gives no light, is none: to the bit. One that gives more than any, or less than
 * none: no depth is anything but a depth, no pixel that it does not reach changes; once it is gone, what it
 * left in the history fades, and a new beginning knows nothing of it. */
static void lights(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) FOR_EACH_ISA
        {
            both_open(isa, method ? "reproject" : "full");
            for (int l = 0; l < 2 && !method; l++) find_lit(l);
            for (int l = 0; l < 2; l++) FOR_EACH_ODD(k, ODD)
            for (int field = 0; field < 2; field++) {
                struct fv_light *a = &clean.s.scene.light[l], *b = &poisoned.s.scene.light[l], usual = *a;
                bool gone = field == 0 && k < 5; /* NaN or infinitely far */
                if (field) a->colour[1] = 0;
                else memset(a->colour, 0, sizeof a->colour);
                memcpy(field ? &b->colour[1] : &b->position[1], &odd_bits[k], 4);
                fv_loop_restart(&clean.loop);
                fv_loop_restart(&poisoned.loop);
                for (int n = 0; n < 3; n++) {
                    render(&clean, n);
                    render(&poisoned, n);
                    struct difference d = compare();
                    if (gone && d.pixels)
                        fail_msg("light %d at %08x: %d pixels differ", l, odd_bits[k], d.pixels);
                    if (field) check_green(l, k, n, !method, &d);
                }
                *a = *b = usual;
                int64_t before = INT64_MAX / 2;
                for (int n = 3; n < 7; n++) {
                    if (n == 6) fv_loop_restart(&clean.loop), fv_loop_restart(&poisoned.loop);
                    render(&clean, n);
                    render(&poisoned, n);
                    struct difference d = compare();
                    if (!method || n == 6) assert_int_equal(d.pixels, 0);
                    assert_true(d.sum <= before + 100);
                    before = d.sum;
                }
            }
            both_close();
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(buffers),
                                       cmocka_unit_test(colours),
                                       cmocka_unit_test(materials),
                                       cmocka_unit_test(readings),
                                       cmocka_unit_test(coordinates_and_texels),
                                       cmocka_unit_test(vertices),
                                       cmocka_unit_test(lights)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
