/* smooth: pictures smoothed over frames before: the kernels against a scalar one in double, over made-up frames, depths that
 * are not known, maps that lead anywhere and objects that move; and whole frames: the first one, still views, heads and
 * bodies that move, what is uncovered, alpha of 0 and 1, the central region's border, and rasters that turn. */
#include "rt/pass/smooth.h"
#include "rt/pass/cache.h"
#include "rt/pass/selective.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"
#include "tests/support/stage.h"

enum { WIDTH = 75, HEIGHT = 41, STRIDE = 96, PIXELS = STRIDE * HEIGHT + 64, OBJECTS = 3, STAMP = 9 };

/* Frame 0 is this one. */
static _Alignas(64) uint32_t colour[FV_PAST_MAX + 1][PIXELS], cache[FV_PAST_MAX + 1][PIXELS], identity[PIXELS], smoothed[PIXELS];
static struct fv_map map[FV_PAST_MAX][OBJECTS + 1];
static float linear_of[3][1024];

static uint32_t cache_word(uint64_t *random, double w)
{
    uint32_t pick = (uint32_t)(random_bits(random) % 16), word = cache_of_sample((float)w, 0);
    if (pick == 0) return FV_CACHE_NONE | (uint32_t)(random_bits(random) & 0xffff);
    if (pick == 1) return word & 0xffff;                    /* infinitely far */
    if (pick == 2) return word & ~0xff00u;                  /* filled from the support image */
    if (pick == 3) return word | (1 + (uint32_t)(random_bits(random) % 127)); /* not sampled in its frame */
    return word | (pick < 7 ? FV_CACHE_MOVING : 0);
}

