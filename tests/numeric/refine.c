/* refine: the method selective over made-up samples, whose places are written down: how many there are and where they
 * lie, what pixels are put together from, in pictures of any size, wherever the eye looks; what of a frame was left out;
 * and on which triangles samples lie that are known. One of every kind of picture is also stated in full. */
#include "rt/frame/loop.h"
#include "rt/pass/selective.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

enum { TAKEN_MAX = 1 << 19, SIDE_MAX = 160 };

struct rig {
    struct small_scene small;
    struct fv_workers workers;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

static struct rig rig;
static struct fv_kernels kernels;

/* What is seen at a place of the picture, a channel each; and what samples of it are said to show. */
static double (*seen)(double x, double y, int channel);
static int32_t shown_triangle;

/* Samples that were taken for others than pixels' centres. */
static struct taken {
    float x, y;
    int32_t triangle;
    bool known;
} taken[TAKEN_MAX];
static int taken_count, base_count;

static void trace(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *s, uint32_t of, int64_t *rays)
{
    (void)tracer, (void)view, (void)of;
    rays[FV_RAY_PRIMARY] += s->count;
    for (int i = 0; i < s->count; i++) {
        s->red[i] = (float)seen((double)s->x[i], (double)s->y[i], 0);
        s->green[i] = (float)seen((double)s->x[i], (double)s->y[i], 1);
        s->blue[i] = (float)seen((double)s->x[i], (double)s->y[i], 2);
        s->inverse_depth[i] = 0.5f;
        s->surface[i] = 0;
        if (!s->identified) {
            assert_true(taken_count < TAKEN_MAX);
            taken[taken_count++] = (struct taken){s->x[i], s->y[i], s->triangle[i], s->known};
            continue;
        }
        base_count++;
        s->identity[i] = 1;
        s->facing[i] = 511 | 511 << 10 | 1022 << 20;
        s->triangle[i] = shown_triangle < 0 ? -1 : shown_triangle + (int)s->x[i] + 1000 * (int)s->y[i];
        s->lit[i] = 1;
    }
}

/* Every corner's samples are n; the central region ends at near_deg. */
static void open_rig(const char *method, int width, int height, int n, double near_deg)
{
    const double corner[3] = {-1, -1, -5}, u[3] = {2, 0, 0}, v[3] = {0, 2, 0};
    struct fv_config *c = &rig.small.config;
    struct fv_material grey = fv_material_default();
    memset(&rig, 0, sizeof rig);
    small_begin(&rig.small);
    small_picture(c, width);
    c->display_height = height;
    strcpy(c->display_sink, "none");
    strcpy(c->selective_periphery, "every");
    c->selective_smooth = 0;
    c->selective_near_deg = near_deg, c->selective_outer_deg = 180;
    for (int r = 0; r < 4; r++) c->selective_samples.value[r] = n;
    small_plate(&rig.small, corner, u, v, 1, fv_build_material(rig.small.build, &grey));
    small_finish(&rig.small);
    fv_workers_start(&rig.workers, 1);
    fv_frame_size(&rig.loop.frame, c);
    fv_plan_make(&rig.plan, fv_method_find(method), &rig.small.scene, c, &rig.loop.frame);
    fv_loop_open(&rig.loop, c, &rig.plan, &rig.small.tracer, &rig.workers, &rig.session, 1);
    kernels = *rig.loop.frame.kernels;
    kernels.trace = trace;
    rig.loop.frame.kernels = &kernels;
}

static void close_rig(void)
{
    fv_workers_stop(&rig.workers);
    fv_tracer_close(&rig.small.tracer);
}

static void render(const double gaze[3])
{
    const struct fv_pose head = {{0, 0, 0}, {1, 0, 0, 0}};
    struct fv_frame_record record;
    double both[2][3];
    for (int e = 0; e < 2; e++) memcpy(both[e], gaze, sizeof both[e]);
    taken_count = base_count = 0;
    fv_loop_frame(&rig.loop, &head, (const double(*)[3])both, 0, 0, &record);
}

static const double ahead[3] = {0, 0, -1};

static uint32_t pixel(int x, int y)
{
    return ((const uint32_t *)rig.loop.frame.buffer[FV_COLOUR][0])[y * rig.loop.frame.stride + x] & FV_PIXEL_COLOUR;
}

static uint32_t code_of(const double linear[3])
{
    static _Alignas(64) float channel[3][16];
    static _Alignas(64) uint32_t code[16];
    for (int c = 0; c < 3; c++) channel[c][0] = (float)linear[c];
    rig.loop.frame.kernels->encode(channel[0], channel[1], channel[2], 1, code, 16);
    return code[0];
}

static uint32_t centre_code(int x, int y)
{
    double linear[3];
    for (int c = 0; c < 3; c++) linear[c] = seen(x + 0.5, y + 0.5, c);
    return code_of(linear);
}

static void expect_pixel(int x, int y, uint32_t expected, int within)
{
    uint32_t got = pixel(x, y);
    for (int c = 0; c < 3; c++)
        if (abs((int)(got >> 10 * c & 1023) - (int)(expected >> 10 * c & 1023)) > within)
            fail_msg("pixel %d, %d: %08x, must be %08x", x, y, got, expected);
}

/* No two neighbours' centres are alike; nor are places within a pixel. */
static double checker(double x, double y, int c)
{
    double inside = 1 + 0.2 * (x - floor(x)) + 0.1 * (y - floor(y));
    return (((int)floor(x) + (int)floor(y)) & 1 ? 1.5 : 0.01) * inside / (c + 1);
}

static double even(double x, double y, int c)
{
    (void)x, (void)y;
    return 0.3 + 0.1 * c;
}

static double black(double x, double y, int c)
{
    (void)x, (void)y, (void)c;
    return 0;
}

/* Rather dark areas, edges, fine lines, a slope. */
static double mixed(double x, double y, int c)
{
    double v = 0.1 + 0.002 * x;
    if (sin(0.7 * x) * cos(0.3 * y) > 0.4) v = 0.9;
    if (fmod(x + 2 * y, 9) < 1.2) v += 0.4;
    if (hypot(x - 20, y - 20) < 11.3) v = c == 1 ? 0.5 : 0;
    if (y > 30 && y < 34.6) v = 9;
    return v;
}

/* Sums of radiance and counts by quarter of a pixel. */
static struct quarter {
    int count;
    double sum[3];
} quarters[2 * SIDE_MAX][2 * SIDE_MAX];

/* Along one side of a quarter: within stratum k of so many, but for rounding. */
static void expect_stratum(float at, double from, int k, int count)
{
    double low = from + 0.5 * k / count, off = (double)at - low;
    if (!(off >= -1e-5 && off <= 0.5 / count + 1e-5)) fail_msg("%.9g is not in stratum %d of %d from %g on", (double)at, k, count, from);
}

/* Samples of one quarter stand side by side, by stratum. */
static void collect(int n)
{
    int side = (int)lround(sqrt(n));
    memset(quarters, 0, sizeof quarters);
    assert_int_equal(taken_count % n, 0);
    for (int first = 0; first < taken_count; first += n) {
        double x = 0, y = 0;
        for (int k = first; k < first + n; k++) x += (double)taken[k].x / n, y += (double)taken[k].y / n;
        assert_true(x >= 0 && y >= 0 && x <= SIDE_MAX && y <= SIDE_MAX);
        struct quarter *q = &quarters[(int)(2 * y)][(int)(2 * x)];
        x = floor(2 * x) / 2, y = floor(2 * y) / 2;
        for (int k = 0; k < n; k++) {
            const struct taken *t = &taken[first + k];
            bool square = side * side == n;
            expect_stratum(t->x, x, square ? k % side : k, square ? side : n);
            expect_stratum(t->y, y, square ? k / side : 0, square ? side : 1);
            q->count++;
            for (int c = 0; c < 3; c++) q->sum[c] += seen((double)t->x, (double)t->y, c);
        }
    }
}

/* What pixels come to where every corner of theirs failed; those at the border keep their own sample. */
static void expect_all_refined(int width, int height, int n)
{
    int inner = (width - 1) * (height - 1);
    assert_int_equal(taken_count, 4 * n * inner);
    collect(n);
    for (int y = 0; y < 2 * height; y++)
        for (int x = 0; x < 2 * width; x++) {
            bool in = x > 0 && y > 0 && x < 2 * width - 1 && y < 2 * height - 1;
            if (quarters[y][x].count != (in ? n : 0)) fail_msg("quarter %d, %d: %d samples", x, y, quarters[y][x].count);
        }
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double linear[3] = {0, 0, 0};
            if (x == 0 || y == 0 || x == width - 1 || y == height - 1) {
                expect_pixel(x, y, centre_code(x, y), 0);
                continue;
            }
            for (int q = 0; q < 4; q++)
                for (int c = 0; c < 3; c++) linear[c] += quarters[2 * y + (q >> 1)][2 * x + (q & 1)].sum[c] / (4 * n);
            expect_pixel(x, y, code_of(linear), 1);
        }
}

