/* feed: see feed.h. */
#include "sensors/imu/feed.h"

#include "platform/log.h"

#include <math.h>
#include <string.h>

static void publish(struct fv_imu_feed *f)
{
    struct fv_imu_feed_counts *c = &f->state.counts;
    const struct fv_imu_counts *now = &f->stream.counts, *past = &f->past;
    const struct fv_fusion_counts *fused = &f->fusion.counts;
    c->reports = past->reports + now->reports;
    c->samples = past->samples + now->samples;
    c->repeated = past->repeated + now->repeated;
    c->lost = past->lost + now->lost;
    c->restarts = past->restarts + now->restarts;
    c->foreign = past->other + now->other;
    c->rejected = fused->mistimed + fused->bad + fused->stuck;
    c->mistimed = fused->mistimed;
    c->bad = fused->bad;
    c->stuck = fused->stuck;
    c->saturated = fused->saturated;
    f->state.connected = f->phase == FV_IMU_STREAMING;
    fv_mailbox_put(&f->box, &f->state, sizeof f->state);
}

void fv_imu_feed_begin(struct fv_imu_feed *f, const struct fv_imu_port *port, const struct fv_clock *clock)
{
    memset(f, 0, sizeof *f);
    f->port = port;
    f->clock = clock;
    f->phase = FV_IMU_SEARCHING;
    f->phase_ns = fv_clock_now_ns(clock);
    fv_fusion_begin(&f->fusion, NULL);
    memcpy(f->state.rotation, f->fusion.rotation, sizeof f->state.rotation);
    publish(f);
}

static void change(struct fv_imu_feed *f, enum fv_imu_feed_phase phase)
{
    f->phase = phase;
    f->phase_ns = fv_clock_now_ns(f->clock);
    publish(f);
}

static bool any(const bool set[FV_IMU_TRANSFERS])
{
    for (int i = 0; i < FV_IMU_TRANSFERS; i++)
        if (set[i]) return true;
    return false;
}

static void cancel(struct fv_imu_feed *f)
{
    for (int i = 0; i < FV_IMU_TRANSFERS; i++)
        if (f->flying[i]) f->port->cancel(f->port->context, i);
}

static void end_stream(struct fv_imu_feed *f, const char *why)
{
    if (!f->missed) fv_log("imu: %s: %s; it is searched for", f->device->name, why);
    f->missed = true;
    change(f, FV_IMU_ENDING);
    cancel(f);
}

static void submit(struct fv_imu_feed *f, int transfer)
{
    if (f->phase != FV_IMU_STREAMING) return;
    enum fv_imu_submitted submitted = f->port->submit(f->port->context, transfer);
    f->flying[transfer] = submitted == FV_IMU_SUBMITTED;
    f->idle[transfer] = submitted == FV_IMU_REFUSED;
    f->state.counts.refused += submitted == FV_IMU_REFUSED;
    f->gone = f->gone || submitted == FV_IMU_NO_DEVICE;
}

/* The streams before count on in `past`. */
static void keep_counts(struct fv_imu_feed *f)
{
    const struct fv_imu_counts *now = &f->stream.counts;
    f->past.reports += now->reports;
    f->past.other += now->other;
    f->past.samples += now->samples;
    f->past.repeated += now->repeated;
    f->past.lost += now->lost;
    f->past.restarts += now->restarts;
    memset(&f->stream.counts, 0, sizeof f->stream.counts);
}

/* Another device is another sensor: nothing that was learnt of the old one holds for it. */
static int begin_stream(struct fv_imu_feed *f, const struct fv_imu_device *device,
                        const struct fv_imu_calibration *calibration, struct fv_error *error)
{
    keep_counts(f);
    if (fv_imu_stream_begin(&f->stream, device, calibration, error)) return -1;
    if (device == f->device) return 0;
    struct fv_fusion_settings settings = fv_fusion_usual;
    struct fv_fusion_counts counts = f->fusion.counts;
    settings.rate_full = device->rate_full, settings.acc_full = device->acc_full;
    fv_fusion_begin(&f->fusion, &settings);
    f->fusion.counts = counts;
    f->device = device;
    f->sampled = false;
    return 0;
}

