/* imu_probe SECONDS [KEY=VALUE...]: the head from imu.source=usb, latched 90 times a second with the heap sealed and
 * the sensor's thread kept to its list of system calls, as `run` does; then what was counted, one `name value` a line. Runs in the virtual machine of tests/vm. */
#include "platform/clock.h"
#include "platform/heap.h"
#include "platform/log.h"
#include "platform/sandbox.h"
#include "sensors/imu/usb_memory.h"
#include "sensors/sensors.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static void latch(struct fv_sensors *sensors, double seconds)
{
    const struct fv_clock *clock = &fv_clock_monotonic;
    int64_t begun_ns = fv_clock_now_ns(clock), t_ns = begun_ns, period_ns = 11111111;
    struct fv_pose head = {.rotation = {1, 0, 0, 0}}, before;
    struct fv_gaze gaze;
    double turned_deg = 0, fastest_deg = 0;
    while (t_ns - begun_ns < (int64_t)(1e9 * seconds)) {
        before = head;
        fv_sensors_latch(sensors, t_ns - begun_ns, t_ns - begun_ns + period_ns, &head, &gaze);
        double step_deg = fv_quat_angle(before.rotation, head.rotation) * 180 / M_PI;
        turned_deg += step_deg;
        fastest_deg = fmax(fastest_deg, step_deg);
        fv_clock_sleep_until_ns(clock, t_ns += period_ns);
    }
    fv_log_line("turned_deg %.3f", turned_deg);
    fv_log_line("fastest_deg %.3f", fastest_deg);
}

int main(int count, char **text)
{
    static struct fv_config config;
    struct fv_config_request request = {.sets = 2, .set = {"imu.source=usb", "eye.source=none"}};
    struct fv_sensors *sensors;
    struct fv_error error;
    fv_sandbox_ask(true);
    for (int i = 2; i < count; i++) request.set[request.sets++] = text[i];
    if (fv_config_load(&config, &request, &error) || fv_sensors_open(&sensors, &config, &error)) {
        fv_log("%s", error.text);
        _exit(2);
    }
    fv_heap_seal(false);
    latch(sensors, count > 1 ? atof(text[1]) : 1);
    fv_sensors_close(sensors);
    struct fv_sensors_counts c = fv_sensors_counts(sensors);
    struct fv_usb_memory_counts m = fv_usb_memory_counts();
    fv_log_line("lost %lld", (long long)c.imu_lost);
    fv_log_line("rejected %lld", (long long)c.imu_rejected);
    fv_log_line("reconnects %lld", (long long)c.imu_reconnects);
    fv_log_line("heap_calls %lld", (long long)(fv_heap_calls() + fv_heap_system_calls()));
    fv_log_line("usb_bytes %lld", (long long)m.bytes);
    fv_log_line("usb_refused %lld", (long long)m.refused);
    _exit(0);
}