static void a_sample_in_each_stratum(void **state)
{
    (void)state;
    for (int n = 1; n <= 64; n++) {
        open_rig("selective", 37, 35, n, 180);
        seen = checker, shown_triangle = -1;
        for (int frame = 0; frame < 2; frame++) {
            render(ahead);
            expect_all_refined(37, 35, n);
        }
        close_rig();
    }
}

/* Along y, too, samples of a quarter are spread: no gap is wider than three even ones. */
static void no_wide_gaps(void **state)
{
    (void)state;
    for (int n = 2; n <= 64; n++) {
        int side = (int)lround(sqrt(n));
        if (side * side == n) continue;
        open_rig("selective", 8, 8, n, 180);
        seen = checker, shown_triangle = -1;
        render(ahead);
        for (int first = 0; first < taken_count; first += n) {
            double widest = 0, from = floor(2 * (double)taken[first].y) / 2;
            for (int i = first; i < first + n; i++) {
                double nearest = 0.5; /* the next one above it, or below the lowest around */
                for (int k = first; k < first + n; k++) {
                    double up = (double)taken[k].y - (double)taken[i].y;
                    if (up < 0) up += 0.5;
                    if (k != i) nearest = fmin(nearest, up);
                }
                assert_true((double)taken[i].y >= from && (double)taken[i].y <= from + 0.5);
                widest = fmax(widest, nearest);
            }
            if (widest > 3 * 0.5 / n) fail_msg("n %d: a gap of %g", n, widest);
        }
        close_rig();
    }
}

