/* lines: a grid of straight bars, rendered through lenses; edges found in the picture to a small part of a pixel and put
 * through the lens, as an eye behind it sees them, lie on straight lines within 0.1 pixels, in each channel, where the
 * bars are. And every pixel that no eye sees is black, and none traced where a block holds no other. */
#include "rt/frame/loop.h"
#include "rt/pass/fringe.h"
#include "tests/support/small_scene.h"

enum { WIDTH = 320, HEIGHT = 352, BARS = 7, REACH = 5, GROUP = 8, POINTS = 512, BORDER = 12 /* blue comes from up to so many pixels farther out */ };

static const struct lens_case {
    const char *name, *k, *red, *blue, *visible;
    const char *unit;
} cases[] = {
    {"barrel", "display.lens_k=0.2638 0.3451 0", "display.lens_red=0.996 -0.0048", "display.lens_blue=1.014 0", "display.lens_visible_deg=60", "display.lens_unit_px=175"},
    {"strong colours", "display.lens_k=0.2485 -0.0768 0.2194", "display.lens_red=0.97 -0.02", "display.lens_blue=1.04 0.02", "display.lens_visible_deg=54", "display.lens_unit_px=180"},
    {"pincushion", "display.lens_k=-0.15 0 0", "display.lens_red=1 0", "display.lens_blue=1 0", "display.lens_visible_deg=88", "display.lens_unit_px=260"},
};
enum { CASES = sizeof cases / sizeof cases[0] };

static struct stage {
    struct small_scene small;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
    struct fv_frame_record record;
} s;
static struct fv_workers workers;

static void build_bars(void)
{
    struct fv_material m = fv_material_default();
    for (int c = 0; c < 3; c++) m.diffuse[c] = 0, m.emission[c] = 0.5f;
    int material = fv_build_material(s.small.build, &m);
    for (int i = 0; i < BARS; i++) {
        double y = 1.1 * (i - BARS / 2) + 0.07, corner[3] = {-40, y - 40 * 0.03, -2}, u[3] = {80, 80 * 0.03, 0}, v[3] = {0, 0.5, 0};
        small_plate(&s.small, corner, u, v, 1, material);
    }
}

static void begin(const struct lens_case *of)
{
    struct fv_config_request q = {.sets = 14,
                                  .set = {"display.eyes=1", "display.lens=radial", of->unit, of->k, of->red, of->blue, of->visible, "display.lens_x_px=157.3",
                                          "display.lens_y_px=178.6", "display.width=320", "display.height=352", "method.name=full", "method.spp=144",
                                          "scene.ambient=0 0 0"}};
    struct fv_error error;
    memset(&s, 0, sizeof s);
    if (fv_config_load(&s.small.config, &q, &error)) fail_msg("%s", error.text);
    s.small.build = fv_build_create("bars");
    build_bars();
    small_finish(&s.small);
    for (int c = 0; c < 3; c++) s.small.scene.sky[c] = 0.25f;
    fv_frame_size(&s.loop.frame, &s.small.config);
    fv_plan_make(&s.plan, fv_method_find("full"), &s.small.scene, &s.small.config, &s.loop.frame);
    fv_loop_open(&s.loop, &s.small.config, &s.plan, &s.small.tracer, &workers, &s.session, 1);
}

static void show(const struct fv_pose *head)
{
    static const double ahead[2][3] = {{0, 0, -1}, {0, 0, -1}};
    fv_loop_frame(&s.loop, head, ahead, 0, 0, &s.record);
    fv_pass_run(&fv_pass_present, &s.loop.frame, &workers);
    if (s.plan.fringes) fv_pass_run(&fv_pass_fringe, &s.loop.frame, &workers);
}

/* A channel's linear values. */
static void take_channel(int c, float out[HEIGHT][WIDTH])
{
    const struct fv_frame *f = &s.loop.frame;
    const uint8_t *rgbx = f->buffer[FV_PICTURE][0];
    for (int y = 0; y < HEIGHT; y++) {
        _Alignas(64) uint32_t pixel[WIDTH];
        _Alignas(64) float red[WIDTH], green[WIDTH], blue[WIDTH];
        for (int x = 0; x < WIDTH; x++) pixel[x] = (uint32_t)lround(rgbx[4 * (y * f->stride + x) + c] * 1023 / 255.0);
        f->kernels->decode(pixel, red, green, blue, WIDTH);
        memcpy(out[y], red, sizeof red);
    }
}

