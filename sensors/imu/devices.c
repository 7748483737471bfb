/* devices: see devices.h. Ids, layouts, scales, axes and commands are those that OpenHMD, Monado and libsurvive tell
 * of. */
#include "sensors/imu/devices.h"

#include <math.h>
#include <string.h>

#define DEGREE (M_PI / 180)
#define GRAVITY 9.80665
#define MHZ(n) (1000.0 / (n))

/* Report 0x20 of the headsets with lighthouse sensors: three readings in a ring, of which mostly one or two are new; the
 * clock at 48 MHz, then a sequence number, which is not needed. */
#define LIGHTHOUSE                                                                                                  \
    .decode = fv_imu_decode_layout,                                                                                 \
    .layout = {.id = 0x20, .bytes = 52, .readings = 3, .first = 1, .stride = 17, .acc = 0, .rate = 6, .counter = 12,   \
               .counter_bytes = 4, .number = FV_IMU_I16, .acc_unit = 4 * GRAVITY / 32768,                           \
               .rate_unit = 500 * DEGREE / 32768},                                                                  \
    .tick_ns = MHZ(48), .counter_bits = 32, .hz = 1000, .acc_full = 4 * GRAVITY, .rate_full = 500 * DEGREE,         \
    .axes = {1, -2, -3}

const struct fv_imu_device fv_imu_devices[FV_IMU_DEVICES] = {
    [FV_IMU_VIVE] = {.name = "vive", .vendor = 0x28de, .product = 0x2000, LIGHTHOUSE, .factory = true},
    /* Which way its sensor sits is not known here: its axes are taken for the Vive's. */
    [FV_IMU_INDEX] = {.name = "index", .vendor = 0x28de, .product = 0x2300, LIGHTHOUSE, .factory = true},
    [FV_IMU_RIFT] = {.name = "rift-dk2", .vendor = 0x2833, .product = 0x0021, .decode = fv_imu_decode_rift,
                     .layout = {.bytes = 64, .acc_unit = 1e-4, .rate_unit = 1e-4}, .tick_ns = MHZ(1), .counter_bits = 32,
                     .hz = 1000, .acc_full = INFINITY, .rate_full = INFINITY, .axes = {1, 2, 3},
                     /* Keep alive: sends for 10,000 ms from here. */
                     .command = {FV_IMU_FEATURE, 0, 5, {8, 0, 0, 0x10, 0x27}, 8}},
    /* Buttons come first, so no id. The rate's unit is known to a few hundredths. */
    [FV_IMU_PSVR] = {.name = "psvr", .vendor = 0x054c, .product = 0x09af, .interface = 4,
                     .decode = fv_imu_decode_layout,
                     .layout = {.id = -1, .bytes = 64, .readings = 2, .first = 16, .stride = 16, .acc = 10, .rate = 4,
                                .counter = 0, .counter_bytes = 4, .number = FV_IMU_I16,
                                .acc_unit = GRAVITY / 16384, .rate_unit = 1.05e-3},
                     .tick_ns = MHZ(1), .counter_bits = 32, .hz = 2000, .acc_full = 2 * GRAVITY,
                     .rate_full = 1.05e-3 * 32768, .axes = {2, 1, -3},
                     /* On. */
                     .command = {FV_IMU_OUTPUT, 5, 8, {0x17, 0, 0xaa, 4, 1}, INFINITY}},
    [FV_IMU_WINDOWS] = {.name = "windows", .vendor = 0x045e, .product = 0x0659, .decode = fv_imu_decode_windows,
                        .layout = {.bytes = 497, .acc_unit = 1e-3, .rate_unit = 1e-3}, .tick_ns = MHZ(10), .counter_bits = 64,
                        .hz = 1000, .acc_full = INFINITY, .rate_full = INFINITY, .axes = {-2, -1, -3},
                        /* Sensors on. */
                        .command = {FV_IMU_OUTPUT, 0, 64, {2, 7}, INFINITY}},
    [FV_IMU_GENERIC] = {.name = "generic", LIGHTHOUSE},
};