static const int sizes[][2] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}, {1, 40}, {40, 1}, {3, 70}, {31, 31}, {32, 32}, {33, 33}, {34, 65}, {97, 64}};

static void pictures_of_any_size(void **state)
{
    (void)state;
    for (unsigned i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        int width = sizes[i][0], height = sizes[i][1];
        open_rig("selective", width, height, 3, 180);
        seen = checker, shown_triangle = -1;
        render(ahead);
        expect_all_refined(width, height, 3);
        seen = even;
        render(ahead);
        assert_int_equal(taken_count, 0);
        for (int k = 0; k < width * height; k++) expect_pixel(k % width, k / width, centre_code(0, 0), 0);
        seen = black;
        render(ahead);
        assert_int_equal(taken_count, 0);
        for (int k = 0; k < width * height; k++) assert_int_equal(pixel(k % width, k / width), 0);
        close_rig();
    }
}

/* The paper's subpixels, stated plainly, where tolerance is the same everywhere (Jin, Ihm and Kim 2009). */
static bool fails(int x, int y)
{
    static const double scale[3] = {1.36, 1.02, 2.04};
    for (int c = 0; c < 3; c++) {
        double high = 0, low = 1023;
        for (int k = 0; k < 4; k++) {
            double v = centre_code(x - 1 + (k & 1), y - 1 + (k >> 1)) >> 10 * c & 1023;
            high = fmax(high, v), low = fmin(low, v);
        }
        if (high - low - 1 > 0.02 * scale[c] * (high + low)) return true;
    }
    return false;
}