/* Where a channel's light at (x, y) comes from, in pinhole coordinates; and how far out it is. */
static double seen_at(int c, double x, double y, double to[2])
{
    const struct fv_bend *b = &s.loop.frame.view[0].bend;
    double d[2] = {x - (double)b->centre[0], y - (double)b->centre[1]}, q = 0, k = 1;
    for (int i = 0; i < 2; i++) q += d[i] * d[i] * (double)b->step[i] * (double)b->step[i];
    double scale = 1 + q * ((double)b->k[0] + q * ((double)b->k[1] + q * (double)b->k[2]));
    if (c != 1) k = b->channel[c / 2].c0 + b->channel[c / 2].c1 * q;
    for (int i = 0; i < 2; i++) to[i] = (double)b->centre[i] + d[i] * scale * k;
    return sqrt(q);
}

/* The line of an edge in pinhole coordinates: n . (x, y) = d, n a unit vector. */
static bool line_of(int edge, double n[2], double *d)
{
    const struct fv_view *v = &s.loop.frame.view[0];
    double at[2][2], back[4];
    fv_quat_conjugate(v->pose.rotation, back);
    for (int i = 0; i < 2; i++) {
        double x = i ? 3 : -3, y = 1.1 * (edge / 2 - BARS / 2) + 0.07 + 0.03 * x + (edge % 2) * 0.5;
        double p[3] = {x - v->pose.position_m[0], y - v->pose.position_m[1], -2 - v->pose.position_m[2]};
        fv_quat_rotate(back, p, p);
        if (!fv_lens_project(&v->lens, p, at[i])) return false;
    }
    double dx = at[1][0] - at[0][0], dy = at[1][1] - at[0][1], length = hypot(dx, dy);
    n[0] = -dy / length, n[1] = dx / length;
    *d = n[0] * at[0][0] + n[1] * at[0][1];
    return true;
}

static double off_line(int c, double x, double y, const double n[2], double d)
{
    double at[2];
    seen_at(c, x, y, at);
    return n[0] * at[0] + n[1] * at[1] - d;
}

/* How far along column x (or row x, where `turned`) the edge is on the display; -1: nowhere in the picture. */
static double expected_at(int c, int x, bool turned, const double n[2], double d)
{
    double low = 0, high = turned ? WIDTH : HEIGHT;
#define OFF(at) (turned ? off_line(c, at, x + 0.5, n, d) : off_line(c, x + 0.5, at, n, d))
    bool up = OFF(low) < OFF(high);
    if ((OFF(low) < 0) == (OFF(high) < 0)) return -1;
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        if ((OFF(middle) < 0) == up) low = middle;
        else high = middle;
    }
    return low;
}

/* The edge's place in a window around the expected one, by how much of it is of which side; -1: not clear there. */
static double found_at(float picture[HEIGHT][WIDTH], int x, bool turned, double expected)
{
    const struct fv_bend *b = &s.loop.frame.view[0].bend;
    int first = (int)floor(expected) - REACH, end = (int)floor(expected) + REACH, most = turned ? WIDTH : HEIGHT;
    double value[2 * REACH + 1], sum = 0;
    if (first < BORDER || end >= most - BORDER) return -1;
    for (int i = first; i <= end; i++) {
        int px = turned ? i : x, py = turned ? x : i;
        if (fv_bend_square(b, (float)px + 0.5f, (float)py + 0.5f) > 0.9f * b->shown * b->shown) return -1;
        value[i - first] = (double)picture[py][px];
    }
    double low = value[0], high = value[2 * REACH];
    if (fabs(low - value[1]) > 0.01 || fabs(high - value[2 * REACH - 1]) > 0.01 || fabs(low - high) < 0.08) return -1;
    for (int i = 0; i <= 2 * REACH; i++) sum += (value[i] - high) / (low - high);
    return first + sum;
}

/* Points side by side are taken together: samples in rows and columns tell an edge to a sixth of a pixel. */
struct fit {
    int count, group;
    double at[POINTS][2], stretch[POINTS], off[POINTS]; /* sums of GROUP, the last one's of `group` */
};

static void add_point(struct fit *f, const double at[2], double stretch, double off)
{
    if (f->group == 0) f->at[f->count][0] = f->at[f->count][1] = f->stretch[f->count] = f->off[f->count] = 0;
    for (int i = 0; i < 2; i++) f->at[f->count][i] += at[i] / GROUP;
    f->stretch[f->count] += stretch / GROUP;
    f->off[f->count] += off / GROUP;
    if (++f->group == GROUP) f->count++, f->group = 0;
}

