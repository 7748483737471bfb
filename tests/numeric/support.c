/* support: nodes that are not traced but answered by history, against the truth: what they say of depth, how many
 * they are, that each is traced in its turn, and that none stands for what moves. */
#include "rt/frame/loop.h"
#include "rt/scene/path.h"
#include "tests/support/program.h"

#include <math.h>

enum { FRAMES = 40, SETTLED = 10, NODES_MAX = 96 /* along a side */, REACH = 4 };

static const struct shown {
    const char *scene, *spacing, *refresh, *isa;
    double turn_deg;      /* of the head, a frame */
    double traced, wrong; /* the most of all nodes beyond those whose turn it is, and of answered ones */
} table[] = {
    {"scene.name=cornell", "method.support=8", "method.support_refresh=8", "threads.isa=auto", 0.8, 0.12, 0.002},
    {"scene.name=cornell", "method.support=16", "method.support_refresh=3", "threads.isa=avx2", 0.8, 0.16, 0.001},
    {"scene.name=cornell", "method.support=4", "method.support_refresh=16", "threads.isa=base", -2.5, 0.12, 0.001},
    {"scene.name=cornell", "method.support=8", "method.support_refresh=1", "threads.isa=auto", 0.8, 0, 0},
    {"scene.name=cornell", "method.support=16", "method.support_refresh=8", "threads.isa=auto", 0, 0.2, 0.0005},
    {"scene.name=moving", "method.support=8", "method.support_refresh=8", "threads.isa=auto", 0.4, 0.2, 0.006},
};

/* Counted over a run. */
struct counts {
    int64_t nodes, traced, wrong, moving, overdue;
    double expected;
};

/* What is seen at a row of nodes and REACH pixels to its sides: history's outlines are those of coarser pixels. */
struct truth {
    float nearest[NODES_MAX], farthest[NODES_MAX];
    bool moving[NODES_MAX];
};

static void trace_row(struct fv_frame *f, int eye, int64_t y, int nodes, struct truth *truth)
{
    static const float offset[5][2] = {{0, 0}, {-REACH, 0}, {REACH, 0}, {0, -REACH}, {0, REACH}};
    struct fv_samples *s = &f->scratch[0].samples;
    const struct fv_tile tile = {.eye = eye};
    for (int k = 0; k < 5; k++) {
        s->count = nodes;
        for (int x = 0; x < nodes; x++) {
            s->x[x] = ((float)x + f->node[0]) * (float)f->spacing + offset[k][0];
            s->y[x] = ((float)y + f->node[1]) * (float)f->spacing + offset[k][1];
        }
        fv_samples_trace(f, &tile, 4);
        for (int x = 0; x < nodes; x++) {
            float w = s->inverse_depth[x];
            if (k == 0) truth->nearest[x] = truth->farthest[x] = w;
            if (k == 0) truth->moving[x] = (s->surface[x] & FV_SURFACE_OBJECT) != 0;
            truth->nearest[x] = fmaxf(truth->nearest[x], w);
            truth->farthest[x] = fminf(truth->farthest[x], w);
        }
    }
}

/* Traces every node of the frame again and judges those that were not traced. */
static void judge(struct fv_frame *f, uint8_t since[2][NODES_MAX][NODES_MAX], struct counts *c)
{
    int columns = (f->width + f->spacing - 1) / f->spacing, rows = (f->height + f->spacing - 1) / f->spacing;
    static struct truth truth;
    for (int e = 0; e < f->eyes; e++)
        for (int y = 0; y < rows; y++) {
            int64_t first = y * (f->stride / f->spacing);
            trace_row(f, e, y, columns, &truth);
            for (int x = 0; x < columns; x++) {
                float w = ((const float *)f->buffer[FV_SUPPORT_DEPTH][e])[first + x], margin = 2 * f->epsilon_depth;
                bool old = ((const uint8_t *)f->buffer[FV_SUPPORT_SURFACE][e])[first + x] & FV_SURFACE_OLD;
                uint8_t *frames = &since[e][y][x];
                c->nodes++;
                c->traced += !old;
                *frames = (uint8_t)(old ? *frames + 1 : 0);
                c->overdue += *frames >= f->support_refresh;
                if (!old) continue;
                assert_true(w >= 0 && w <= FV_INVERSE_DEPTH_MAX);
                c->wrong += w > truth.nearest[x] * (1 + margin) || w < truth.farthest[x] * (1 - margin);
                c->moving += truth.moving[x];
            }
        }
}