static void decoded(int x, int y, double linear[3])
{
    static _Alignas(64) float channel[3][16];
    static _Alignas(64) uint32_t code[16];
    code[0] = centre_code(x, y);
    rig.loop.frame.kernels->decode(code, channel[0], channel[1], channel[2], 16);
    for (int c = 0; c < 3; c++) linear[c] = (double)channel[c][0];
}

static void a_picture_as_stated(void **state)
{
    (void)state;
    const int width = 75, height = 70;
    open_rig("selective-uniform", width, height, 9, 180);
    seen = mixed, shown_triangle = -1;
    render(ahead);
    collect(4);
    int failed = 0;
    for (int y = 1; y < height - 1; y++)
        for (int x = 1; x < width - 1; x++) {
            double sum[3] = {0, 0, 0}, own[3], beside[3], above[3], across[3];
            for (int q = 0; q < 4; q++) {
                int right = q & 1, low = q >> 1, dx = 2 * right - 1, dy = 2 * low - 1;
                const struct quarter *of = &quarters[2 * y + low][2 * x + right];
                bool fail = fails(x + right, y + low);
                failed += fail;
                if (of->count != (fail ? 4 : 0)) fail_msg("pixel %d, %d, quarter %d: %d samples", x, y, q, of->count);
                decoded(x, y, own), decoded(x + dx, y, beside), decoded(x, y + dy, above), decoded(x + dx, y + dy, across);
                for (int c = 0; c < 3; c++)
                    sum[c] += fail ? of->sum[c] / 16 : (9 * own[c] + 3 * beside[c] + 3 * above[c] + across[c]) / 64;
            }
            expect_pixel(x, y, code_of(sum), 1);
        }
    print_message("%d of %d quarters failed\n", failed, 4 * (width - 2) * (height - 2));
    assert_true(failed > width * height && failed < 3 * width * height);
    close_rig();
}

/* The central region lies around the gaze, in the picture or outside; behind and nowhere count as straight ahead. */
static void wherever_the_eye_looks(void **state)
{
    (void)state;
    static const struct {
        double gaze[3];
        int most; /* samples of the whole picture, in percent */
    } table[] = {{{0, 0, -1}, 30},       {{0.5, 0.3, -1}, 30},  {{1.1, 0, -1}, 12}, {{-1, 1, -1}, 8},
                 {{5, 0, -1}, 0},        {{1, 0, -1e-9}, 0},    {{0, 0, 1}, 30},    {{NAN, 0, -1}, 30},
                 {{0, 0, 0}, 30},        {{0, -INFINITY, -1}, 30}, {{1e7, 0, -1}, 30}};
    const int side = 120;
    for (unsigned i = 0; i < sizeof table / sizeof *table; i++) {
        open_rig("selective", side, side, 1, 15);
        seen = checker, shown_triangle = -1;
        render(table[i].gaze);
        const struct fv_view *view = &rig.loop.frame.view[0];
        memset(quarters, 0, sizeof quarters);
        int inner = 0;
        /* Tiles that touch the region are told apart; the others take samples of their own. */
        for (int k = 0; k < taken_count; k++)
            if (fabs((double)taken[k].x - floor((double)taken[k].x) - 0.5) > 0 || fabs((double)taken[k].y - floor((double)taken[k].y) - 0.5) > 0)
                quarters[(int)floor(2 * (double)taken[k].y)][(int)floor(2 * (double)taken[k].x)].count++, inner++;
        for (int y = 1; y < side; y++)
            for (int x = 1; x < side; x++) {
                double e = (double)fv_eccentricity_deg(view, (float)x, (float)y);
                int count = quarters[2 * y][2 * x].count;
                if (fabs(e - 15) > 0.5 && count != (e < 15)) fail_msg("gaze %u: corner %d, %d at %g degrees has %d samples", i, x, y, e, count);
            }
        if (inner * 100 > table[i].most * 4 * side * side || (inner == 0) != (table[i].most == 0))
            fail_msg("gaze %u: %d samples", i, inner);
        close_rig();
    }
}

