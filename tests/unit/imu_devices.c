/* imu_devices: reports made by hand, byte by byte: what each device's decoder reads of them, what it refuses, and
 * the stream of samples: each once, in order, calibrated, in the head's axes. */
#include "sensors/imu/devices.h"

#include "tests/support/program.h"

#include <math.h>

static const double gravity = 9.80665;
static uint8_t report[512];
static struct fv_imu_reading reading[FV_IMU_READINGS];
static struct fv_imu_sample sample[FV_IMU_READINGS];
static struct fv_imu_stream stream;
static struct fv_error error;

static void put(uint8_t *at, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) at[i] = (uint8_t)(value >> 8 * i);
}

static void put_three(uint8_t *at, int x, int y, int z)
{
    put(at, (uint64_t)x, 2), put(at + 2, (uint64_t)y, 2), put(at + 4, (uint64_t)z, 2);
}

static bool near_to(const double v[3], double x, double y, double z)
{
    return fabs(v[0] - x) < 1e-9 && fabs(v[1] - y) < 1e-9 && fabs(v[2] - z) < 1e-9;
}

static int decode(enum fv_imu_device_kind kind, size_t bytes)
{
    return fv_imu_devices[kind].decode(&fv_imu_devices[kind].layout, report, bytes, reading);
}

/* Three readings with these clocks; each tells its clock in its numbers. */
static void put_lighthouse(uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t clock[3] = {a, b, c};
    report[0] = 0x20;
    for (int n = 0; n < 3; n++) {
        uint8_t *at = report + 1 + 17 * n;
        put_three(at, 8192, -16384, (int)(clock[n] / 48000 % 1000));
        put_three(at + 6, 32767, -32768, 0);
        put(at + 12, clock[n], 4);
        at[16] = (uint8_t)(clock[n] / 48000);
    }
}

static void lighthouse(void **state)
{
    (void)state;
    put_lighthouse(0xfffffff0, 48000, 96000);
    for (int kind = FV_IMU_VIVE; kind <= FV_IMU_INDEX; kind++) {
        assert_int_equal(decode((enum fv_imu_device_kind)kind, 52), 3);
        assert_true(reading[0].counter == 0xfffffff0 && reading[2].counter == 96000);
        assert_true(near_to(reading[2].acc, gravity, -2 * gravity, 2 * gravity / 8192));
        assert_true(near_to(reading[2].rate, 8.726646259971648 * 32767 / 32768, -8.726646259971648, 0));
        assert_int_equal(decode((enum fv_imu_device_kind)kind, 51), -1);
        assert_int_equal(decode((enum fv_imu_device_kind)kind, 64), -1);
        assert_int_equal(decode((enum fv_imu_device_kind)kind, 0), -1);
    }
    report[0] = 0x21;
    assert_int_equal(decode(FV_IMU_VIVE, 52), -1);
}

/* Three numbers of 21 bits from the top: -1, 98066 and the least. */
static void rift(void **state)
{
    (void)state;
    memset(report, 0, sizeof report);
    uint64_t three = UINT64_C(0x1fffff) << 43 | UINT64_C(98066) << 22 | UINT64_C(0x100000) << 1;
    report[0] = 11;
    report[3] = 2;
    put(report + 8, 500, 4);
    for (int n = 0; n < 4; n++)
        for (int i = 0; i < 8; i++) report[12 + 8 * n + i] = (uint8_t)(three >> (56 - 8 * i));
    assert_int_equal(decode(FV_IMU_RIFT, 64), 2);
    assert_true(reading[1].counter == 500 && reading[0].counter == (uint32_t)-500);
    assert_true(near_to(reading[0].acc, -1e-4, 9.8066, -104.8576) && near_to(reading[1].rate, -1e-4, 9.8066, -104.8576));
    report[3] = 1;
    assert_int_equal(decode(FV_IMU_RIFT, 64), 1);
    assert_int_equal(reading[0].counter, 500);
    report[3] = 255;
    assert_int_equal(decode(FV_IMU_RIFT, 64), 2);
    report[3] = 0;
    assert_int_equal(decode(FV_IMU_RIFT, 64), 0);
    assert_int_equal(decode(FV_IMU_RIFT, 63), -1);
    report[0] = 1;
    assert_int_equal(decode(FV_IMU_RIFT, 64), -1);
}

static void psvr(void **state)
{
    (void)state;
    memset(report, 0xee, sizeof report);
    for (int n = 0; n < 2; n++) {
        put(report + 16 + 16 * n, 0x01020304u + 500u * (unsigned)n, 4);
        put_three(report + 20 + 16 * n, 1000, -2000, n);
        put_three(report + 26 + 16 * n, 0, 16384, -16384);
    }
    assert_int_equal(decode(FV_IMU_PSVR, 64), 2);
    assert_true(reading[0].counter == 0x01020304 && reading[1].counter == 0x01020304 + 500);
    assert_true(near_to(reading[1].rate, 1.05, -2.1, 1.05e-3) && near_to(reading[1].acc, 0, gravity, -gravity));
    assert_int_equal(decode(FV_IMU_PSVR, 63), -1);
}