const struct fv_imu_calibration fv_imu_uncalibrated = {.acc_scale = {1, 1, 1}, .rate_scale = {1, 1, 1}};

const struct fv_imu_device *fv_imu_device_find(uint16_t vendor, uint16_t product)
{
    for (int i = 0; i < FV_IMU_DEVICES; i++)
        if (fv_imu_devices[i].vendor != 0 && fv_imu_devices[i].vendor == vendor && fv_imu_devices[i].product == product)
            return &fv_imu_devices[i];
    return NULL;
}

const struct fv_imu_device *fv_imu_device_named(const char *name)
{
    for (int i = 0; i < FV_IMU_DEVICES; i++)
        if (strcmp(fv_imu_devices[i].name, name) == 0) return &fv_imu_devices[i];
    return NULL;
}

static int check_three(const double v[3], double least, double most, const char *what, struct fv_error *error)
{
    for (int i = 0; i < 3; i++)
        if (!(v[i] >= least && v[i] <= most))
            return fv_error_set(error, "calibration: %s[%d] is %g; must be %g to %g", what, i, v[i], least, most);
    return 0;
}

int fv_imu_calibration_check(const struct fv_imu_calibration *c, struct fv_error *error)
{
    if (check_three(c->acc_scale, 0.5, 2, "acc_scale", error) || check_three(c->acc_bias, -5, 5, "acc_bias", error) ||
        check_three(c->rate_scale, 0.5, 2, "gyro_scale", error) || check_three(c->rate_bias, -1, 1, "gyro_bias", error))
        return -1;
    return 0;
}

/* The axes must be those of a right-handed system. */
static int check_axes(const int8_t axes[3], struct fv_error *error)
{
    int at[3], sign = 1;
    for (int i = 0; i < 3; i++) {
        at[i] = axes[i] < 0 ? -axes[i] : axes[i];
        if (at[i] < 1 || at[i] > 3) return fv_error_set(error, "axis %d; must be 1, 2, 3, or minus that", axes[i]);
        if (axes[i] < 0) sign = -sign;
    }
    if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) return fv_error_set(error, "an axis is named twice");
    bool even = (at[1] - at[0] + 3) % 3 == 1;
    if ((sign > 0) != even) return fv_error_set(error, "axes %d %d %d are left-handed", axes[0], axes[1], axes[2]);
    return 0;
}

int fv_imu_stream_begin(struct fv_imu_stream *stream, const struct fv_imu_device *device,
                        const struct fv_imu_calibration *calibration, struct fv_error *error)
{
    if (!calibration) calibration = &fv_imu_uncalibrated;
    if (fv_imu_calibration_check(calibration, error) || check_axes(device->axes, error)) return -1;
    if (device->decode == fv_imu_decode_layout && fv_imu_layout_check(&device->layout, error)) return -1;
    if (!(device->hz > 0 && device->hz <= 1e5)) return fv_error_set(error, "%g readings a second", device->hz);
    bool clock = device->counter_bits > 0 && isfinite(device->tick_ns);
    if (device->counter_bits < 0 || device->counter_bits > 64 || !(device->tick_ns > 0))
        return fv_error_set(error, "a counter of %d bits and %g ns", device->counter_bits, device->tick_ns);
    *stream = (struct fv_imu_stream){.device = *device, .calibration = *calibration, .source = device};
    fv_clock_map_begin(&stream->map, clock ? device->tick_ns : 1e9 / device->hz,
                       device->counter_bits > 0 ? device->counter_bits : 64, clock ? 1e-3 : 0.05);
    return 0;
}

/* One axis after another: scaled, less its bias, then as the head has it. */
static void calibrate(const struct fv_imu_stream *s, const struct fv_imu_reading *from, struct fv_imu_sample *to)
{
    const struct fv_imu_calibration *c = &s->calibration;
    for (int i = 0; i < 3; i++) {
        int axis = s->device.axes[i], k = (axis < 0 ? -axis : axis) - 1;
        double rate = from->rate[k] * c->rate_scale[k] - c->rate_bias[k];
        double acc = from->acc[k] * c->acc_scale[k] - c->acc_bias[k];
        to->rate[i] = axis < 0 ? -rate : rate;
        to->acc[i] = axis < 0 ? -acc : acc;
    }
}