/* Greatest distance of the points from the line that fits them best, in pixels of the display. */
static double bend_of(const struct fit *f)
{
    double mean[2] = {0, 0}, xx = 0, xy = 0, yy = 0, worst = 0;
    for (int i = 0; i < f->count; i++) mean[0] += f->at[i][0] / f->count, mean[1] += f->at[i][1] / f->count;
    for (int i = 0; i < f->count; i++) {
        double x = f->at[i][0] - mean[0], y = f->at[i][1] - mean[1];
        xx += x * x, xy += x * y, yy += y * y;
    }
    double angle = 0.5 * atan2(2 * xy, xx - yy);
    for (int i = 0; i < f->count; i++) {
        double off = -sin(angle) * (f->at[i][0] - mean[0]) + cos(angle) * (f->at[i][1] - mean[1]);
        worst = fmax(worst, fabs(off) / f->stretch[i]);
    }
    return worst;
}

struct verdict {
    int lines, points;
    double bent, off;
};

static void look_along(int c, int edge, bool turned, float picture[HEIGHT][WIDTH], struct verdict *v)
{
    static struct fit fit;
    double n[2], d;
    fit.count = fit.group = 0;
    if (!line_of(edge, n, &d)) return;
    for (int x = BORDER; x < (turned ? HEIGHT : WIDTH) - BORDER; x++) {
        double expected = expected_at(c, x, turned, n, d), found;
        if (expected < 0 || (found = found_at(picture, x, turned, expected)) < 0) continue;
        double px = turned ? found : x + 0.5, py = turned ? x + 0.5 : found, here[2], there[2];
        seen_at(c, px, py, here);
        seen_at(c, px + (turned ? 0.5 : 0), py + (turned ? 0 : 0.5), there);
        add_point(&fit, here, 2 * hypot(there[0] - here[0], there[1] - here[1]), found - expected);
    }
    if (fit.count < 8) return;
    for (int i = 0; i < fit.count; i++) v->off = fmax(v->off, fabs(fit.off[i]));
    v->lines++;
    v->points += fit.count;
    v->bent = fmax(v->bent, bend_of(&fit));
}

/* Pixels beyond what is seen are black, others are not; no more samples were taken than there are in blocks that show something. */
static void nothing_unseen(void)
{
    const struct fv_frame *f = &s.loop.frame;
    const struct fv_bend *b = &f->view[0].bend;
    const uint32_t *picture = f->buffer[FV_PICTURE][0];
    int64_t samples = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float square = fv_bend_square(b, (float)x + 0.5f, (float)y + 0.5f), end = b->shown * b->shown;
            bool black = (picture[y * f->stride + x] & 0xffffff) == 0;
            if (black != (square > end) && fabsf(square - end) > 1e-4f * end) fail_msg("pixel %d %d is %s", x, y, black ? "black" : "not black");
        }
    for (int y = 0; y < HEIGHT; y += FV_BLOCK)
        for (int x = 0; x < WIDTH; x += FV_BLOCK) samples += fv_bend_beyond(b, (float)x, (float)y, (float)(x + FV_BLOCK), (float)(y + FV_BLOCK), 1) ? 0 : 16 * 144;
    assert_int_equal(s.record.rays[FV_RAY_PRIMARY], samples);
    assert_true(b->masks == (samples < WIDTH * HEIGHT * 144));
    assert_true(fabs((double)s.record.sampled_fraction - (double)samples / (WIDTH * HEIGHT * 144.0)) < 1e-6);
}

static void straight_lines(void **state)
{
    (void)state;
    static float picture[HEIGHT][WIDTH];
    static const char *const channels[] = {"red", "green", "blue"};
    bool failed = false;
    fv_workers_start(&workers, 1);
    for (int k = 0; k < CASES; k++) {
        begin(&cases[k]);
        for (int turned = 0; turned < 2; turned++) {
            struct fv_pose head = {{0.1, -0.05, 0.02}, {1, 0, 0, 0}};
            fv_quat_from_yaw_pitch_roll(0.12, -0.07, turned * M_PI / 2, head.rotation);
            show(&head);
            nothing_unseen();
            for (int c = 0; c < 3; c++) {
                struct verdict v = {0};
                take_channel(c, picture);
                for (int edge = 0; edge < 2 * BARS; edge++) look_along(c, edge, turned, picture, &v);
                print_message("%s, %s, bars %s: %d lines, %d points, bent by %.3f px at most, off by %.3f\n", cases[k].name, channels[c],
                              turned ? "upright" : "across", v.lines, v.points, v.bent, v.off);
                assert_true(v.lines >= 4 && v.points >= 100);
                failed |= !(v.bent < 0.1 && v.off < (c == 1 ? 0.1 : 0.15)); /* red and blue are mixed as shown, not as traced */
            }
        }
        fv_tracer_close(&s.small.tracer);
    }
    assert_false(failed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(straight_lines)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