static void windows(void **state)
{
    (void)state;
    memset(report, 0, sizeof report);
    report[0] = 1;
    for (int n = 0; n < 4; n++) {
        put(report + 9 + 8 * n, UINT64_C(0x0102030405060708) + 10000u * (unsigned)n, 8);
        for (int i = 0; i < 3; i++) {
            put(report + 265 + 4 * (4 * i + n), (uint64_t)(-9807 * i + n), 4);
            for (int k = 0; k < 8; k++)
                put(report + 41 + 2 * (32 * i + 8 * n + k), (uint64_t)(-100 * i + 10 * n + k), 2);
        }
    }
    for (int size = 381; size <= 497; size += 116) {
        assert_int_equal(decode(FV_IMU_WINDOWS, (size_t)size), 4);
        for (int n = 0; n < 4; n++) {
            assert_true(reading[n].counter == UINT64_C(0x0102030405060708) + 10000u * (unsigned)n);
            double rate = (10 * n + 3.5) * 1e-3; /* the mean of eight */
            assert_true(near_to(reading[n].rate, rate, rate - 0.1, rate - 0.2));
            assert_true(near_to(reading[n].acc, n * 1e-3, (n - 9807) * 1e-3, (n - 2 * 9807) * 1e-3));
        }
    }
    assert_int_equal(decode(FV_IMU_WINDOWS, 496), -1);
    report[0] = 2;
    assert_int_equal(decode(FV_IMU_WINDOWS, 497), -1);
}

/* Big-endian floats, by settings; what no layout may be. */
static void generic(void **state)
{
    (void)state;
    static const uint8_t floats[] = {7, 0x3f, 0x80, 0, 0, 0xc0, 0, 0, 0, 0x7f, 0xc0, 0, 0,   /* 1, -2, NaN */
                                     0x41, 0x20, 0, 0, 0, 0, 0, 0, 0x80, 0, 0, 0, 0x12, 0x34}; /* 10, 0, -0 */
    const struct fv_imu_layout good = {
        .id = 7, .bytes = 27, .readings = 1, .first = 1, .acc = 12, .rate = 0, .counter = 24, .counter_bytes = 2,
        .number = FV_IMU_F32, .big_endian = true, .acc_unit = 2, .rate_unit = 3};
    assert_int_equal(fv_imu_layout_check(&good, &error), 0);
    assert_int_equal(fv_imu_decode_layout(&good, floats, sizeof floats, reading), 1);
    assert_true(reading[0].counter == 0x1234 && near_to(reading[0].acc, 20, 0, 0));
    assert_true(reading[0].rate[0] == 3 && reading[0].rate[1] == -6 && isnan(reading[0].rate[2]));
    struct fv_imu_layout bad[12];
    for (int i = 0; i < 12; i++) bad[i] = good;
    bad[0].bytes = 26, bad[1].readings = 0, bad[2].readings = 9, bad[3].counter_bytes = 9, bad[4].counter = -1;
    bad[5].first = 2, bad[6].acc = 16, bad[7].rate = INT32_MAX, bad[8].acc_unit = NAN, bad[9].rate_unit = 0;
    bad[10].number = FV_IMU_NUMBERS, bad[11].bytes = INT32_MAX;
    for (int i = 0; i < 12; i++)
        if (fv_imu_layout_check(&bad[i], &error) != -1 || !error.text[0]) fail_msg("layout %d was taken", i);
    bad[0] = good, bad[0].readings = 2, bad[0].stride = 1;
    assert_int_equal(fv_imu_layout_check(&bad[0], &error), -1);
}

/* Every row of the table can be a stream; found by ids and by name. */
static void table(void **state)
{
    (void)state;
    for (int i = 0; i < FV_IMU_DEVICES; i++) {
        const struct fv_imu_device *d = &fv_imu_devices[i];
        if (fv_imu_stream_begin(&stream, d, NULL, &error)) fail_msg("%s: %s", d->name, error.text);
        assert_ptr_equal(fv_imu_device_named(d->name), d);
        if (i != FV_IMU_GENERIC) assert_ptr_equal(fv_imu_device_find(d->vendor, d->product), d);
    }
    assert_null(fv_imu_device_find(0, 0));
    assert_null(fv_imu_device_find(0x28de, 0x2101));
    assert_null(fv_imu_device_named("vive "));
    struct fv_imu_device odd = fv_imu_devices[FV_IMU_VIVE];
    static const int8_t axes[][3] = {{1, 2, -3}, {1, 1, 3}, {0, 2, 3}, {1, 4, 3}, {2, 1, 3}, {-128, 1, 2}};
    for (unsigned i = 0; i < sizeof axes / sizeof axes[0]; i++) {
        memcpy(odd.axes, axes[i], sizeof odd.axes);
        assert_int_equal(fv_imu_stream_begin(&stream, &odd, NULL, &error), -1);
    }
}