int fv_imu_feed_search(struct fv_imu_feed *f, struct fv_error *error)
{
    const struct fv_imu_device *device;
    const struct fv_imu_calibration *calibration = NULL;
    f->phase_ns = fv_clock_now_ns(f->clock);
    int failed = f->port->open(f->port->context, &device, &calibration, error);
    if (failed) return failed;
    if (begin_stream(f, device, calibration, error)) {
        f->port->close(f->port->context);
        return -1;
    }
    f->halted = f->cancelled = f->gone = false;
    f->failed = 0;
    f->report_ns = f->tell_ns = f->phase_ns;
    f->state.counts.connects++;
    f->error.text[0] = 0;
    change(f, FV_IMU_STREAMING);
    for (int i = 0; i < FV_IMU_TRANSFERS; i++) submit(f, i);
    return 0;
}

/* A reason is told once, when it is found for the second time: just plugged in, a device may not be permitted yet. That
 * there is none was told when it went. */
static void search_on(struct fv_imu_feed *f)
{
    struct fv_error error;
    int64_t again_ns = f->phase_ns + FV_IMU_SEARCH_NS, now_ns = fv_clock_now_ns(f->clock);
    if (now_ns < again_ns) {
        fv_clock_sleep_until_ns(f->clock, again_ns < now_ns + FV_IMU_WAIT_NS ? again_ns : now_ns + FV_IMU_WAIT_NS);
    } else if (fv_imu_feed_search(f, &error) < 0) {
        bool again = strcmp(error.text, f->error.text) == 0;
        if (again && !f->told) fv_log("%s", error.text);
        f->told = again;
        f->error = error;
    }
}

static void unstall(struct fv_imu_feed *f)
{
    if (!f->cancelled) cancel(f);
    f->cancelled = true;
    if (any(f->flying)) return;
    f->halted = f->cancelled = f->port->unstall(f->port->context) != 0;
    f->failed += f->halted;
}

static void tell(struct fv_imu_feed *f)
{
    const struct fv_imu_command *command = &f->device->command;
    int64_t now_ns = fv_clock_now_ns(f->clock);
    if (command->bytes == 0 || now_ns < f->tell_ns) return;
    f->tell_ns = isfinite(command->every_s) ? now_ns + (int64_t)(1e9 * command->every_s) : INT64_MAX;
    f->state.counts.untold += f->port->tell(f->port->context, command) != 0;
}

static void stream_on(struct fv_imu_feed *f)
{
    tell(f);
    if (f->halted) unstall(f);
    for (int i = 0; i < FV_IMU_TRANSFERS && !f->halted; i++)
        if (f->idle[i]) submit(f, i);
    f->port->wait(f->port->context, fv_clock_now_ns(f->clock) + FV_IMU_WAIT_NS);
    publish(f);
    bool silent = fv_clock_now_ns(f->clock) - f->report_ns >= FV_IMU_SILENCE_NS;
    if (f->gone) {
        end_stream(f, "unplugged");
    } else if (f->failed >= FV_IMU_FAILURES_MAX) {
        end_stream(f, "only failed transfers");
    } else if (silent) {
        f->state.counts.silences++;
        end_stream(f, "no reports");
    }
}

static void end_on(struct fv_imu_feed *f)
{
    int64_t over_ns = f->phase_ns + FV_IMU_FAREWELL_NS;
    if (any(f->flying) && fv_clock_now_ns(f->clock) < over_ns) f->port->wait(f->port->context, over_ns);
    if (any(f->flying) && fv_clock_now_ns(f->clock) < over_ns) return;
    f->port->close(f->port->context);
    memset(f->flying, 0, sizeof f->flying);
    memset(f->idle, 0, sizeof f->idle);
    change(f, FV_IMU_SEARCHING);
}

