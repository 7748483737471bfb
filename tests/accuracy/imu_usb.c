/* imu_usb: captures of real headsets from bytes to samples to rotation: each reading that is in them once and none
 * other, host times near their arrival, gravity as it is where the head rests. */
#include "sensors/imu/factory.h"
#include "sensors/imu/fusion.h"

#include "tests/support/program.h"
#include "tests/support/pcap.h"

#include <math.h>
#include <time.h>

#define FOLDER FV_SOURCE_DIR "/../shared/data/imu/headset_usb"
static const double gravity = 9.80665;

enum { NEWEST = 64 };

static const struct {
    const char *file;
    enum fv_imu_device_kind device;
} captures[] = {{"vive_cal.pcap.gz", FV_IMU_VIVE}, {"index-lhv1.pcap.gz", FV_IMU_INDEX}};

static struct pcap_packet packet;
static struct fv_imu_stream stream;
static struct fv_fusion fusion;
static double acceleration[100000], latency[100000], took_us[100000];

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * INT64_C(1000000000) + t.tv_nsec;
}

/* Another way to count what is in the reports: by their clocks, against those of the reports just before. */
static int unseen(const uint8_t *report, uint32_t seen[NEWEST], int *next)
{
    int count = 0;
    for (int n = 0; n < 3; n++) {
        uint32_t clock = pcap_word(report + 1 + 17 * n + 12);
        bool known = false;
        for (int i = 0; i < NEWEST; i++) known |= seen[i] == clock;
        if (known) continue;
        seen[(*next)++ % NEWEST] = clock;
        count++;
    }
    return count;
}

static void judge(unsigned n)
{
    struct fv_error error;
    char path[512];
    uint32_t seen[NEWEST] = {0};
    int next = 0, rests = 0, samples = 0, reports = 0;
    int64_t expected = 0, last_ns = 0;
    snprintf(path, sizeof path, FOLDER "/%s", captures[n].file);
    gzFile f = pcap_open(path);
    if (!f) {
        print_message("no %s: skipped\n", path);
        skip();
    }
    assert_int_equal(fv_imu_stream_begin(&stream, &fv_imu_devices[captures[n].device], NULL, &error), 0);
    struct fv_fusion_settings settings = fv_fusion_usual;
    settings.rate_full = stream.device.rate_full;
    settings.acc_full = stream.device.acc_full;
    fv_fusion_begin(&fusion, &settings);
    while (pcap_next(f, &packet)) {
        struct fv_imu_sample sample[FV_IMU_READINGS];
        if (!packet.came || packet.bytes == 0) continue;
        int64_t from_ns = now_ns();
        int count = fv_imu_stream_report(&stream, packet.data, packet.bytes, packet.t_ns, sample);
        if (packet.bytes == 52 && packet.data[0] == 0x20) expected += unseen(packet.data, seen, &next);
        for (int i = 0; i < count; i++) fv_fusion_add(&fusion, sample[i].rate, sample[i].acc, sample[i].dt_s);
        if (count > 0) took_us[reports++] = 1e-3 * (double)(now_ns() - from_ns);
        for (int i = 0; i < count; i++) {
            assert_true(sample[i].t_ns > last_ns && sample[i].dt_s > 0);
            last_ns = sample[i].t_ns;
            const double *a = sample[i].acc;
            if (fusion.resting) acceleration[rests++] = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
            latency[samples++] = 1e-6 * (double)(packet.t_ns - sample[i].t_ns);
        }
    }
    gzclose(f);
    qsort(acceleration, (size_t)rests, sizeof acceleration[0], by_value);
    qsort(latency, (size_t)samples, sizeof latency[0], by_value);
    qsort(took_us, (size_t)reports, sizeof took_us[0], by_value);
    double median = rests ? acceleration[rests / 2] : NAN;
    print_message("%s: from report to pose, us: median %.2f, 99 %% %.2f\n", captures[n].file, took_us[reports / 2],
                  took_us[reports * 99 / 100]);
    print_message("%s: %lld samples (%lld in the bytes), %lld repeated, %lld lost\n", captures[n].file,
                  (long long)stream.counts.samples, (long long)expected, (long long)stream.counts.repeated,
                  (long long)stream.counts.lost);
    print_message("%d at rest, |acc| %.4f g; arrival after their time, ms: least %.3f, median %.3f, 99 %% %.3f; drift %.1f ppm\n",
                  rests, median / gravity, latency[0], latency[samples / 2], latency[samples * 99 / 100],
                  1e6 * stream.map.drift);
    assert_true(expected > 10000);
    assert_int_equal(stream.counts.samples, expected);
    assert_true(stream.counts.restarts <= 1); /* reports of the session before may lie in the device */
    assert_int_equal(fusion.counts.bad + fusion.counts.mistimed, 0);
    assert_true(rests > 0 && fabs(median / gravity - 1) <= 0.01);
    /* A ring of three readings: none is older than some milliseconds, none comes before its time by more than slewing. */
    assert_true(latency[0] > -1 && latency[samples / 2] < 5);
}

static void vive(void **state)
{
    (void)state;
    judge(0);
}

static void index_headset(void **state)
{
    (void)state;
    judge(1);
}

/* What the factory measured of each device in a capture, piece by piece as they came. */
static void factory(void **state)
{
    (void)state;
    enum { DEVICES = 128 };
    static struct fv_factory_pieces pieces[DEVICES];
    struct fv_imu_calibration c;
    struct fv_error error;
    char path[512];
    int read = 0;
    for (int n = 0; n < 2; n++) {
        snprintf(path, sizeof path, FOLDER "/%s", captures[n].file);
        gzFile f = pcap_open(path);
        if (!f) skip();
        memset(pieces, 0, sizeof pieces);
        while (pcap_next(f, &packet)) {
            struct fv_factory_pieces *of = &pieces[packet.device % DEVICES];
            if (!packet.came || packet.endpoint != 0x80 || packet.bytes != FV_FACTORY_PIECE_MAX) continue;
            if (packet.data[0] == FV_FACTORY_BEGIN) of->bytes = 0;
            if (packet.data[0] != FV_FACTORY_PIECE || of->bytes + packet.bytes > FV_FACTORY_PACKED_MAX) continue;
            int more = fv_factory_piece(of, packet.data, packet.bytes, &error);
            if (more != 0 || of->bytes == 0) continue;
            if (fv_factory_read(of->packed, of->bytes, &c, &error)) fail_msg("%s", error.text);
            print_message("%s, device %d: acc bias %.4f %.4f %.4f m/s^2, gyro bias %.4f %.4f %.4f rad/s\n", captures[n].file,
                          packet.device, c.acc_bias[0], c.acc_bias[1], c.acc_bias[2], c.rate_bias[0], c.rate_bias[1],
                          c.rate_bias[2]);
            for (int i = 0; i < 3; i++) assert_true(fabs(c.acc_scale[i] - 1) < 0.01 && fabs(c.rate_bias[i]) < 0.1);
            of->bytes = 0;
            read++;
        }
        gzclose(f);
    }
    assert_true(read >= 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(vive), cmocka_unit_test(index_headset),
                                       cmocka_unit_test(factory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
