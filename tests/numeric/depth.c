/* depth: the ways to interpolate depth, on nodes whose pixels are known, and on a traced wall and floor.
 * Every instruction set that the machine has. */
#include "rt/measure/depth.h"
#include "tests/support/small_scene.h"

enum { RUNS = 3 };

/* Four nodes in a row, two rows of them: what each method must give in the middle run. `x`: the pixel of
 * 8 in the run, `down`: between the rows. */
static const struct {
    const char *what;
    float upper[4], lower[4], down;
    int x;
    double want[FV_DEPTH_METHODS]; /* nearest, inverse, linear, front: inverse depths */
} cases[] = {
    {"constant", {0.5f, 0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f, 0.5f}, 0.3f, 2, {0.5, 0.5, 0.5, 0.5}},
    {"slope to the right", {0, 1, 2, 3}, {0, 1, 2, 3}, 0.25f, 1, {1, 1.1875, 1 / (1 - 0.5 * 0.1875), 2}},
    {"slope down, lower half", {1, 1, 1, 1}, {2, 2, 2, 2}, 0.75f, 5, {2, 1.75, 1.6, 2}},
    {"an edge, left of its middle", {1, 1, 0.1f, 0.1f}, {1, 1, 0.1f, 0.1f}, 0, 3,
     {1, 1 - 0.9 * 0.4375, 1 / (1 + 9 * 0.4375), 1}},
    {"an edge, right of its middle", {1, 1, 0.1f, 0.1f}, {1, 1, 0.1f, 0.1f}, 0, 4,
     {0.1, 1 - 0.9 * 0.5625, 1 / (1 + 9 * 0.5625), 1}},
    {"nothing hit", {0, 0, 0, 0}, {0, 0, 0, 0}, 0.5f, 0, {0, 0, 1e-6, 0}},
    {"the sky beside a wall", {1, 1, 0, 0}, {1, 1, 0, 0}, 0.5f, 6, {0, 0.1875, 1 / (1 + 999999 * 0.8125), 1}},
    {"a wall at 1e-4 m", {1e4f, 1e4f, 1e4f, 1e4f}, {1e4f, 1e4f, 1e4f, 1e4f}, 0.5f, 6, {1e4, 1e4, 1e4, 1e4}},
    {"hits at 1e6 m", {1e-6f, 1e-6f, 1e-6f, 1e-6f}, {1e-6f, 1e-6f, 1e-6f, 1e-6f}, 0.9f, 7, {1e-6, 1e-6, 1e-6, 1e-6}},
};

static void known_nodes(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++)
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)
            for (int m = 0; m < FV_DEPTH_METHODS; m++) {
                const struct fv_depth_method *method = &fv_depth_methods((enum fv_isa)isa)[m];
                float out[RUNS * 8];
                struct fv_depth_span span = {cases[n].upper, cases[n].lower, cases[n].down, RUNS, 8, out};
                method->row(&span);
                double got = (double)out[8 + cases[n].x], want = cases[n].want[m];
                if (!(fabs(got - want) <= 2e-6 * want))
                    fail_msg("%s, %s (%s): %.9g, must be %.9g", cases[n].what, method->name, fv_cpu_isa_name((enum fv_isa)isa),
                             got, want);
            }
}

/* All spacings cover the same pixels: a plane's inverse depth, linear in the picture, comes out exactly. */
static void planes_at_all_spacings(void **state)
{
    (void)state;
    for (int spacing = 4; spacing <= 16; spacing *= 2) {
        float upper[6], lower[6], out[5 * 16];
        for (int i = 0; i < 6; i++) {
            upper[i] = 0.1f + 0.01f * (float)(i * spacing);
            lower[i] = upper[i] + 0.02f * (float)spacing;
        }
        struct fv_depth_span span = {upper, lower, 0.25f, 5, spacing, out};
        fv_depth_methods(fv_cpu_isa())[FV_DEPTH_INVERSE].row(&span);
        for (int x = 0; x < 5 * spacing; x++)
            assert_true(fabs((double)out[x] - (0.1 + 0.01 * (x + 0.5) + 0.005 * spacing)) < 1e-6);
    }
}

/* In a room: what holds of the methods by their nature, and a picture whose size no spacing divides. */
static void a_room(void **state)
{
    (void)state;
    static struct small_scene s;
    static struct fv_workers workers;
    static const double walls[][9] = {{-3, -1, -9, 6, 0, 0, 0, 4, 0}, {-3, -1, 1, 6, 0, 0, 0, 0, -10}};
    double at[3] = {0, 0, 0}, no_turn[4] = {1, 0, 0, 0};
    struct fv_material white = fv_material_default();
    struct fv_depth_row row[FV_DEPTH_ROWS];
    small_begin(&s);
    int m = fv_build_material(s.build, &white);
    for (int w = 0; w < 2; w++) small_plate(&s, walls[w], walls[w] + 3, walls[w] + 6, 3, m);
    small_finish(&s);
    struct fv_view view = small_view(at, no_turn, 30, 201);
    fv_workers_start(&workers, 2);
    assert_int_equal(fv_depth_measure(&s.tracer, &view, &workers, row, NULL), FV_DEPTH_ROWS);
    for (int i = 0; i < FV_DEPTH_ROWS; i++) {
        assert_int_equal(row[i].spacing, 4 << i / FV_DEPTH_METHODS);
        if (!(row[i].error_p50 >= 0 && row[i].error_p50 <= row[i].error_p95 && row[i].error_p95 <= 1 && row[i].ns_pixel > 0))
            fail_msg("%s, %d: %g %g, %g ns", row[i].method, row[i].spacing, row[i].error_p50, row[i].error_p95, row[i].ns_pixel);
        /* Planes are exact in inverse depth. */
        if (i % FV_DEPTH_METHODS == FV_DEPTH_INVERSE) assert_true(row[i].error_p50 < 1e-6);
        else if (i % FV_DEPTH_METHODS == FV_DEPTH_LINEAR) assert_true(row[i].error_p95 > 1e-6);
        /* A node of four times the spacing errs more. */
        if (i >= 2 * FV_DEPTH_METHODS && i % FV_DEPTH_METHODS != FV_DEPTH_INVERSE)
            assert_true(row[i].error_p95 > row[i - 2 * FV_DEPTH_METHODS].error_p95);
    }
    volatile int stopped = 1;
    assert_int_equal(fv_depth_measure(&s.tracer, &view, &workers, row, &stopped), 0);
    /* Looking away from it all: no pixel hits, no error to speak of. */
    double back[4] = {0, 1, 0, 0};
    view = small_view(at, back, 1, 16);
    assert_int_equal(fv_depth_measure(&s.tracer, &view, &workers, row, NULL), FV_DEPTH_ROWS);
    for (int i = 0; i < FV_DEPTH_ROWS; i++) assert_true(isnan(row[i].error_p50) && isnan(row[i].error_p95));
    fv_workers_stop(&workers);
    fv_tracer_close(&s.tracer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(known_nodes), cmocka_unit_test(planes_at_all_spacings),
                                       cmocka_unit_test(a_room)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
