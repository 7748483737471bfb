/* turn: late pictures turned to the newest head: to a twentieth of a pixel of where double arithmetic puts them, through
 * any lens, its colours too; against pictures that were rendered there; their edges; and what is not turned. */
#include "rt/pass/turn.h"
#include "tests/support/random.h"
#include "tests/support/stage.h"

static const struct fv_lens_settings lenses[] = {
    {.centre_px = {475.3, 540}, .unit_px = 552.346, .k = {0.2485, -0.0768, 0.2194}, .visible_deg = 54, .channel = {{0.98766, -0.01666}, {1.02059, 0.01666}}, .width = 960, .height = 1080},
    {.centre_px = {368.6, 400}, .unit_px = 350.4, .k = {0.2638, 0.3451, 0}, .visible_deg = 88, .channel = {{0.996, -0.0048}, {1.014, 0}}, .width = 640, .height = 800},
    {.centre_px = {475.3, 540}, .unit_px = 552.346, .k = {0.2485, -0.0768, 0.2194}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 960, .height = 1080},
    {.centre_px = {320, 400}, .unit_px = 400, .k = {-0.12, 0, 0}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 640, .height = 800},
    {.centre_px = {900, 900}, .unit_px = 800, .k = {0, 0, 0}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 1832, .height = 1920}, /* a pinhole */
};
enum { LENSES = sizeof lenses / sizeof lenses[0], PINHOLE = LENSES - 1, ROWS_APART = 37, PICTURE_MOST = 1856 * 1952 };

/* Yaw, pitch, roll, degrees. */
static const double turns[][3] = {{0.5, 0, 0}, {0, -1.3, 0.2}, {-4, 2, 1}, {12, 9, -20}, {40, 0, 0}, {0, 0, 59}};
enum { TURNS = sizeof turns / sizeof turns[0] };

static struct scene {
    struct fv_frame f;
    struct fv_turn turn;
    struct fv_fringe fringe;
    const struct fv_lens_settings *lens;
} s;
static uint32_t *picture, *result; /* PICTURE_MOST pixels each */

static void turned(const double deg[3], struct fv_pose *head)
{
    *head = s.f.view[0].pose;
    double by[4];
    fv_quat_from_yaw_pitch_roll(deg[0] * M_PI / 180, deg[1] * M_PI / 180, deg[2] * M_PI / 180, by);
    fv_quat_multiply(head->rotation, by, head->rotation);
}

static void look(int k)
{
    static const double ahead[3] = {0, 0, -1};
    const struct fv_lens_settings *l = s.lens = &lenses[k];
    struct fv_lens lens = {l->centre_px[0] / l->unit_px, (l->width - l->centre_px[0]) / l->unit_px, l->centre_px[1] / l->unit_px,
                           (l->height - l->centre_px[1]) / l->unit_px, l->width, l->height};
    struct fv_bend bend = {.on = false};
    struct fv_pose pose = {{1, 2, 3}, {1, 0, 0, 0}};
    fv_quat_from_yaw_pitch_roll(0.7, -0.3, 0.1, pose.rotation);
    if (k != PINHOLE) fv_bend_set(&bend, l);
    s.f = (struct fv_frame){.eyes = 1, .width = l->width, .height = l->height, .stride = (l->width + 31) / 32 * 32, .turn = &s.turn};
    assert_true(s.f.stride * s.f.height <= PICTURE_MOST);
    fv_view_set_bent(&s.f.view[0], &lens, &bend, &pose, ahead);
    if (k != PINHOLE) fv_unbend_set(&s.turn.unbend, &bend);
    if (bend.fringes) fv_fringe_set(s.f.fringe = &s.fringe, &bend);
}

/* All of the square's rows that y is one of, into `result`, which has the picture's size. */
static void turn_rows(int isa, int y)
{
    struct fv_turn_square square = {.bend = &s.f.view[0].bend, .unbend = &s.turn.unbend, .fringe = s.f.fringe, .m = s.turn.m[0], .from = picture, .to = result,
                                    .stride = (int)s.f.stride, .width = s.f.width, .height = s.f.height, .y = y / FV_TURN_SIDE * FV_TURN_SIDE};
    for (; square.x < s.f.width; square.x += FV_TURN_SIDE) fv_kernels((enum fv_isa)isa)->turn(&square);
}

