/* profile: sums and percentiles over the frame records; see profile.h. */
#include "cli/profile.h"

#include "cli/columns.h"

#include <math.h>

double fv_stage_seconds(const struct fv_session *s)
{
    int64_t n = fv_recorded(s);
    if (n == 0) return 0;
    double period_s = isfinite(s->period_ms) && s->period_ms > 0 ? s->period_ms * 1e-3 : 0;
    double worked_s = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).mean * 1e-3 * (double)n;
    return fmax(fv_record_seconds(s, n - 1) + period_s, worked_s); /* NaN is passed over */
}

/* A row of a column whose values are `parts` times what is shown. */
static struct fv_stage_row row_of(const struct fv_session *s, const struct fv_column *column,
                                  const char *name, int parts)
{
    int64_t n = fv_recorded(s), runs = 0;
    double frame_ms = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).mean;
    double mean_ms = fv_column_summary(s, column).mean, seconds = fv_stage_seconds(s);
    for (int64_t i = 0; i < n; i++) runs += fv_column_value(s, column, i) > 0;
    return (struct fv_stage_row){.name = name,
                                 .rate_hz = seconds > 0 ? (double)runs / seconds : (double)NAN,
                                 .p50_ms = fv_column_percentile(s, column, 0, n, 50) / parts,
                                 .p99_ms = fv_column_percentile(s, column, 0, n, 99) / parts,
                                 .max_ms = fv_column_summary(s, column).max / parts,
                                 .share = frame_ms > 0 ? mean_ms / parts / frame_ms : (double)NAN,
                                 .late = -1};
}

static int64_t late_frames(const struct fv_session *s, int stage)
{
    int64_t late = 0;
    for (int64_t i = 0; i < fv_recorded(s); i++) late += s->record[i].late_stages >> stage & 1;
    return late;
}

static int workers_of(const struct fv_session *s)
{
    return s->threads > 1 ? s->threads : 1;
}

int fv_stage_rows(const struct fv_session *s, struct fv_stage_row row[FV_STAGE_ROWS_MAX])
{
    int count = 0;
    double staged = 0;
    for (; count < fv_stages(s); count++) {
        struct fv_column column = fv_column_stage(count);
        row[count] = row_of(s, &column, fv_stage_name(s, count), 1);
        row[count].late = late_frames(s, count);
        if (row[count].share > 0) staged += row[count].share;
    }
    row[count] = row_of(s, &fv_columns[FV_COLUMN_CONTROL_MS], "control", 1);
    if (row[count].max_ms > 0) {
        if (row[count].share > 0) staged += row[count].share;
        count++;
    }
    row[count] = row_of(s, &fv_columns[FV_COLUMN_IDLE_MS], "idle", workers_of(s));
    if (row[count].max_ms > 0) count++;
    if (1 - staged >= 0.001 && fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).mean > 0)
        row[count++] = (struct fv_stage_row){"in no stage", (double)NAN, (double)NAN, (double)NAN,
                                             (double)NAN,   1 - staged,  -1};
    return count;
}

double fv_idle_share(const struct fv_session *s)
{
    double frame_ms = fv_column_summary(s, &fv_columns[FV_COLUMN_FRAME_MS]).mean;
    double idle_ms = fv_column_summary(s, &fv_columns[FV_COLUMN_IDLE_MS]).mean;
    return frame_ms > 0 ? idle_ms / workers_of(s) / frame_ms : (double)NAN;
}

int fv_rings(const struct fv_session *s)
{
    int count = FV_RINGS;
    while (count > 0 && s->ring[count - 1].tiles == 0 && s->ring[count - 1].cut == 0) count--;
    return count;
}

double fv_ring_ns_per_unit(const struct fv_ring *ring)
{
    return ring->units > 0 ? ring->cpu_ns / (double)ring->units : (double)NAN;
}
