/* late: the real loop on a made-up clock, on which some frames miss their flips: their pictures are turned to where the
 * head is at the flip that they are shown at, and the others left alone; what was decided makes the same pictures again. */
#include "rt/pass/turn.h"
#include "tests/support/stage.h"

enum { SIDE = 96, FRAMES = 24, BYTES = 4 * SIDE * SIDE };
static const int64_t period_ns = 10000000;

/* What a frame takes, in periods, at the end of which the next flip is aimed at. */
static double takes(int64_t frame)
{
    static const double times[8] = {0.2, 0.5, 1.4, 0.3, 2.7, 0.9, 0.1, 1.01};
    return times[frame % 8];
}

/* A run: its loop, its clock, and what came of it. */
static struct run {
    struct stage stage;
    bool open;
    int64_t now_ns, frame;
    int heads_asked; /* of late pictures, of this frame */
    int64_t late_ns[FRAMES];
    struct fv_decision decision[FRAMES];
    bool turned[FRAMES];
    uint8_t shown[FRAMES][BYTES];
} paced, again, alone;

static struct run *running;
static const struct run *followed; /* whose decisions are replayed */
static double behind_ns, turns_by_deg; /* how long turning is said to take; how far heads turn while a picture is late, 0: on */

static int64_t now_ns(void *context)
{
    (void)context;
    return running->now_ns++;
}

static void sleep_until_ns(void *context, int64_t t_ns)
{
    (void)context;
    if (t_ns > running->now_ns) running->now_ns = t_ns;
}

static const struct fv_clock clock_made_up = {now_ns, now_ns, sleep_until_ns, NULL};

/* A head that turns at 100 degrees a second where the scene's path begins. */
static void head_at(int64_t show_ns, double more_deg, struct fv_pose *head)
{
    struct fv_pose stand, turn = {{0, 0, 0}, {1, 0, 0, 0}};
    fv_path_pose(&running->stage.config.scene_path, running->stage.config.scene_path_seconds, 0, &stand);
    fv_quat_from_yaw_pitch_roll((1e-7 * (double)show_ns + more_deg) * M_PI / 180, 0, 0, turn.rotation);
    fv_pose_compose(&stand, &turn, head);
}

static void latch(void *context, int64_t latched_ns, int64_t show_ns, struct fv_pose *head, double gaze[2][3], double *uncertainty_deg)
{
    (void)context;
    assert_true(latched_ns <= show_ns);
    head_at(show_ns, 0, head);
    gaze[0][0] = gaze[0][1] = 0;
    gaze[0][2] = -1;
    memcpy(gaze[1], gaze[0], sizeof gaze[1]);
    *uncertainty_deg = 0;
    running->heads_asked = 0;
    running->stage.loop.late.turn_ns.held = behind_ns;
}

static void newest(void *context, int64_t latched_ns, int64_t show_ns, struct fv_pose *head)
{
    (void)context;
    assert_true(latched_ns <= show_ns && running->heads_asked++ == 0);
    running->late_ns[running->frame] = show_ns;
    head_at(show_ns, turns_by_deg, head);
    if (isnan(turns_by_deg)) head->rotation[2] = NAN;
}

/* Before it is presented, the frame has taken its time: flips are half a period before what they show is. */
static bool wants(void *context, int64_t frame, bool last)
{
    (void)context, (void)last;
    running->frame = frame;
    running->now_ns += (int64_t)(takes(frame) * (double)period_ns);
    return true;
}

static void present(void *context, const struct fv_frame *f)
{
    (void)context;
    for (int y = 0; y < SIDE; y++)
        memcpy(running->shown[running->frame] + 4 * SIDE * y, (const uint32_t *)f->buffer[FV_PICTURE][0] + y * f->stride, 4 * SIDE);
}

static bool decided(void *context, int64_t frame, struct fv_decision *decision)
{
    (void)context;
    *decision = followed->decision[frame];
    return true;
}

static bool after(void *context, const struct fv_session *session, const struct fv_frame_record *r)
{
    (void)context, (void)session;
    running->decision[r->frame] = r->decision;
    running->turned[r->frame] = r->turned;
    assert_true(r->turned ? r->decision.late_ns > r->t_ns : true);
    return true;
}

static void begin(struct run *r, const char *const *more)
{
    static const char *const sets[] = {"scene.name=cornell", "scene.path_seconds=0", "method.name=full", "display.sink=png",
                                       "budget.pace=vsync", "budget.hz=100", "display.ipd_mm=0", NULL};
    if (r->open) stage_close(&r->stage);
    memset(r, 0, sizeof *r);
    r->open = true;
    r->now_ns = 1;
    stage_begin(&r->stage, SIDE, sets, more, stage_workers());
    r->stage.loop.clock = r->stage.loop.budget.schedule.clock = &clock_made_up;
}

static void run(struct run *r, const struct run *of, const char *const *more)
{
    struct fv_loop_io io = {.latch = latch, .wants = wants, .present = present, .after = after, .newest = newest};
    if (of) io.decided = decided;
    followed = of;
    running = r;
    begin(r, more);
    fv_loop_run(&r->stage.loop, &io, FRAMES);
}

/* What frame n (whose number seeds its light) at a session time looks like, turned to the head at another; 0: not. */
static const uint8_t *expected(int n, int64_t show_ns, int64_t late_ns)
{
    static uint8_t picture[BYTES];
    struct fv_pose head;
    struct fv_frame *f = &alone.stage.loop.frame;
    struct run *before = running;
    running = &alone;
    head_at(show_ns, 0, &head);
    f->number = n;
    stage_frame_from(&alone.stage, &head, 0, 0);
    fv_pass_run(&fv_pass_present, f, stage_workers());
    const uint32_t *from = f->buffer[FV_PICTURE][0];
    if (late_ns) {
        head_at(late_ns, turns_by_deg, &head);
        assert_true(fv_turn_set(f, &head));
        fv_pass_run(&fv_pass_turn, f, stage_workers());
        from = f->buffer[FV_TURNED][0];
    }
    for (int y = 0; y < SIDE; y++) memcpy(picture + 4 * SIDE * y, from + y * f->stride, 4 * SIDE);
    running = before;
    return picture;
}