/* Where the rendered picture shows what channel c of a pixel (0 red, 1 green, 2 blue) is to show; false: beyond it, or
 * so near its edge that lookups mind that. */
static bool place_of(const struct fv_pose *head, int c, int x, int y, double to[2])
{
    const struct fv_view *v = &s.f.view[0];
    const struct fv_bend *b = &v->bend;
    double at[2] = {x + 0.5, y + 0.5}, centre[2] = {(double)b->centre[0], (double)b->centre[1]}, d[3], inverse[4];
    if (b->on) {
        double u = (at[0] - centre[0]) * (double)b->step[0], w = (at[1] - centre[1]) * (double)b->step[1], q = u * u + w * w, part = 1;
        if (q > (double)b->shown * (double)b->shown) return false;
        if (c != 1) part = b->channel[c / 2].c0 + b->channel[c / 2].c1 * q;
        double scale = part * (1 + q * ((double)b->k[0] + q * ((double)b->k[1] + q * (double)b->k[2])));
        for (int i = 0; i < 2; i++) at[i] = centre[i] + (at[i] - centre[i]) * scale;
    }
    d[0] = at[0] / v->width * (v->lens.tan_left + v->lens.tan_right) - v->lens.tan_left;
    d[1] = v->lens.tan_up - at[1] / v->height * (v->lens.tan_up + v->lens.tan_down);
    d[2] = -1;
    fv_quat_conjugate(v->pose.rotation, inverse);
    fv_quat_rotate(head->rotation, d, d);
    fv_quat_rotate(inverse, d, d);
    if (!(d[2] < -0.05) || !fv_lens_project(&v->lens, d, to)) return false;
    if (b->on) fv_bend_bent(b, to, to);
    double r = b->on ? hypot((to[0] - centre[0]) * (double)b->step[0], (to[1] - centre[1]) * (double)b->step[1]) : 0;
    return to[0] > 1 && to[0] < v->width - 1 && to[1] > 1 && to[1] < v->height - 1 && (!b->on || r < (double)(b->shown - 4 * b->step[0]));
}

/* Full on or off, eight pixels each: upright for red, across for green, askew for blue. */
static int stripe(int c, int x, int y)
{
    return ((c == 0 ? x : c == 1 ? y : x + y) >> 3 & 1) * 255;
}

static double light_at(int c, const double at[2])
{
    double x = at[0] - 0.5, y = at[1] - 0.5, fx = x - floor(x), fy = y - floor(y), sum = 0;
    for (int k = 0; k < 4; k++) {
        double v = stripe(c, (int)floor(x) + (k & 1), (int)floor(y) + (k >> 1)) / 255.0;
        sum += v * v * (k & 1 ? fx : 1 - fx) * (k >> 1 ? fy : 1 - fy);
    }
    return sum;
}

/* Where stripes meet, light grows by a full step a pixel: what is off there is off by as many pixels. */
static void places(void **state)
{
    (void)state;
    static _Alignas(64) uint32_t row[FV_ISA_COUNT][1856];
    for (int k = 0; k < LENSES; k++) {
        double worst = 0;
        int64_t seen = 0;
        look(k);
        for (int y = 0; y < s.f.height; y++)
            for (int x = 0; x < s.f.width; x++)
                picture[y * s.f.stride + x] = (uint32_t)(stripe(0, x, y) | stripe(1, x, y) << 8 | stripe(2, x, y) << 16);
        for (int n = 0; n < TURNS; n++) {
            struct fv_pose head;
            turned(turns[n], &head);
            head.position_m[0] += 5; /* only what turned counts */
            assert_true(fv_turn_set(&s.f, &head));
            for (int y = n; y < s.f.height; y += ROWS_APART) {
                for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
                    turn_rows(isa, y);
                    memcpy(row[isa], result + y * s.f.stride, (size_t)s.f.width * sizeof *result);
                }
                for (int i = 0; i < 3 * s.f.width; i++) {
                    double at[2];
                    int c = i % 3, x = i / 3;
                    if (!place_of(&head, c, x, y, at)) continue;
                    seen++;
                    for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
                        double got = (row[isa][x] >> 8 * c & 255) / 255.0, off = fabs(got * got - light_at(c, at));
                        worst = fmax(worst, off);
                        if (!(off < 0.05)) fail_msg("lens %d, turn %d, instructions %d, pixel %d %d, channel %d: off by %.3f px", k, n, isa, x, y, c, off);
                        assert_true(row[isa][x] >> 24 == 255);
                    }
                }
            }
        }
        print_message("lens %d: off by %.4f px at most, of %lld channels\n", k, worst, (long long)seen);
        assert_true(seen > 100000);
    }
}

