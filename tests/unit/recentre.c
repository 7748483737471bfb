/* recentre: where the head looks when it is asked for is straight ahead from then on: heading and place are taken
 * away, and what is up stays up. */
#include "cli/cli.h"

#include "tests/support/opened_sensors.h"

#include <math.h>

static const double ahead[3] = {0, 0, -1}, up[3] = {0, 1, 0};

static void latch(struct fv_setup *s, int64_t t_ns, struct fv_pose *relative)
{
    struct fv_gaze gaze;
    struct fv_pose head;
    fv_setup_latch(s, t_ns, t_ns, relative, &gaze, &head);
    assert_true(fv_pose_sound(relative) && fv_pose_sound(&head));
}

static void heading_and_place(void **state)
{
    (void)state;
    static struct fv_setup turned, plain;
    struct fv_pose a, b;
    struct fv_error error;
    struct fv_config_request request = {.sets = 2, .set = {"imu.source=sim", "eye.source=none"}};
    assert_int_equal(fv_config_load(&turned.config, &request, &error), 0);
    plain.config = turned.config;
    turned.sensors = opened(&turned.config);
    plain.sensors = opened(&turned.config);
    for (int i = 0; i < 2000; i++) {
        int64_t t_ns = i * INT64_C(13333333);
        if (i % 300 == 100) turned.recentre = true;
        latch(&turned, t_ns, &a);
        latch(&plain, t_ns, &b);
        double looks[3], above[3], was_looks[3], was_above[3];
        fv_quat_rotate(a.rotation, ahead, looks), fv_quat_rotate(b.rotation, ahead, was_looks);
        fv_quat_rotate(a.rotation, up, above), fv_quat_rotate(b.rotation, up, was_above);
        assert_true(fabs(looks[1] - was_looks[1]) < 1e-12 && fabs(above[1] - was_above[1]) < 1e-12);
        if (i < 100) assert_memory_equal(&a, &b, sizeof a);
        if (i % 300 != 100) continue;
        assert_false(turned.recentre);
        assert_true(fabs(looks[0]) < 1e-12 && looks[2] < 0);
        for (int k = 0; k < 3; k++) assert_true(fabs(a.position_m[k]) < 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(heading_and_place)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
