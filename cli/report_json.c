/* report_json: report.json, the session as numbers for programs. Keys are added, never renamed. */
#include "cli/report.h"

#include "cli/columns.h"
#include "cli/profile.h"
#include "platform/arena.h"
#include "platform/json.h"

#include <math.h>
#include <string.h>

#ifndef FV_VERSION
#define FV_VERSION "unknown"
#endif

static struct fv_writer out;

/* A key; `separator` is what stands between it and what came before. */
static void key(const char *separator, const char *name)
{
    fv_writer_print(&out, "%s", separator);
    fv_json_text(&out, name);
    fv_writer_bytes(&out, ":", 1);
}

static void text(const char *separator, const char *name, const char *value)
{
    key(separator, name);
    fv_json_text(&out, value);
}

static void integer(const char *separator, const char *name, int64_t value)
{
    key(separator, name);
    fv_writer_print(&out, "%lld", (long long)value);
}

static void number(const char *separator, const char *name, double value)
{
    key(separator, name);
    fv_json_number(&out, value);
}

static void write_setting(const struct fv_config *config, const struct fv_key *k)
{
    const void *at = (const char *)config + k->offset;
    switch (k->kind) {
    case FV_KEY_INT: fv_writer_print(&out, "%lld", (long long)*(const int64_t *)at); break;
    case FV_KEY_REAL: fv_json_number(&out, *(const double *)at); break;
    case FV_KEY_WORD:
    case FV_KEY_TEXT:
    case FV_KEY_ROWS: fv_json_text(&out, at); break;
    case FV_KEY_LIST: {
        const struct fv_list *list = at;
        fv_writer_print(&out, "[");
        for (int i = 0; i < list->count; i++) {
            if (i) fv_writer_print(&out, ",");
            fv_json_number(&out, list->value[i]);
        }
        fv_writer_print(&out, "]");
        break;
    }
    }
}

static void write_config(const struct fv_config *config)
{
    key(",\n", "config");
    for (int i = 0; i < fv_keys_count; i++) {
        fv_writer_print(&out, "%s\"%s.%s\":", i ? ",\n " : "{\n ", fv_keys[i].section, fv_keys[i].name);
        write_setting(config, &fv_keys[i]);
    }
    fv_writer_print(&out, "}");
}

static void close_object(void)
{
    fv_writer_bytes(&out, "}", 1);
}

static void write_percentiles(const struct fv_session *s, const char *name, const struct fv_column *column,
                              unsigned percents)
{
    static const struct {
        const char *name;
        double percent;
    } rows[] = {{"p50", 50}, {"p95", 95}, {"p99", 99}, {"max", 100}};
    const char *separator = "{";
    key(",\n", name);
    for (int i = 0; i < 4; i++) {
        if (!(percents >> i & 1)) continue;
        number(separator, rows[i].name, fv_column_percentile(s, column, 0, fv_recorded(s), rows[i].percent));
        separator = ",";
    }
    close_object();
}

static void write_stages(const struct fv_session *s)
{
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    fv_stage_rows(s, rows);
    key(",\n", "stage_ms");
    fv_writer_print(&out, "{");
    for (int i = 0; i < fv_stages(s); i++) {
        key(i ? ",\n " : "\n ", rows[i].name);
        number("{", "p50", rows[i].p50_ms);
        number(",", "p99", rows[i].p99_ms);
        number(",", "max", rows[i].max_ms);
        number(",", "rate_hz", rows[i].rate_hz);
        number(",", "share", rows[i].share);
        integer(",", "late", rows[i].late);
        close_object();
    }
    close_object();
}

static void write_times(const struct fv_session *s)
{
    enum { P50 = 1, P95 = 2, P99 = 4, MAX = 8 };
    write_percentiles(s, "frame_ms", &fv_columns[FV_COLUMN_FRAME_MS], P50 | P95 | P99 | MAX);
    write_stages(s);
    write_percentiles(s, "control_ms", &fv_columns[FV_COLUMN_CONTROL_MS], P50 | P99 | MAX);
    number(",\n", "idle", fv_idle_share(s));
}