/* Surfaces of a few depths, so that some agree with what is before. */
static void make_up(uint64_t *random)
{
    static const double depths[] = {0.2, 0.201, 0.21, 0.26, 1e-5, 1e5};
    for (int f = 0; f <= FV_PAST_MAX; f++)
        for (int i = 0; i < PIXELS; i++) {
            colour[f][i] = (uint32_t)random_bits(random);
            cache[f][i] = cache_word(random, depths[i / 5 % 7 ? 0 : random_bits(random) % 6]);
        }
    for (int i = 0; i < PIXELS; i++) identity[i] = (uint32_t)(random_bits(random) % (OBJECTS + 1)) << 16 | (uint32_t)(i % 5 ? STAMP : 3) << FV_IDENTITY_STAMP_SHIFT;
    for (int k = 0; k < FV_PAST_MAX; k++)
        for (int o = 0; o <= OBJECTS; o++) {
            struct fv_map *m = &map[k][o];
            double far = random_bits(random) % 4 ? 1 : 40;
            *m = (struct fv_map){.m = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
            for (int r = 0; r < 2; r++) m->m[r][2] = (float)random_between(random, -4 * far, 4 * far), m->m[2][r] = (float)random_between(random, -1e-3, 1e-3);
            for (int r = 0; r < 3; r++) m->t[r] = (float)random_between(random, -1, 1) * (r < 2 ? 5 : 0.3f);
            if (random_bits(random) % 16 == 0) m->m[2][2] = -1; /* behind the eye */
        }
}

static struct fv_smooth smooth_of(int pasts, int x, int y, const float *rest, const float *share, float together)
{
    struct fv_smooth s = {.row = {.count = 16, .x = x, .y = y, .width = WIDTH, .height = HEIGHT, .stride = STRIDE, .colour = colour[0] + y * STRIDE + x,
                                  .cache = cache[0] + y * STRIDE + x, .identity = identity + y * STRIDE + x, .stamp = STAMP},
                          .pasts = pasts, .rest = rest, .share = share, .smoothed = smoothed + y * STRIDE + x};
    for (int k = 0; k < pasts; k++)
        s.past[k] = (struct fv_backproject){.width = WIDTH, .height = HEIGHT, .stride = STRIDE, .epsilon = 0.03f, .together = together,
                                            .colour = colour[k + 1], .cache = cache[k + 1], .map = map[k]};
    return s;
}

/* Of codes between whole ones. */
static double decoded(double code, int c)
{
    int low = code < 1022 ? (int)code : 1022;
    return (double)linear_of[c][low] + (code - low) * ((double)linear_of[c][low + 1] - (double)linear_of[c][low]);
}

static bool near_to(double a, double b)
{
    return fabs(a - b) <= 2e-5 * (fabs(a) + fabs(b));
}

/* What frame k shows of the pixel, by how much; false where a rounding may decide. */
static bool before(const struct fv_smooth *s, int k, int x, int y, double nearest, double farthest, double mean[3], double *found)
{
    uint32_t own = cache[0][y * STRIDE + x];
    int object = own & FV_CACHE_MOVING ? identity[y * STRIDE + x] >> 16 & 31 : 0;
    const struct fv_map *m = &s->past[k].map[object];
    double w = (double)cache_depth_of(own), to[3], px = x + 0.5, py = y + 0.5, together = (double)s->past[k].together;
    mean[0] = mean[1] = mean[2] = *found = 0;
    for (int i = 0; i < 3; i++) to[i] = (double)m->m[i][0] * px + (double)m->m[i][1] * py + (double)m->m[i][2] + (double)m->t[i] * w;
    if (fabs(to[2]) < 1e-2) return false;
    if (to[2] < 0) return true;
    double u = to[0] / to[2], v = to[1] / to[2];
    if (near_to(u + 1, 1) || near_to(v + 1, 1) || near_to(u, WIDTH) || near_to(v, HEIGHT)) return false;
    if (u < 0 || v < 0 || u >= WIDTH || v >= HEIGHT) return true;
    double high = fmin(nearest, w + together) / to[2] * 1.03, low = fmax(farthest, w - together) / to[2] * 0.97;
    double fx = fmin(fmax(u - 0.5, 0), WIDTH - 1), fy = fmin(fmax(v - 0.5, 0), HEIGHT - 1);
    int x0 = (int)fx, y0 = (int)fy;
    fx -= x0, fy -= y0;
    for (int i = 0; i < 4; i++) {
        int column = x0 + (i & 1), row = y0 + (i >> 1);
        double weight = (i & 1 ? fx : 1 - fx) * (i & 2 ? fy : 1 - fy);
        if (column >= WIDTH || row >= HEIGHT) continue;
        uint32_t word = cache[k + 1][row * STRIDE + column], pixel = colour[k + 1][row * STRIDE + column];
        double depth = (double)cache_depth_of(word);
        if (word >= FV_CACHE_NONE || (word & 127) || !(word & 0xff00) || ((word ^ own) & FV_CACHE_MOVING)) continue;
        if (weight > 1e-6 && depth > 0 && (near_to(depth, high) || near_to(depth, low))) return false;
        if (depth > high || depth < low) continue;
        *found += weight;
        for (int c = 0; c < 3; c++) mean[c] += weight * (pixel >> 10 * c & 1023);
    }
    for (int c = 0; c < 3; c++) mean[c] = *found > 1e-6 ? mean[c] / *found : 0;
    return *found == 0 || *found > 1e-4;
}

static void bounds_at(int x, int y, double *nearest, double *farthest)
{
    *nearest = 0, *farthest = 1e9;
    for (int i = 0; i < 9; i++) {
        int row = y + i / 3 - 1, column = x + i % 3 - 1;
        if (row < 0 || row >= HEIGHT || column < 0 || column >= WIDTH) continue;
        uint32_t word = cache[0][row * STRIDE + column];
        if (word >= FV_CACHE_NONE) continue;
        *nearest = fmax(*nearest, (double)cache_depth_of(word));
        *farthest = fmin(*farthest, (double)cache_depth_of(word));
    }
}

/* The smoothed pixel's linear colour. */
static bool expected_at(const struct fv_smooth *s, int x, int y, double rest, double share, double linear[3])
{
    uint32_t own = colour[0][y * STRIDE + x], word = cache[0][y * STRIDE + x], of = identity[y * STRIDE + x];
    double weight = share, total = 1, nearest, farthest, mean[3], found;
    bool moving = word & FV_CACHE_MOVING, known = word < FV_CACHE_NONE;
    bounds_at(x, y, &nearest, &farthest);
    if (moving && (of >> FV_IDENTITY_STAMP_SHIFT != STAMP || !(of >> 16 & 31))) known = false;
    for (int c = 0; c < 3; c++) linear[c] = decoded(own >> 10 * c & 1023, c);
    for (int k = 0; k < s->pasts && known; k++) {
        weight *= rest;
        if (weight <= 1.0 / 256) break;
        if (!before(s, k, x, y, nearest, farthest, mean, &found)) return false;
        total += weight * found;
        for (int c = 0; c < 3; c++) linear[c] += weight * found * decoded(mean[c], c);
    }
    for (int c = 0; c < 3; c++) linear[c] /= total;
    return true;
}

static void take_codes(const struct fv_kernels *k)
{
    static _Alignas(64) uint32_t code[1024];
    for (int i = 0; i < 1024; i++) code[i] = (uint32_t)(i | i << 10 | i << 20);
    k->decode(code, linear_of[0], linear_of[1], linear_of[2], 1024);
}

static uint32_t encoded(const struct fv_kernels *k, const double linear[3])
{
    static _Alignas(64) float channel[3][16];
    static _Alignas(64) uint32_t code[16];
    for (int c = 0; c < 3; c++) channel[c][0] = (float)linear[c];
    k->encode(channel[0], channel[1], channel[2], 1, code, 16);
    return code[0];
}

static void kernels_are_right(void **state)
{
    (void)state;
    static const double rests[] = {0, 0.1, 0.5, 0.9, 1}, shares[] = {0, 0.3, 1}, togethers[] = {0, 1e-3, 0.05, INFINITY};
    uint64_t random = 7;
    int64_t judged = 0, left = 0, blended = 0;
    for (int round = 0; round < 24; round++) {
        _Alignas(64) float rest[16], share[16];
        int isa = round % ((int)fv_cpu_isa() + 1);
        const struct fv_kernels *k = fv_kernels((enum fv_isa)isa);
        take_codes(k);
        make_up(&random);
        for (int i = 0; i < 16; i++) rest[i] = (float)rests[(round + i) % 5], share[i] = (float)shares[(round / 5 + i) % 3];
        for (int y = 0; y < HEIGHT; y++)
            for (int x0 = 0; x0 < STRIDE; x0 += 16) {
                struct fv_smooth s = smooth_of(round % 5, x0, y, rest, share, (float)togethers[round / 3 % 4]);
                k->smooth(&s);
                for (int x = x0; x < x0 + 16 && x < WIDTH; x++) {
                    double linear[3];
                    uint32_t got = smoothed[y * STRIDE + x], own = colour[0][y * STRIDE + x];
                    assert_int_equal(got & ~FV_PIXEL_COLOUR, own & ~FV_PIXEL_COLOUR);
                    if (!expected_at(&s, x, y, (double)rest[x - x0], (double)share[x - x0], linear)) {
                        left++;
                        continue;
                    }
                    judged++;
                    blended += (got & FV_PIXEL_COLOUR) != (own & FV_PIXEL_COLOUR);
                    if (stage_step(got, encoded(k, linear)) > 2) fail_msg("round %d isa %d at %d, %d: %08x, must be %08x", round, isa, x, y, got, encoded(k, linear));
                }
            }
    }
    print_message("%lld pixels judged, %lld of them blended, %lld left to rounding\n", (long long)judged, (long long)blended, (long long)left);
    assert_true(blended > judged / 20 && left < judged / 10);
}

static struct stage plain, shown, other;

/* No corner fails: pixels are the same in every frame. */
static const char *const base[] = {"scene.name=primitives", "method.name=selective", "selective.periphery=every", "selective.shape=1e6 1e6 0 1e6", NULL};

static void open_stage(struct stage *s, const struct stage *of, int size, const char *const *more)
{
    struct fv_error error;
    stage_set(s, size, base, more);
    if (of) {
        stage_share(s, of, stage_workers());
        return;
    }
    if (fv_scene_load(&s->scene, &s->config, &error)) fail_msg("%s", error.text);
    stage_open(s, stage_workers());
}

/* What is shown of the row. */
static const uint32_t *shown_row(const struct stage *s, int y, int x)
{
    const struct fv_frame *f = &s->loop.frame;
    bool is = f->state && f->state[y / FV_TILE * f->tiles_x + x / FV_TILE].smoothed;
    return (const uint32_t *)f->buffer[is ? FV_SMOOTHED : FV_COLOUR][0] + y * f->stride;
}

static int largest_step(const struct stage *a, const struct stage *b)
{
    int most = 0;
    for (int y = 0; y < a->loop.frame.height; y++)
        for (int x = 0; x < a->loop.frame.width; x++) {
            int step = stage_step(shown_row(a, y, x)[x], stage_row(b, y)[x]);
            if (step > most) most = step;
        }
    return most;
}

static int smoothed_tiles(const struct stage *s)
{
    int count = 0;
    for (int t = 0; t < s->loop.frame.tiles; t++) count += s->loop.frame.state[t].smoothed;
    return count;
}

/* A view that is still stays as it is; the first frame, alpha 1, and no frames are no smoothing. */
static void still_views(void **state)
{
    (void)state;
    static const char *const smooth4[] = {"selective.smooth=4", "selective.alpha=0 0 0 0 0 0", NULL};
    static const char *const ones[] = {"selective.smooth=2", "selective.alpha=1 1 1 1 1 1", NULL};
    open_stage(&plain, NULL, 200, NULL);
    open_stage(&shown, &plain, 200, smooth4);
    open_stage(&other, &plain, 200, ones);
    assert_int_equal(plain.plan.passes, 2);
    assert_null(plain.loop.frame.buffer[FV_SMOOTHED][0]);
    assert_null(plain.loop.frame.buffer[FV_EARLIER_COLOUR][0]);
    assert_int_equal(shown.plan.passes, 3);
    for (int i = 0; i < 8; i++) {
        double yaw = i < 6 ? 0 : i;
        stage_frame(&plain, yaw, 0, 0);
        stage_frame(&shown, yaw, 0, 0);
        stage_frame(&other, yaw, 0, 0);
        assert_int_equal(largest_step(&other, &plain), 0);
        assert_int_equal(smoothed_tiles(&shown), i > 0 ? shown.loop.frame.tiles : 0);
        assert_int_equal(shown.loop.frame.pasts, i < 4 ? i : 4);
        if (i < 6) assert_true(largest_step(&shown, &plain) <= (i > 0));
    }
    assert_true(largest_step(&shown, &plain) > 20); /* it moved */
    fv_loop_restart(&shown.loop);
    stage_frame(&shown, 0, 0, 0);
    stage_frame(&plain, 0, 0, 0);
    assert_int_equal(smoothed_tiles(&shown), 0);
    assert_int_equal(largest_step(&shown, &plain), 0);
    stage_close(&plain);
}

/* dB of what is shown of s against 64 samples a pixel. */
static double worth(const struct stage *s, const struct stage *reference)
{
    double sum = 0, n = 0;
    for (int y = 4; y < s->loop.frame.height - 4; y++)
        for (int x = 4; x < s->loop.frame.width - 4; x++)
            for (int c = 0; c < 3; c++, n++)
                sum += pow((double)(shown_row(s, y, x)[x] >> 10 * c & 1023) - (double)(stage_row(reference, y)[x] >> 10 * c & 1023), 2);
    return 10 * log10(1023.0 * 1023 * n / sum);
}

/* Heads that turn slowly: samples of several frames are antialiasing. */
static void heads_that_turn(void **state)
{
    (void)state;
    static const char *const smooth4[] = {"selective.smooth=4", "selective.alpha=0 0 0 0 0 0", NULL};
    static const char *const sparse[] = {"selective.smooth=4", "selective.periphery=sparse", "selective.near_deg=60", "selective.outer_deg=60", NULL};
    static const char *const many[] = {"method.name=full", "method.spp=64", NULL};
    open_stage(&plain, NULL, 200, many);
    open_stage(&shown, &plain, 200, smooth4);
    open_stage(&other, &plain, 200, sparse);
    for (int i = 0; i < 7; i++) {
        stage_frame(&shown, 0.13 * i, 0, 0);
        stage_frame(&other, 0.13 * i, 0, 0);
    }
    stage_frame(&plain, 0.13 * 6, 0, 0);
    double with = worth(&shown, &plain), less = worth(&other, &plain), without = stage_psnr(&shown, &plain, 0, 90);
    print_message("turning head: %.2f dB over 5 frames, %.2f by the paper's alpha, %.2f of one\n", with, less, without);
    assert_true(with > without + 1.8 && less > without + 1.5);
    stage_close(&plain);
}

/* Beyond the central region's border nothing is smoothed, at it next to nothing: no seam. */
static void borders_of_the_central_region(void **state)
{
    (void)state;
    static const char *const sets[] = {"selective.smooth=4", "selective.periphery=sparse", "selective.near_deg=20", "selective.alpha=0 0 0 0 0 0", NULL};
    int64_t inside = 0;
    open_stage(&shown, NULL, 256, sets);
    for (int i = 0; i < 6; i++) stage_frame(&shown, 0.7 * i, 0, 0);
    for (int y = 0; y < 256; y++)
        for (int x = 0; x < 256; x++) {
            double e = (double)stage_eccentricity(&shown, x, y);
            int step = stage_step(shown_row(&shown, y, x)[x], stage_row(&shown, y)[x]);
            if (e > 20.05) assert_int_equal(step, 0);
            if (e > 19.9 && step > 60) fail_msg("a seam of %d at %d, %d", step, x, y);
            inside += e < 15 && step > 10;
        }
    assert_true(inside > 100);
    stage_close(&shown);
}

/* Where the raster held no tile in a frame, that frame's image has no history there, however often images changed places. */
static void rasters_that_turn(void **state)
{
    (void)state;
    static const char *const sets[] = {"selective.smooth=3", "selective.periphery=sparse", "selective.para_deg=3.3", "selective.peri_deg=3.3", "selective.near_deg=6", "method.density_deg=8", "method.quarter_deg=16", NULL};
    static uint8_t density[40][64];
    int64_t coarse = 0;
    open_stage(&shown, NULL, 256, sets);
    const struct fv_frame *f = &shown.loop.frame;
    assert_true(f->tiles == 64);
    for (int i = 0; i < 40; i++) {
        stage_frame(&shown, 0, i % 7 < 3 ? -30 : i % 5 < 2 ? 0 : 30, 0);
        for (int t = 0; t < f->tiles; t++) density[i][t] = f->state[t].density;
        assert_int_equal(f->pasts, i < 3 ? i : 3);
        for (int k = 0; k < f->pasts; k++)
            for (int t = 0; t < f->tiles; t++) {
                const uint32_t *word = f->past[k].cache[0] + t / f->tiles_x * FV_TILE * f->stride + t % f->tiles_x * FV_TILE;
                if (density[i - 1 - k][t] == FV_FINE) continue;
                coarse++;
                for (int y = 0; y < FV_TILE; y++)
                    for (int x = 0; x < FV_TILE; x++) assert_true(word[y * f->stride + x] >= FV_CACHE_NONE);
            }
    }
    assert_true(coarse > 1000);
    stage_close(&shown);
}

/* A red post before a grey wall; the head moves sideways fast: what it uncovers is the wall at once. */
static void what_is_uncovered(void **state)
{
    (void)state;
    static struct small_scene small;
    static struct fv_plan plan;
    static struct fv_session session;
    static struct fv_loop loop;
    const double wall[3] = {-30, -30, -9}, across[3] = {60, 0, 0}, up[3] = {0, 60, 0};
    const double post[3] = {-0.05, -4, -2}, wide[3] = {0.1, 0, 0}, high[3] = {0, 8, 0};
    struct fv_material grey = fv_material_default(), red = grey;
    for (int c = 0; c < 3; c++) grey.diffuse[c] = 0.7f, red.diffuse[c] = c ? 0.02f : 0.9f;
    small_begin(&small);
    small_picture(&small.config, 200);
    strcpy(small.config.display_sink, "none");
    strcpy(small.config.selective_periphery, "every");
    for (int i = 0; i < 6; i++) small.config.selective_alpha.value[i] = 0;
    small_plate(&small, wall, across, up, 1, fv_build_material(small.build, &grey));
    small_plate(&small, post, wide, high, 1, fv_build_material(small.build, &red));
    small_finish(&small);
    for (int c = 0; c < 3; c++) small.scene.ambient[c] = 1;
    fv_frame_size(&loop.frame, &small.config);
    fv_plan_make(&plan, fv_method_find("selective"), &small.scene, &small.config, &loop.frame);
    fv_loop_open(&loop, &small.config, &plan, &small.tracer, stage_workers(), &session, 1);
    int64_t posts = 0;
    for (int i = 0; i < 9; i++) {
        const double gaze[2][3] = {{0, 0, -1}, {0, 0, -1}};
        struct fv_pose head = {{2.0 / 90 * (i - 4), 0, 0}, {1, 0, 0, 0}};
        struct fv_frame_record record;
        fv_loop_frame(&loop, &head, gaze, 0, 0, &record);
        for (int y = 0; y < 200 && i > 0; y++) {
            const uint32_t *is = (const uint32_t *)loop.frame.buffer[FV_COLOUR][0] + y * loop.frame.stride;
            const uint32_t *seen = (const uint32_t *)loop.frame.buffer[FV_SMOOTHED][0] + y * loop.frame.stride;
            for (int x = 2; x < 198; x++) {
                int near = 1023;
                for (int d = -2; d <= 2; d++) near = (int)(is[x + d] >> 10 & 1023) < near ? (int)(is[x + d] >> 10 & 1023) : near;
                posts += near < 300;
                if (near > 600 && stage_step(is[x], seen[x]) > 50) fail_msg("a trail at %d, %d of frame %d", x, y, i);
            }
        }
    }
    assert_true(posts > 200);
    fv_tracer_close(&small.tracer);
}

/* Bodies are smoothed by their own motion: what is shown of them keeps their colours. */
static void bodies_that_move(void **state)
{
    (void)state;
    static const char *const sets[] = {"scene.name=moving", "selective.smooth=4", "selective.alpha=0 0 0 0 0 0", "method.depth=1", NULL};
    int64_t moving = 0, off = 0, changed = 0;
    open_stage(&shown, NULL, 256, sets);
    const struct fv_frame *f = &shown.loop.frame;
    for (int i = 0; i < 8; i++) {
        stage_frame(&shown, 0, 0, (int64_t)(i * 1e9 / 75));
        for (int y = 0; y < 256 && i > 3; y++)
            for (int x = 0; x < 256; x++) {
                const uint32_t *word = (const uint32_t *)f->buffer[FV_CACHE][0] + y * f->stride + x;
                bool edge = false;
                for (int d = 0; d < 9; d++) {
                    int64_t at = (d / 3 - 1) * f->stride + d % 3 - 1;
                    edge |= y == 0 || y == 255 || ((word[0] ^ word[at]) & FV_CACHE_MOVING);
                }
                if (edge || !(*word & FV_CACHE_MOVING)) continue;
                int step = stage_step(shown_row(&shown, y, x)[x], stage_row(&shown, y)[x]);
                moving++;
                off += step > 120;
                changed += step > 0;
            }
    }
    print_message("%lld pixels of bodies, %lld smoothed, %lld far off\n", (long long)moving, (long long)changed, (long long)off);
    assert_true(moving > 500 && changed > moving / 4 && off < moving / 50);
    stage_close(&shown);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(kernels_are_right), cmocka_unit_test(still_views), cmocka_unit_test(heads_that_turn),
                                       cmocka_unit_test(borders_of_the_central_region), cmocka_unit_test(rasters_that_turn),
                                       cmocka_unit_test(what_is_uncovered), cmocka_unit_test(bodies_that_move)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
