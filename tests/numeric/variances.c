/* variances: what paths tell of how much their mean varies (rt/trace/path.h, `variance` of struct fv_samples) against how much it does
 * over frames; and a tile's variances evened out (rt/pass/denoise_kernel.c). On every instruction set. */
#include "rt/pass/denoise.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

#include "rt/fovea/foveal.h"

static struct fv_samples samples;
static const double at[3] = {0.1, 0.2, 1.5}, ahead[4] = {1, 0, 0, 0};

/* A floor and a wall, two points and an area light. */
static void open_room(struct small_scene *s, int lights)
{
    static const struct fv_light all[] = {{FV_LIGHT_POINT, {0.3f, 0.5f, 0.2f}, {0}, {0}, {1, 2, 1}},
                                          {FV_LIGHT_POINT, {-0.6f, 0.1f, -0.5f}, {0}, {0}, {0.5f, 0.1f, 0.2f}},
                                          {FV_LIGHT_AREA, {-0.4f, 0.9f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f}, {2, 1, 3}}};
    struct fv_material m = fv_material_default();
    for (int c = 0; c < 3; c++) m.diffuse[c] = 0.6f;
    small_begin(s);
    int material = fv_build_material(s->build, &m);
    small_plate(s, (double[]){-2, -1, 2}, (double[]){4, 0, 0}, (double[]){0, 0, -4}, 3, material);
    small_plate(s, (double[]){-2, -1, -1}, (double[]){4, 0, 0}, (double[]){0, 3, 0}, 3, material);
    small_finish(s);
    for (int c = 0; c < 3; c++) s->scene.ambient[c] = 0, s->scene.sky[c] = 0;
    s->scene.lights = lights;
    for (int i = 0; i < lights; i++) s->scene.light[i] = all[i];
    s->scene.features |= FV_SCENE_POINT_LIGHTS | FV_SCENE_AREA_LIGHTS;
}

static void trace(const struct small_scene *s, int bounces, int paths, uint32_t frame)
{
    struct fv_view view = small_view(at, ahead, 60, 32);
    int64_t rays[FV_RAY_KINDS] = {0};
    small_grid(&samples, &view);
    samples.bounces = bounces;
    samples.noise = fv_noise();
    for (int i = 0; i < samples.count; i++) samples.paths[i] = paths;
    fv_kernels(s->tracer.isa)->paths(&s->tracer, &view, &samples, frame, rays);
}

static double luma(int i)
{
    return 0.25 * (double)(samples.light_red[i] + samples.light_blue[i]) + 0.5 * (double)samples.light_green[i];
}

/* What is told is never below what is: paths are taken for independent, and are spread more evenly than that. */
static void paths_tell_how_they_vary(void **state)
{
    (void)state;
    static struct small_scene s;
    static double sum[FV_SAMPLES_MAX], squares[FV_SAMPLES_MAX];
    static const int paths[] = {2, 4, 8};
    enum { FRAMES = 128 };
    open_room(&s, 3);
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++)
        for (int k = 0; k < 3; k++) {
            double told = 0, is = 0;
            memset(sum, 0, sizeof sum), memset(squares, 0, sizeof squares);
            for (uint32_t frame = 0; frame < FRAMES; frame++) {
                trace(&s, 1, paths[k], frame);
                for (int i = 0; i < samples.count; i++) {
                    double l = luma(i);
                    sum[i] += l, squares[i] += l * l, told += (double)samples.variance[i] / FRAMES;
                }
            }
            for (int i = 0; i < samples.count; i++) is += (squares[i] - sum[i] * sum[i] / FRAMES) / (FRAMES - 1);
            print_message("%d paths (%s): variance %.5f, told %.5f, %.2f times\n", paths[k], small_isas[isa], is, told, told / is);
            assert_true(told > 0.8 * is && told < 6 * is);
        }
    fv_tracer_close(&s.tracer);
}

/* Points that are shared out, and nothing drawn: none, though each path brings another light. A single path: its square. */
static void what_is_not_drawn_does_not_vary(void **state)
{
    (void)state;
    static struct small_scene s;
    open_room(&s, 2);
    for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++) {
        trace(&s, 0, 4, 1);
        double lit = 0;
        for (int i = 0; i < samples.count; i++) lit += luma(i), assert_true(samples.variance[i] == 0);
        assert_true(lit > 1);
        trace(&s, 0, 1, 1);
        for (int i = 0; i < samples.count; i++) {
            double square = luma(i) * luma(i);
            if (!(fabs((double)samples.variance[i] - square) <= 1e-4 * square)) fail_msg("%g of %g", (double)samples.variance[i], square);
        }
        trace(&s, 0, 0, 1);
        for (int i = 0; i < samples.count; i++) assert_true(samples.variance[i] == 0);
        s.scene.light[0].colour[1] = 3e38f, s.scene.light[1].colour[0] = NAN;
        trace(&s, 1, 3, 1);
        for (int i = 0; i < samples.count; i++) assert_true(samples.variance[i] >= 0);
        s.scene.light[0].colour[1] = 2, s.scene.light[1].colour[0] = 0.5f;
    }
    fv_tracer_close(&s.tracer);
}