void fv_imu_feed_step(struct fv_imu_feed *f)
{
    switch (f->phase) {
    case FV_IMU_SEARCHING: search_on(f); break;
    case FV_IMU_STREAMING: stream_on(f); break;
    case FV_IMU_ENDING: end_on(f); break;
    }
}

void fv_imu_feed_close(struct fv_imu_feed *f)
{
    if (f->phase == FV_IMU_STREAMING) {
        change(f, FV_IMU_ENDING);
        cancel(f);
    }
    while (f->phase == FV_IMU_ENDING) end_on(f);
}

/* anew: the device's clock says nothing of the time since the sample before; the host's does. */
static void take_sample(struct fv_imu_feed *f, const struct fv_imu_sample *sample, int64_t arrival_ns, bool anew)
{
    const struct fv_fusion_counts *c = &f->fusion.counts;
    int64_t refused = c->mistimed + c->bad + c->stuck;
    double dt_s = anew && f->sampled ? 1e-9 * (double)(sample->t_ns - f->sample_ns) : sample->dt_s;
    fv_fusion_add(&f->fusion, sample->rate, sample->acc, dt_s);
    if (!(anew && f->sampled && dt_s <= 0)) f->sample_ns = sample->t_ns;
    f->sampled = true;
    /* The rate of a sensor that is stuck is 0: the pose is held, not turned on. */
    memcpy(f->state.rate, f->fusion.rate, sizeof f->state.rate);
    if (c->mistimed + c->bad + c->stuck != refused) return;
    f->state.t_ns = sample->t_ns;
    f->state.arrival_ns = arrival_ns;
    f->state.good++;
    memcpy(f->state.rotation, f->fusion.rotation, sizeof f->state.rotation);
}

static void take_report(struct fv_imu_feed *f, const uint8_t *bytes, size_t length, int64_t arrival_ns)
{
    struct fv_imu_sample samples[FV_IMU_READINGS];
    int64_t reports = f->stream.counts.reports, restarts = f->stream.counts.restarts;
    bool first = !f->stream.begun;
    int count = fv_imu_stream_report(&f->stream, bytes, length, arrival_ns, samples);
    struct fv_imu_recorder *recorder = atomic_load_explicit(&f->recorder, memory_order_acquire);
    if (recorder && f->stream.raws > 0)
        fv_imu_recorder_report(recorder, &f->stream, f->state.counts.connects, arrival_ns);
    for (int i = 0; i < count; i++)
        take_sample(f, &samples[i], arrival_ns, i == 0 && (first || f->stream.counts.restarts != restarts));
    if (f->stream.counts.reports == reports) return;
    f->report_ns = arrival_ns;
    f->failed = 0;
    if (f->missed) fv_log("imu: %s: reports come again", f->device->name);
    f->missed = false;
}

void fv_imu_feed_end(struct fv_imu_feed *f, int transfer, enum fv_imu_end end, const uint8_t *bytes, size_t length,
                     int64_t arrival_ns)
{
    struct fv_imu_feed_counts *c = &f->state.counts;
    if (transfer < 0 || transfer >= FV_IMU_TRANSFERS) return;
    f->flying[transfer] = false;
    if (end == FV_IMU_CAME && length > 0 && f->phase == FV_IMU_STREAMING) take_report(f, bytes, length, arrival_ns);
    c->empty += end == FV_IMU_CAME && length == 0;
    c->too_long += end == FV_IMU_TOO_LONG;
    c->stalls += end == FV_IMU_STALLED;
    c->failures += end == FV_IMU_FAILED;
    f->failed += end == FV_IMU_FAILED || end == FV_IMU_STALLED;
    f->halted = f->halted || end == FV_IMU_STALLED;
    f->gone = f->gone || end == FV_IMU_GONE;
    publish(f);
    f->idle[transfer] = f->halted || f->gone || f->failed >= FV_IMU_FAILURES_MAX;
    if (!f->idle[transfer]) submit(f, transfer);
}