/* An even picture stays even, whatever comes into view, through lenses that no one has, too: its edges are taken on. */
static void edges(void **state)
{
    (void)state;
    static const struct fv_lens_settings odd[] = {
        {.centre_px = {0, 0}, .unit_px = 300, .k = {-0.4, 0.3, -0.2}, .visible_deg = 88, .channel = {{0.5, 0.3}, {2, -1}}, .width = 500, .height = 400},
        {.centre_px = {500, 17}, .unit_px = 90, .k = {16, -16, 16}, .visible_deg = 88, .channel = {{1.1, 0}, {0.9, 0}}, .width = 500, .height = 400},
        {.centre_px = {250, 200}, .unit_px = 1, .k = {-16, -16, -16}, .visible_deg = 1, .channel = {{1, -2}, {2, 2}}, .width = 500, .height = 400},
        {.centre_px = {250, 200}, .unit_px = 16384, .k = {0, 0, 0}, .visible_deg = 88, .channel = {{1, 0}, {1, 0}}, .width = 500, .height = 400},
    };
    uint64_t random = 3;
    for (int k = 0; k < LENSES + 4; k++) {
        look(k < LENSES ? k : PINHOLE);
        if (k >= LENSES) {
            struct fv_view *v = &s.f.view[0];
            fv_bend_set(&v->bend, &odd[k - LENSES]);
            fv_unbend_set(&s.turn.unbend, &v->bend);
            s.f.width = 500, s.f.height = 400, s.f.stride = 512;
            s.f.fringe = NULL;
            if (v->bend.fringes) fv_fringe_set(s.f.fringe = &s.fringe, &v->bend);
        }
        const struct fv_bend *b = &s.f.view[0].bend;
        for (int y = 0; y < s.f.height; y++) /* what no eye sees is black, as present leaves it */
            for (int x = 0; x < s.f.width; x++) {
                bool seen = !b->on || fv_bend_square(b, (float)x + 0.5f, (float)y + 0.5f) <= b->shown * b->shown;
                picture[y * s.f.stride + x] = seen ? 0xff1e46c8u : 0xff000000u;
            }
        for (int n = 0; n < 30; n++) {
            struct fv_pose head;
            double deg[3];
            for (int i = 0; i < 3; i++) deg[i] = random_between(&random, -34, 34);
            turned(deg, &head);
            if (!fv_turn_set(&s.f, &head)) continue;
            for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
                for (int y = n; y < s.f.height; y += ROWS_APART) {
                    turn_rows(isa, y);
                    const uint32_t *row = result + y * s.f.stride;
                    bool whole = k < LENSES && (!s.f.fringe || !b->masks);
                    for (int x = 0; x < s.f.width && whole; x++)
                        if (row[x] != 0xff1e46c8u) fail_msg("lens %d, turn %g %g %g, pixel %d %d: %08x", k, deg[0], deg[1], deg[2], x, y, row[x]);
                }
        }
    }
}