/* Oldest first: a ring in a report may begin anywhere. Counters become ticks. */
static void sort(struct fv_imu_reading readings[], int64_t ticks[], int count)
{
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && ticks[k] < ticks[k - 1]; k--) {
            struct fv_imu_reading reading = readings[k];
            int64_t tick = ticks[k];
            readings[k] = readings[k - 1], ticks[k] = ticks[k - 1];
            readings[k - 1] = reading, ticks[k - 1] = tick;
        }
}

/* The ticks of a report's readings, sorted; the newest one is told to the map. True where the device's clock began
 * anew. */
static bool take_times(struct fv_imu_stream *s, struct fv_imu_reading readings[], int64_t ticks[], int count,
                       int64_t arrival_ns)
{
    int64_t restarts = s->map.restarts;
    if (s->device.counter_bits == 0)
        for (int i = 0; i < count; i++) readings[i].counter = s->map.newest + (uint64_t)i + (s->map.begun ? 1 : 0);
    if (!s->map.begun) fv_clock_map_arrive(&s->map, readings[0].counter, arrival_ns);
    for (int i = 0; i < count; i++) ticks[i] = fv_clock_map_unwrap(&s->map, readings[i].counter, arrival_ns);
    sort(readings, ticks, count);
    fv_clock_map_arrive(&s->map, readings[count - 1].counter, arrival_ns);
    for (int i = 0; i < count; i++) ticks[i] = fv_clock_map_unwrap(&s->map, readings[i].counter, arrival_ns);
    return s->map.restarts != restarts;
}

/* A reading that the report cannot hold beside its newest one: its counter was garbled, or is of before a restart. */
static bool far_off(const struct fv_imu_stream *s, int64_t ticks, int64_t newest)
{
    double before_s = 1e-9 * s->map.tick_ns * ((double)newest - (double)ticks);
    return !(before_s >= 0 && before_s <= 1 + FV_IMU_READINGS / s->device.hz);
}

int fv_imu_stream_report(struct fv_imu_stream *s, const uint8_t *report, size_t bytes, int64_t arrival_ns,
                         struct fv_imu_sample samples[FV_IMU_READINGS])
{
    struct fv_imu_reading reading[FV_IMU_READINGS];
    int64_t ticks[FV_IMU_READINGS];
    int count = s->device.decode(&s->device.layout, report, bytes, reading), given = 0;
    bool begins = !s->begun;
    s->raws = 0;
    if (count < 0) {
        s->counts.other++;
        return 0;
    }
    s->counts.reports++;
    if (count == 0) return 0;
    memcpy(s->raw, reading, (size_t)count * sizeof reading[0]);
    if (take_times(s, reading, ticks, count, arrival_ns)) s->counts.restarts++, s->begun = false, begins = true;
    for (int i = 0; i < count; i++) {
        if ((s->begun && ticks[i] <= s->newest) || far_off(s, ticks[i], ticks[count - 1])) {
            s->counts.repeated++;
            continue;
        }
        if (!begins) s->raw[given] = reading[i];
        struct fv_imu_sample *to = &samples[given++];
        to->dt_s = s->begun ? 1e-9 * s->map.tick_ns * fmax((double)ticks[i] - (double)s->newest, 1) : 1 / s->device.hz;
        s->counts.lost += (int64_t)fmin(fmax(rint(to->dt_s * s->device.hz) - 1, 0), 1e9);
        to->t_ns = fv_clock_map_host_ns(&s->map, ticks[i]);
        calibrate(s, &reading[i], to);
        s->newest = ticks[i];
        s->begun = true;
    }
    s->counts.samples += given;
    s->raws = begins || given == 0 ? count : given;
    return given;
}