static void write_means(const struct fv_session *s)
{
    static const struct {
        const char *name;
        int column;
    } rays[] = {{"primary", FV_COLUMN_PRIMARY},
                {"shadow", FV_COLUMN_SHADOW},
                {"secondary", FV_COLUMN_SECONDARY},
                {"march_steps", FV_COLUMN_MARCH_STEPS},
                {"march_limited", FV_COLUMN_MARCH_LIMITED}},
      ranges[] = {{"level", FV_COLUMN_LEVEL},
                  {"r0_deg", FV_COLUMN_R0},
                  {"p_min", FV_COLUMN_P_MIN},
                  {"periods", FV_COLUMN_PERIODS},
                  {"cut_tiles", FV_COLUMN_CUT_TILES}};
    key(",\n", "rays_per_frame");
    for (int i = 0; i < 5; i++)
        number(i ? "," : "{", rays[i].name, fv_column_summary(s, &fv_columns[rays[i].column]).mean);
    close_object();
    number(",\n", "sampled_fraction", fv_column_summary(s, &fv_columns[FV_COLUMN_SAMPLED]).mean);
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++) {
        struct fv_summary summary = fv_column_summary(s, &fv_columns[ranges[i].column]);
        key(",\n", ranges[i].name);
        number("{", "min", summary.min);
        number(",", "mean", summary.mean);
        number(",", "max", summary.max);
        close_object();
    }
}

/* The rings up to the last one that anything was done in; `to_deg` of the last ring of all is null. */
static void write_rings(const struct fv_session *s)
{
    key(",\n", "eccentricity");
    fv_writer_print(&out, "[");
    for (int i = 0; i < fv_rings(s); i++) {
        const struct fv_ring *ring = &s->ring[i];
        fv_writer_print(&out, i ? ",\n " : "\n ");
        number("{", "from_deg", i * FV_RING_DEG);
        number(",", "to_deg", i + 1 < FV_RINGS ? (i + 1) * FV_RING_DEG : (double)NAN);
        number(",", "us_per_unit", fv_ring_ns_per_unit(ring) * 1e-3);
        number(",", "cpu_ms", ring->cpu_ns * 1e-6);
        integer(",", "units", ring->units);
        integer(",", "tiles", ring->tiles);
        integer(",", "cut", ring->cut);
        close_object();
    }
    fv_writer_print(&out, "]");
}

static void write_memory(const struct fv_session *s)
{
    const struct fv_arena *arena = fv_arena();
    key(",\n", "arena");
    integer("{", "capacity", (int64_t)arena->capacity);
    integer(",", "used", (int64_t)arena->used);
    key(",", "by");
    fv_writer_print(&out, "{");
    for (int i = 0; i < arena->rows; i++)
        integer(i ? ",\n " : "\n ", arena->row[i].name, (int64_t)arena->row[i].bytes);
    fv_writer_print(&out, "}}");
    key(",\n", "sealed");
    integer("{", "heap_calls", s->heap_calls);
    integer(",", "memory_syscalls", s->memory_syscalls);
    fv_writer_print(&out, "}");
}

static void write_plan(const struct fv_session *s)
{
    int most = sizeof s->plan / sizeof s->plan[0], rows = s->plan_rows < most ? s->plan_rows : most;
    key(",\n", "plan");
    fv_writer_print(&out, "[");
    for (int i = 0; i < rows; i++) {
        const struct fv_plan_row *row = &s->plan[i];
        fv_writer_print(&out, i ? ",\n " : "\n ");
        text("{", "what", row->what);
        text(",", "kind", row->kind);
        key(",", "kept");
        fv_writer_print(&out, row->kept ? "true" : "false");
        text(",", "reason", row->reason);
        integer(",", "bytes", row->bytes);
        fv_writer_print(&out, "}");
    }
    fv_writer_print(&out, "]");
}