static int taken_within(float from, float to)
{
    int n = 0;
    for (int i = 0; i < taken_count; i++)
        n += taken[i].x > from && taken[i].x < to && taken[i].y > from && taken[i].y < to;
    return n;
}

/* A tile that was left out keeps what it has: its pixels' samples are none of this frame's, whichever that is. */
static void what_was_left_out_is_not_refined(void **state)
{
    (void)state;
    const int side = 96, out = 4; /* the tile in the middle */
    open_rig("selective", side, side, 1, 180);
    struct fv_frame *f = &rig.loop.frame;
    seen = checker, shown_triangle = -1;
    for (int64_t number = 0; number < 70; number++) {
        f->number = number;
        render(ahead);
        f->number = number + 1;
        taken_count = 0;
        for (int t = 0; t < f->tiles; t++) {
            struct fv_tile tile = fv_tile_at(f, t, 0);
            if (t != out) fv_pass_gather.run(f, &tile);
        }
        for (int t = 0; t < f->tiles; t++) {
            struct fv_tile tile = fv_tile_at(f, t, 0);
            fv_pass_refine.run(f, &tile);
        }
        if (taken_within(31.5f, 64.5f) > 0) fail_msg("frame %lld: %d samples", (long long)number + 1, taken_within(31.5f, 64.5f));
        assert_true(taken_count > 4 * 5000);
    }
    close_rig();
}

/* The same in a sparse periphery, also where a frame's stamp comes around. */
static void stamps_come_around(void **state)
{
    (void)state;
    const int side = 96, out = 4;
    for (int later = 1; later < 70; later += 6) {
        open_rig("selective", side, side, 1, 180);
        strcpy(rig.small.config.selective_periphery, "sparse");
        fv_plan_make(&rig.plan, fv_method_find("selective"), &rig.small.scene, &rig.small.config, &rig.loop.frame);
        fv_loop_open(&rig.loop, &rig.small.config, &rig.plan, &rig.small.tracer, &rig.workers, &rig.session, 1);
        struct fv_frame *f = &rig.loop.frame;
        f->kernels = &kernels;
        seen = checker, shown_triangle = -1;
        render(ahead);
        assert_true(taken_within(32.5f, 63.5f) >= 4 * 30 * 30);
        f->number = later;
        taken_count = 0;
        for (int t = 0; t < f->tiles; t++) {
            struct fv_tile tile = fv_tile_at(f, t, 0);
            f->state[t].reprojected = 1;
            if (t == out) fv_pass_sample.stand_in(f, &tile);
            else fv_pass_sample.run(f, &tile);
        }
        for (int t = 0; t < f->tiles; t++) {
            struct fv_tile tile = fv_tile_at(f, t, 0);
            fv_pass_refine.run(f, &tile);
        }
        if (taken_within(31.5f, 64.5f) > 0) fail_msg("%d frames later: %d samples", later, taken_within(31.5f, 64.5f));
        assert_true(taken_count > 4 * 5000);
        close_rig();
    }
}

/* Texture alone: samples lie on the triangle of the pixel that they are a quarter of. */
static void known_samples_are_of_their_pixel(void **state)
{
    (void)state;
    const int width = 70, height = 40;
    open_rig("selective", width, height, 4, 180);
    seen = checker, shown_triangle = 0;
    render(ahead);
    expect_all_refined(width, height, 4);
    for (int i = 0; i < taken_count; i++) {
        assert_true(taken[i].known);
        assert_int_equal(taken[i].triangle, (int)taken[i].x + 1000 * (int)taken[i].y);
    }
    close_rig();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sample_in_each_stratum), cmocka_unit_test(no_wide_gaps), cmocka_unit_test(pictures_of_any_size),
        cmocka_unit_test(a_picture_as_stated), cmocka_unit_test(wherever_the_eye_looks),
        cmocka_unit_test(what_was_left_out_is_not_refined), cmocka_unit_test(stamps_come_around),
        cmocka_unit_test(known_samples_are_of_their_pixel)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