static struct counts run(const struct shown *t)
{
    static struct {
        struct fv_config config;
        struct fv_scene scene;
        struct fv_tracer tracer;
        struct fv_workers workers;
        struct fv_plan plan;
        struct fv_session session;
        struct fv_loop loop;
        uint8_t since[2][NODES_MAX][NODES_MAX];
    } b;
    const struct fv_config_request request = {.sets = 8,
                                              .set = {t->scene, t->spacing, t->refresh, t->isa, "display.width=384",
                                                      "display.height=352", "display.sink=none", "display.eyes=2"}};
    struct fv_frame_record record;
    struct counts c = {0};
    struct fv_error error;
    memset(&b, 0, sizeof b);
    if (fv_config_load(&b.config, &request, &error) || fv_scene_load(&b.scene, &b.config, &error) ||
        fv_tracer_open(&b.tracer, &b.scene, &b.config, &error))
        fail_msg("%s", error.text);
    fv_workers_start(&b.workers, 2);
    fv_frame_size(&b.loop.frame, &b.config);
    fv_plan_make(&b.plan, fv_method_find("reproject"), &b.scene, &b.config, &b.loop.frame);
    fv_loop_open(&b.loop, &b.config, &b.plan, &b.tracer, &b.workers, &b.session, 1);
    b.loop.frame.support_refresh = atoi(strchr(t->refresh, '=') + 1); /* also where objects move */
    const double gaze[2][3] = {{0.1, -0.1, -0.98}, {0.1, -0.1, -0.98}};
    for (int i = 0; i < FRAMES; i++) {
        struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}}, head;
        double units[2] = {0};
        int64_t t_ns = i * 13333333LL;
        fv_path_pose(&b.config.scene_path, b.config.scene_path_seconds, t->turn_deg == 0 ? 0 : t_ns, &stand);
        fv_quat_from_yaw_pitch_roll((i - FRAMES / 2) * t->turn_deg * M_PI / 180, 0, 0, turn.rotation);
        fv_pose_compose(&stand, &turn, &head);
        fv_loop_frame(&b.loop, &head, gaze, 0, t_ns, &record);
        if (i < SETTLED) continue;
        judge(&b.loop.frame, b.since, &c);
        fv_pass_support.expect(&b.loop.frame, &b.loop.frame.parameters, NULL, units);
        c.expected += units[0];
    }
    fv_workers_stop(&b.workers);
    fv_tracer_close(&b.tracer);
    return c;
}

static void answered_nodes(void **state)
{
    (void)state;
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        const struct shown *t = &table[i];
        struct counts c = run(t);
        double due = 1 / atof(strchr(t->refresh, '=') + 1), traced = (double)c.traced / (double)c.nodes;
        double wrong = (double)c.wrong / (double)c.nodes, expected = c.expected / (double)c.nodes;
        printf("%s %s %s turning %.1f: traced %.4f (due %.4f, expected %.4f), wrong %.5f\n", t->scene, t->spacing,
               t->refresh, t->turn_deg, traced, due, expected, wrong);
        assert_int_equal(c.overdue, 0);
        assert_int_equal(c.moving, 0);
        assert_true(traced >= 0.98 * due && traced <= due + t->traced);
        assert_true(wrong <= t->wrong);
        assert_true(fabs(expected - traced) < 0.01 * traced);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(answered_nodes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