/* Frames are begun a period before their flips: late are those that take longer, by as many flips as they pass. */
static void late_pictures_are_turned(void **state)
{
    (void)state;
    int late = 0;
    behind_ns = turns_by_deg = 0;
    run(&paced, NULL, NULL);
    running = &alone;
    begin(&alone, NULL);
    for (int n = 0; n < FRAMES; n++) {
        int64_t flips = (int64_t)takes(n), late_ns = flips ? paced.decision[n].t_ns + flips * period_ns : 0;
        late += flips > 0;
        assert_true(paced.turned[n] == (flips > 0));
        assert_int_equal(paced.decision[n].late_ns, late_ns);
        assert_int_equal(paced.late_ns[n], late_ns);
        assert_memory_equal(paced.shown[n], expected(n, paced.decision[n].t_ns, late_ns), BYTES);
        if (late_ns) assert_memory_not_equal(paced.shown[n], expected(n, paced.decision[n].t_ns, 0), BYTES);
        if (n > 0) assert_true(paced.decision[n].t_ns > paced.decision[n - 1].t_ns && paced.decision[n].t_ns > paced.decision[n - 1].late_ns);
    }
    assert_int_equal(paced.stage.session.late_corrected, late);
    assert_int_equal(paced.stage.session.missed, late);
    assert_true(late == 9 && paced.stage.loop.late.said);
    assert_string_equal(paced.stage.session.stage[paced.stage.session.stages - 1], "turn");
}

static void decisions_make_the_same(void **state)
{
    (void)state;
    run(&again, &paced, NULL);
    assert_int_equal(again.stage.session.late_corrected, paced.stage.session.late_corrected);
    assert_memory_equal(again.shown, paced.shown, sizeof paced.shown);
    assert_memory_equal(again.late_ns, paced.late_ns, sizeof paced.late_ns);
    for (int n = 0; n < FRAMES; n++) assert_int_equal(again.decision[n].late_ns, paced.decision[n].late_ns);
}

/* The picture stays as it was rendered: where the head is none, or has turned too far. */
static void odd_heads_leave_it(void **state)
{
    static const double odd[] = {(double)NAN, 75, -170};
    (void)state;
    for (int i = 0; i < 3; i++) {
        behind_ns = 0, turns_by_deg = odd[i];
        run(&again, NULL, NULL);
        turns_by_deg = 0;
        assert_int_equal(again.stage.session.late_corrected, 0);
        assert_int_equal(again.stage.session.missed, paced.stage.session.missed);
        for (int n = 0; n < FRAMES; n += 5) assert_memory_equal(again.shown[n], expected(n, again.decision[n].t_ns, 0), BYTES);
    }
}

/* Where turning would take beyond the next flip, too, the picture is shown as it is, and no head is asked for. */
static void never_later_for_being_turned(void **state)
{
    (void)state;
    behind_ns = 0.5 * (double)period_ns, turns_by_deg = 0;
    run(&again, NULL, NULL);
    for (int n = 0; n < FRAMES; n++) {
        double part = takes(n) - floor(takes(n));
        assert_true(again.turned[n] == (takes(n) >= 1 && part < 0.5));
        assert_int_equal(again.decision[n].t_ns, paced.decision[n].t_ns);
    }
    behind_ns = 0;
}

static void settings_leave_it_out(void **state)
{
    static const char *const hold[] = {"display.late=hold", NULL}, *const free_run[] = {"budget.pace=free", NULL},
                      *const unseen[] = {"display.sink=none", NULL};
    const char *const *const sets[] = {hold, free_run, unseen};
    (void)state;
    for (int i = 0; i < 3; i++) {
        running = &again;
        begin(&again, sets[i]);
        assert_false(again.stage.plan.turns);
        assert_null(again.stage.loop.frame.buffer[FV_TURNED][0]);
        if (i == 2) continue;
        run(&again, NULL, sets[i]);
        assert_int_equal(again.stage.session.late_corrected, 0);
        for (int n = 0; n < FRAMES; n++) assert_true(again.late_ns[n] == 0 && again.decision[n].late_ns == 0);
        for (int n = 0; n < FRAMES; n += 5) assert_memory_equal(again.shown[n], expected(n, again.decision[n].t_ns, 0), BYTES);
    }
}

/* Said once when frames begin to be late, and once when they have not been for a while. */
static void told_by_changes(void **state)
{
    struct fv_late late = {.said = false};
    int changes = 0;
    (void)state;
    for (int n = 0; n < 1000; n++) {
        bool said = late.said, missed = n >= 50 && n < 300 && n % 40 == 0;
        fv_late_tell(&late, missed, missed);
        changes += late.said != said;
        if (n == 79) assert_false(late.said);
        if (n == 80 || n == 280 + FV_LATE_TIMELY - 1) assert_true(late.said);
        if (n == 280 + FV_LATE_TIMELY) assert_false(late.said);
    }
    assert_int_equal(changes, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(late_pictures_are_turned), cmocka_unit_test(decisions_make_the_same),
        cmocka_unit_test(odd_heads_leave_it),       cmocka_unit_test(never_later_for_being_turned),
        cmocka_unit_test(settings_leave_it_out),    cmocka_unit_test(told_by_changes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