/* Rings that begin anywhere, overlap, wrap, repeat and lack some: which clocks (ms) come out of each report. */
static void each_once(void **state)
{
    (void)state;
    static const struct {
        int ms[3], new, first_ms;
    } reports[] = {
        {{2, 3, 1}, 3, 1},  {{2, 3, 4}, 1, 4}, {{5, 3, 4}, 1, 5}, {{5, 3, 4}, 0, 0},
        {{5, 6, 7}, 2, 6},  {{9, 10, 8}, 3, 8}, {{15, 13, 14}, 3, 13}, {{3, 4, 5}, 0, 0}, {{16, 14, 15}, 1, 16},
    };
    int64_t last_ns = 0, samples = 0;
    uint32_t from = UINT32_MAX - 4 * 48000; /* wraps between 4 and 5 ms */
    assert_int_equal(fv_imu_stream_begin(&stream, &fv_imu_devices[FV_IMU_VIVE], NULL, &error), 0);
    for (unsigned n = 0; n < sizeof reports / sizeof reports[0]; n++) {
        const int *ms = reports[n].ms;
        put_lighthouse(from + 48000u * (uint32_t)ms[0], from + 48000u * (uint32_t)ms[1], from + 48000u * (uint32_t)ms[2]);
        int64_t now_ns = INT64_C(7000000000) + 2000000 * n;
        int got = fv_imu_stream_report(&stream, report, 52, now_ns, sample);
        if (got != reports[n].new) fail_msg("report %u: %d samples", n, got);
        for (int i = 0; i < got; i++) {
            assert_true(sample[i].t_ns > last_ns && llabs(sample[i].t_ns - now_ns) < 20000000);
            double dt_ms = n == 5 && i == 0 ? 1 : n == 6 && i == 0 ? 3 : 1;
            assert_true(fabs(sample[i].dt_s * 1e3 - dt_ms) < 1e-6);
            last_ns = sample[i].t_ns;
        }
        samples += got;
    }
    assert_int_equal(fv_imu_stream_report(&stream, report, 30, 0, sample), 0);
    assert_int_equal(stream.counts.samples, samples);
    assert_int_equal(stream.counts.repeated, 27 - samples);
    assert_int_equal(stream.counts.lost, 2);
    assert_int_equal(stream.counts.other, 1);
    assert_int_equal(stream.counts.restarts, 0);
    /* The head's axes: y is minus the device's. */
    assert_true(near_to(sample[0].acc, gravity, 2 * gravity, sample[0].acc[2]) && sample[0].rate[1] > 8.7);
}

/* A counter that is no clock, and none at all: a sample each, at the nominal rate. */
static void without_a_clock(void **state)
{
    (void)state;
    for (int bits = 0; bits <= 8; bits += 8) {
        struct fv_imu_device d = fv_imu_devices[FV_IMU_GENERIC];
        d.layout.readings = 1;
        d.layout.counter = 16;
        d.layout.counter_bytes = bits / 8;
        d.counter_bits = bits;
        d.tick_ns = INFINITY;
        if (fv_imu_stream_begin(&stream, &d, NULL, &error)) fail_msg("%s", error.text);
        for (int n = 0; n < 1000; n++) {
            report[0] = 0x20;
            report[1 + 16] = (uint8_t)n;
            assert_int_equal(fv_imu_stream_report(&stream, report, 52, 1000000 * n, sample), 1);
            assert_true(fabs(sample[0].dt_s - 1e-3) < 1e-9 && llabs(sample[0].t_ns - 1000000 * n) < 1000);
        }
        assert_int_equal(fv_imu_stream_report(&stream, report, 52, 1000000000, sample), bits == 0);
    }
}

static void calibration(void **state)
{
    (void)state;
    struct fv_imu_calibration c = {{1.01, 0.99, 1}, {0.1, -0.2, 0.3}, {1, 1, 1}, {0.01, -0.02, 0.03}};
    assert_int_equal(fv_imu_stream_begin(&stream, &fv_imu_devices[FV_IMU_VIVE], &c, &error), 0);
    put_lighthouse(0, 48000, 2 * 48000);
    assert_int_equal(fv_imu_stream_report(&stream, report, 52, 0, sample), 3);
    assert_true(near_to(sample[0].acc, 1.01 * gravity - 0.1, 0.99 * 2 * gravity - 0.2, 0.3));
    assert_true(fabs(sample[0].rate[1] - (8.726646259971648 - 0.02)) < 1e-9 && fabs(sample[0].rate[2] - 0.03) < 1e-9);
    static const double wrong[] = {NAN, INFINITY, -INFINITY, 1e9, -7};
    for (unsigned i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        for (size_t k = 0; k < 12; k++) {
            struct fv_imu_calibration odd = c;
            ((double *)&odd)[k] = wrong[i];
            if (fv_imu_calibration_check(&odd, &error) != -1) fail_msg("%g as value %d was taken", wrong[i], (int)k);
            assert_int_equal(fv_imu_stream_begin(&stream, &fv_imu_devices[FV_IMU_VIVE], &odd, &error), -1);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lighthouse), cmocka_unit_test(rift),    cmocka_unit_test(psvr),
        cmocka_unit_test(windows),    cmocka_unit_test(generic), cmocka_unit_test(table),
        cmocka_unit_test(each_once),  cmocka_unit_test(without_a_clock), cmocka_unit_test(calibration)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