/* Cameras of the eyes are told of only where they are the source. */
static void write_sensors(const struct fv_session *s)
{
    key(",\n", "gaze");
    integer("{", "samples", s->gaze_samples);
    integer(",", "lost", s->gaze_lost);
    number(",", "latency_ms_p50", s->gaze_latency_ms_p50);
    if (s->cameras > 0) {
        key(",", "cameras");
        integer("{", "count", s->cameras);
        integer(",", "frames", s->camera_frames);
        integer(",", "skipped", s->camera_skipped);
        integer(",", "gaps", s->camera_gaps);
        integer(",", "rejected", s->camera_rejected);
        integer(",", "untimed", s->camera_untimed);
        integer(",", "errors", s->camera_errors);
        integer(",", "lost", s->camera_lost);
        integer(",", "restarts", s->camera_restarts);
        integer(",", "no_pupil", s->eye_no_pupil);
        integer(",", "unsure", s->eye_unsure);
        integer(",", "blinks", s->eye_blinks);
        number(",", "latency_ms_mean", s->camera_ms_mean);
        number(",", "latency_ms_most", s->camera_ms_most);
        fv_writer_print(&out, "}");
    }
    fv_writer_print(&out, "}");
    key(",\n", "imu");
    integer("{", "samples", s->imu_samples);
    integer(",", "rejected", s->imu_rejected);
    integer(",", "readings", s->imu_readings);
    integer(",", "lost", s->imu_lost);
    integer(",", "reconnects", s->imu_reconnects);
    integer(",", "repeated", s->imu_repeated);
    integer(",", "clock_restarts", s->imu_clock_restarts);
    integer(",", "mistimed", s->imu_mistimed);
    integer(",", "bad", s->imu_bad);
    integer(",", "stuck", s->imu_stuck);
    integer(",", "saturated", s->imu_saturated);
    fv_writer_print(&out, "}");
    key(",\n", "tape");
    integer("{", "rows", s->tape_rows);
    integer(",", "dropped", s->tape_dropped);
    integer(",", "cut", s->tape_cut);
    fv_writer_print(&out, "}");
    key(",\n", "pictures");
    integer("{", "taken", s->pictures);
    integer(",", "failed", s->pictures_failed);
    fv_writer_print(&out, "}");
}

/* A display and lines are told of only where there are any. */
static void write_devices(const struct fv_session *s)
{
    const struct fv_session_display *d = &s->display;
    const struct fv_session_gpio *g = &s->gpio;
    if (d->mode[0]) {
        key(",\n", "display");
        text("{", "mode", d->mode);
        number(",", "hz", d->hz);
        number(",", "measured_hz", d->measured_hz);
        text(",", "interface", d->atomic ? "atomic" : "legacy");
        key(",", "vblank");
        fv_writer_print(&out, d->vblank ? "true" : "false");
        integer(",", "flips", d->flips);
        integer(",", "skipped", d->skipped);
        integer(",", "dropped", d->dropped);
        integer(",", "busy", d->busy);
        integer(",", "odd", d->odd);
        integer(",", "lost", d->lost);
        integer(",", "back", d->back);
        integer(",", "bytes", d->bytes);
        number(",", "copy_ms_mean", d->copy_ms_mean);
        number(",", "copy_ms_most", d->copy_ms_most);
        close_object();
    }
    if (g->lines > 0) {
        key(",\n", "gpio");
        integer("{", "lines", g->lines);
        integer(",", "vsyncs", g->vsyncs);
        integer(",", "odd", g->odd);
        number(",", "vsync_hz", g->vsync_hz);
        integer(",", "strobes", g->strobes);
        integer(",", "presses", g->presses);
        integer(",", "errors", g->errors);
        close_object();
    }
}

int fv_report_json(const struct fv_session *s, const struct fv_config *config, const char *path,
                   struct fv_error *error)
{
    if (fv_writer_open(&out, path, error)) return -1;
    text("{\n", "version", FV_VERSION);
    key(",\n", "host");
    text("{", "cpu", s->cpu);
    text(",", "isa", s->isa);
    integer(",", "threads", s->threads);
    fv_writer_print(&out, "}");
    write_config(config);
    key(",\n", "scene");
    text("{", "name", s->scene);
    integer(",", "triangles", s->triangles);
    integer(",", "fields", s->fields);
    fv_writer_print(&out, "}");
    text(",\n", "method", s->method);
    integer(",\n", "frames", s->frames);
    integer(",\n", "recorded", fv_recorded(s));
    integer(",\n", "missed", s->missed);
    integer(",\n", "late_corrected", s->late_corrected);
    integer(",\n", "cut_frames", s->cut_frames);
    integer(",\n", "skipped", s->skipped);
    integer(",\n", "levels", s->levels);
    number(",\n", "period_ms", s->period_ms);
    integer(",\n", "pixels", s->pixels);
    write_times(s);
    write_means(s);
    write_rings(s);
    write_sensors(s);
    write_devices(s);
    write_memory(s);
    write_plan(s);
    fv_writer_print(&out, "}\n");
    return fv_writer_close(&out, error);
}