static void what_is_not_turned(void **state)
{
    (void)state;
    for (int k = 0; k < LENSES; k++) {
        look(k);
        const double nothing[3] = {0, 0, 0}, hardly[3] = {1e-5, 0, 0}, most[3] = {59.9, 0, 0}, more[3] = {0, 60.1, 0}, behind[3] = {180, 0, 0};
        struct fv_pose head;
        turned(nothing, &head);
        assert_false(fv_turn_set(&s.f, &head));
        for (int i = 0; i < 4; i++) head.rotation[i] = -head.rotation[i]; /* the same turn */
        assert_false(fv_turn_set(&s.f, &head));
        turned(hardly, &head);
        assert_false(fv_turn_set(&s.f, &head));
        turned(more, &head);
        assert_false(fv_turn_set(&s.f, &head));
        turned(behind, &head);
        assert_false(fv_turn_set(&s.f, &head));
        turned(most, &head);
        assert_true(fv_turn_set(&s.f, &head));
        for (int i = 0; i < 7; i++) {
            struct fv_pose bad = head;
            *(i < 4 ? &bad.rotation[i] : &bad.position_m[i - 4]) = i % 2 ? (double)INFINITY : (double)NAN;
            assert_false(fv_turn_set(&s.f, &bad));
        }
        assert_true(fv_turn_set(&s.f, &head));
    }
}

/* A pinhole's picture of 512 x 256, looked up `m` of the way. */
static void turn_flat(int isa, const float m[2][3])
{
    look(PINHOLE);
    s.f.width = s.f.stride = 512, s.f.height = 256;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s.turn.m[0][i][k] = i < 2 ? m[i][k] : k == 2;
    for (int y = 0; y < s.f.height; y += FV_TURN_SIDE) turn_rows(isa, y);
}

static double mixed(double a, double b, double part)
{
    part = fmin(fmax(part, 0), 1);
    return sqrt(a * a * (1 - part) + b * b * part);
}

/* Each code beside each other, in each channel, mixed by parts: to one code of what light of both makes, from places to a
 * 2000th of a pixel. Squares in the middle, where vectors go unchecked, and those at the border. */
static void mixtures(void **state)
{
    (void)state;
    static const float parts[] = {0, 0.001f, 0.004f, 0.0625f, 0.25f, 0.5f, 0.7f, 0.96875f, 0.999f};
    for (int y = 0; y < 256; y++)
        for (int x = 0; x < 512; x++) {
            uint32_t a = (uint32_t)(x % 2 ? x / 2 : y);
            picture[y * 512 + x] = a | (255 - a) << 8 | (a ^ 85) << 16;
        }
    for (size_t n = 0; n < sizeof parts / sizeof parts[0]; n++)
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            const float m[2][3] = {{1, 0, parts[n]}, {0, 1, 0}};
            turn_flat(isa, m);
            for (int y = 0; y < 256; y++)
                for (int x = 0; x < 511; x++)
                    for (int shift = 0; shift < 24; shift += 8) {
                        const uint32_t *at = picture + y * 512 + x;
                        double a = at[0] >> shift & 255, b = at[1] >> shift & 255, part = (double)parts[n], off = 5e-4;
                        double one = mixed(a, b, part - off), other = mixed(a, b, part + off), got = result[y * 512 + x] >> shift & 255;
                        if (!(got >= floor(fmin(one, other) + 0.5) - 1 && got <= floor(fmax(one, other) + 0.5) + 1))
                            fail_msg("instructions %d, %g and %g by %g: %g, not %g to %g", isa, a, b, part, got, one, other);
                    }
        }
}

/* What is even stays so to the bit, each code, wherever it is looked up: along rows, askew, and far aside. */
static void even_pictures(void **state)
{
    (void)state;
    static const float ways[][2][3] = {{{1, 0, 0.37f}, {0, 1, 0.61f}}, {{1.2f, -0.1f, 3.3f}, {0.1f, 0.9f, -2.7f}}, {{0.5f, 1, 0}, {-1, 0.5f, 99}}};
    for (uint32_t code = 0; code < 256; code++) {
        uint32_t colour = code | (255 - code) << 8 | (code * 7 & 255) << 16 | 0xff000000u;
        for (int i = 0; i < 512 * 256; i++) picture[i] = colour;
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            turn_flat(isa, ways[code % 3]);
            for (int i = 0; i < 512 * 256; i++)
                if (result[i] != colour) fail_msg("instructions %d, pixel %d: %08x, not %08x", isa, i, result[i], colour);
            if (code == 0 || code == 255)
                for (int w = 0; w < 3; w++) {
                    turn_flat(isa, ways[w]);
                    for (int i = 0; i < 512 * 256; i++) assert_int_equal(result[i], colour);
                }
        }
    }
}

