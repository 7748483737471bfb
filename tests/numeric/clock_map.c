/* clock_map: made-up devices whose clocks drift, wrap, jump and stop, and reports that come late: host times against
 * the true ones. Latencies begin at 0.2 ms, which no map can see: errors are beyond that. */
#include "sensors/imu/clock_map.h"

#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>

static struct fv_clock_map map;

/* A device at 1 kHz for a while. Errors of the times given out, after the first 5 s, in microseconds. */
static const struct {
    const char *what;
    double tick_ns, start_s, drift_ppm, jitter_ms, seconds, most_us;
    int bits;
} devices[] = {
    {"48 MHz", 1000.0 / 48, 0, 0, 0, 60, 2, 32},
    {"48 MHz, wraps", 1000.0 / 48, 80, 0, 0, 300, 2, 32},
    {"drifts, jitters", 1000.0 / 48, 80, 80, 2, 300, 60, 32},
    {"drifts the other way", 1000.0 / 48, 80, -80, 2, 300, 60, 32},
    {"a poor resonator", 1000, 0, 900, 1, 100, 60, 32},
    {"16 bits of microseconds", 1000, 0, 50, 5, 100, 150, 16},
    {"64 bits of 100 ns", 100, 1e9, 50, 2, 100, 60, 64},
    {"a day", 1000.0 / 48, 0, 30, 2, 86400, 100, 32},
};

static void follows(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof devices / sizeof devices[0]; n++) {
        uint64_t dice = n, step_ns = devices[n].seconds > 1000 ? 50000000 : 1000000;
        int64_t first_ns = INT64_C(5000000000), last_ns = INT64_MIN;
        double worst = 0;
        fv_clock_map_begin(&map, devices[n].tick_ns, devices[n].bits, 1e-3);
        for (int64_t t = 0; t < (int64_t)(devices[n].seconds * 1e9); t += (int64_t)step_ns) {
            double device_ns = devices[n].start_s * 1e9 + (double)t * (1 + devices[n].drift_ppm * 1e-6);
            uint64_t counter = (uint64_t)(device_ns / devices[n].tick_ns);
            if (devices[n].bits < 64) counter &= (UINT64_C(1) << devices[n].bits) - 1;
            double latency_ms = 0.2 - devices[n].jitter_ms * log(random_between(&dice, 1e-3, 1)) / 3;
            int64_t arrival_ns = first_ns + t + (int64_t)(latency_ms * 1e6);
            int64_t ticks = fv_clock_map_unwrap(&map, counter, arrival_ns);
            fv_clock_map_arrive(&map, counter, arrival_ns);
            int64_t got = fv_clock_map_host_ns(&map, ticks);
            assert_true(got > last_ns);
            last_ns = got;
            if (t > INT64_C(5000000000)) worst = fmax(worst, fabs((double)(got - first_ns - t) * 1e-3 - 200));
        }
        if (!(worst <= devices[n].most_us) || map.restarts)
            fail_msg("%s: %g us off, %d restarts", devices[n].what, worst, (int)map.restarts);
    }
}

/* After 10 s the device's or the host's time jumps; how many restarts, and that 2 s later all is well again. */
static const struct {
    const char *what;
    double device_s, late_s, late_for_s; /* the jump; reports late by so much, for so long */
    int restarts;
} jumps[] = {
    {"forward by 30 s", 30, 0, 0, 1},   {"forward by 2 s", 2, 0, 0, 1},
    {"back by 2 s", -2, 0, 0, 1},       {"begins again", -10, 0, 0, 1},
    {"half a wrap", 44.739, 0, 0, 1},   {"forward by half a second", 0.5, 0, 0, 1},
    {"held up for 2 s", 0, 2, 0.03, 0}, {"all late by 2 s", 0, 2, 100, 1},
};

static void restarts(void **state)
{
    (void)state;
    for (unsigned n = 0; n < sizeof jumps / sizeof jumps[0]; n++) {
        int64_t last_ns = INT64_MIN, late_ns = (int64_t)(jumps[n].late_s * 1e9);
        double off = NAN;
        fv_clock_map_begin(&map, 1000.0 / 48, 32, 1e-3);
        for (int64_t t = 0; t < INT64_C(14000000000); t += 1000000) {
            double device_s = 60 + (double)t * 1e-9;
            bool after = t >= INT64_C(10000000000);
            if (after) device_s += jumps[n].device_s;
            bool late = after && (double)(t - INT64_C(10000000000)) < jumps[n].late_for_s * 1e9;
            uint32_t counter = (uint32_t)(uint64_t)(device_s * 48e6);
            int64_t arrival_ns = t + (late ? late_ns : 0);
            fv_clock_map_arrive(&map, counter, arrival_ns);
            int64_t got = fv_clock_map_host_ns(&map, fv_clock_map_unwrap(&map, counter, arrival_ns));
            assert_true(got > last_ns);
            last_ns = got;
            off = (double)(got - t) * 1e-9;
        }
        double want = jumps[n].late_for_s > 1 ? jumps[n].late_s : 0;
        if (map.restarts != jumps[n].restarts || !(fabs(off - want) < 0.002))
            fail_msg("%s: %d restarts, %g s off", jumps[n].what, (int)map.restarts, off);
    }
}

/* Any counters at any times: always later than the one before, never a trap. */
static void survives_anything(void **state)
{
    (void)state;
    uint64_t dice = 3;
    for (int bits = 1; bits <= 64; bits++) {
        int64_t last_ns = INT64_MIN, t = 0;
        fv_clock_map_begin(&map, random_decade(&dice, 1e-3, 1e9), bits, 1e-3);
        for (int i = 0; i < 3000; i++) {
            uint64_t counter = random_bits(&dice) >> (random_bits(&dice) % 64);
            t = t / 2 + (int64_t)(random_bits(&dice) % 10000000);
            if (random_bits(&dice) % 64 == 0) t = (int64_t)random_bits(&dice);
            fv_clock_map_arrive(&map, counter, t);
            int64_t got = fv_clock_map_host_ns(&map, fv_clock_map_unwrap(&map, counter, t));
            /* Past the end of time it wraps. */
            assert_true(got > last_ns || (last_ns > 0 && got < 0));
            last_ns = got;
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(follows), cmocka_unit_test(restarts),
                                       cmocka_unit_test(survives_anything)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