static void trace_apart(const struct small_scene *s, bool apart, int paths, double total[FV_SAMPLES_MAX], double base[FV_SAMPLES_MAX])
{
    samples.apart = apart;
    trace(s, 0, paths, 1);
    samples.apart = false;
    for (int i = 0; i < samples.count; i++) {
        base[i] = (double)samples.green[i];
        total[i] = base[i] + (double)samples.albedo_green[i] * (double)samples.light_green[i];
    }
}

/* The same whole; of what is left out, all of it that is steady; where paths are fewer than lights, nothing is. */
static void steady_light_apart(void **state)
{
    (void)state;
    static struct small_scene s;
    static double whole[FV_SAMPLES_MAX], total[FV_SAMPLES_MAX], base[FV_SAMPLES_MAX], left[FV_SAMPLES_MAX], none[FV_SAMPLES_MAX];
    for (int lights = 2; lights <= 3; lights++) {
        open_room(&s, lights);
        for (int isa = 0; isa < 3 && small_reopen(&s, isa); isa++) {
            double sum = 0;
            trace_apart(&s, false, 4, whole, base);
            for (int i = 0; i < samples.count; i++) assert_true(base[i] == 0);
            trace_apart(&s, true, 4, total, base);
            for (int i = 0; i < samples.count; i++) {
                sum += base[i];
                if (!(fabs(total[i] - whole[i]) <= 1e-4 * whole[i])) fail_msg("%g, not %g", total[i], whole[i]);
                if (lights == 2 && samples.light_green[i] != 0) fail_msg("%g is not steady", (double)samples.light_green[i]);
            }
            assert_true(sum > 1);
            trace_apart(&s, true, -4, left, none);
            for (int i = 0; i < samples.count; i++)
                if (!(fabs(left[i] - base[i]) <= 1e-4 * base[i])) fail_msg("left out: %g, not %g", left[i], base[i]);
            trace_apart(&s, true, -1, left, none);
            for (int i = 0; i < samples.count; i++) assert_true(left[i] == 0);
        }
        fv_tracer_close(&s.tracer);
    }
}

static struct fv_variances tile;

static void set(int x, int y, float variance)
{
    tile.variance[y][FV_VARIANCE_EDGE + x] = variance;
    tile.counts[y][FV_VARIANCE_EDGE + x] = 1;
}

static void evened_out(void **state)
{
    (void)state;
    for (int isa = 0; isa < 3 && isa <= (int)fv_cpu_isa(); isa++) {
        struct fv_variances was;
        memset(&tile, 0, sizeof tile);
        for (int y = 0; y < FV_TILE; y++)
            for (int x = 0; x < FV_TILE; x++)
                if ((x * 7 + y * 3) % 5 && x < 29) set(x, y, (float)((x * 31 + y * 17) % 13));
        was = tile;
        fv_kernels((enum fv_isa)isa)->even_out(&tile);
        for (int y = 0; y < FV_TILE; y++)
            for (int x = 0; x < FV_TILE; x++) {
                double sum = 0, count = 0;
                for (int v = y - FV_VARIANCE_REACH; v <= y + FV_VARIANCE_REACH; v++)
                    for (int u = x - FV_VARIANCE_REACH; u <= x + FV_VARIANCE_REACH; u++)
                        if (v >= 0 && v < FV_TILE && u >= 0 && u < FV_TILE) {
                            sum += (double)was.variance[v][FV_VARIANCE_EDGE + u];
                            count += (double)was.counts[v][FV_VARIANCE_EDGE + u];
                        }
                double want = count > 0 ? sum / count : 0, got = (double)tile.variance[y][FV_VARIANCE_EDGE + x];
                if (!(fabs(got - want) <= 1e-5 * want)) fail_msg("(%d, %d): %g, not %g", x, y, got, want);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(paths_tell_how_they_vary), cmocka_unit_test(what_is_not_drawn_does_not_vary), cmocka_unit_test(steady_light_apart),
                                       cmocka_unit_test(evened_out)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