enum { SIDE = 256 };
static const char *const sets[] = {"scene.name=cornell", "scene.path_seconds=0", "method.name=full", "method.spp=9", "display.sink=png",
                                   "budget.pace=vsync", "display.ipd_mm=0", NULL};
static const char *const radial[] = {"display.lens=radial", "display.lens_unit_px=128", "display.lens_x_px=120", "display.lens_y_px=128",
                                     "display.lens_k=0.2485 -0.0768 0.2194", "display.lens_visible_deg=48",
                                     "display.lens_red=0.98766 -0.01666", "display.lens_blue=1.02059 0.01666", NULL};

static void show(struct stage *stage, double yaw_deg, struct fv_pose *head)
{
    struct fv_frame *f = &stage->loop.frame;
    stage_frame(stage, yaw_deg, 0, 0);
    fv_pass_run(&fv_pass_present, f, stage_workers());
    if (f->fringe) fv_pass_run(&fv_pass_fringe, f, stage_workers());
    *head = f->view[0].pose;
}

/* dB, of pixels that show in both what lies within `part` of the way to the edges. */
static double psnr(const struct fv_frame *f, const uint32_t *a, const uint32_t *b, double part)
{
    double sum = 0, n = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            if (hypot(x - SIDE / 2, y - SIDE / 2) > part * SIDE / 2) continue;
            for (int c = 0; c < 3; c++, n++) sum += pow((double)(a[y * f->stride + x] >> 8 * c & 255) - (double)(b[y * f->stride + x] >> 8 * c & 255), 2);
        }
    return 10 * log10(255.0 * 255 * n / sum);
}

/* A picture rendered five degrees beside, turned, is nearly the one that was rendered there. */
static void rendered_pictures(void **state)
{
    (void)state;
    static struct stage stage;
    static uint32_t there[SIDE * SIDE], here[SIDE * SIDE];
    for (int lens = 0; lens < 2; lens++) {
        struct fv_pose head, before;
        stage_begin(&stage, SIDE, sets, lens ? radial : NULL, stage_workers());
        struct fv_frame *f = &stage.loop.frame;
        assert_true(f->turn && (f->fringe != NULL) == lens && (f->buffer[FV_TURNED][0] == NULL) == lens);
        show(&stage, 5, &head);
        memcpy(there, f->buffer[FV_PICTURE][0], sizeof there);
        show(&stage, 0, &before);
        memcpy(here, f->buffer[FV_PICTURE][0], sizeof here);
        assert_true(fv_turn_set(f, &head));
        fv_pass_run(&fv_pass_turn, f, stage_workers());
        const uint32_t *turned_picture = f->buffer[lens ? FV_PICTURE : FV_TURNED][0];
        double held_db = psnr(f, there, here, 0.75), turned_db = psnr(f, there, turned_picture, 0.75);
        print_message("%s: held %.1f dB, turned %.1f dB\n", lens ? "through a lens" : "a pinhole's", held_db, turned_db);
        assert_true(turned_db > 30 && turned_db > held_db + 10);
        if (lens) assert_int_equal(turned_picture[0], 0xff000000u); /* unseen */
        stage_close(&stage);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(places), cmocka_unit_test(edges), cmocka_unit_test(mixtures),
                                       cmocka_unit_test(even_pictures), cmocka_unit_test(what_is_not_turned),
                                       cmocka_unit_test(rendered_pictures)};
    picture = malloc((PICTURE_MOST + 64) * sizeof *picture);
    result = malloc((PICTURE_MOST + 64) * sizeof *result);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    free(picture);
    free(result);
    return failed;
}
