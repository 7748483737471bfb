/* columns: access by a table of offsets; percentiles by radix selection, which needs no copy. */
#include "cli/columns.h"

#include <math.h>
#include <string.h>

#define AT(member) offsetof(struct fv_frame_record, member)
const struct fv_column fv_columns[FV_COLUMNS] = {
    [FV_COLUMN_FRAME] = {"frame", FV_COLUMN_INT64, AT(frame)},
    [FV_COLUMN_T_NS] = {"t_ns", FV_COLUMN_INT64, AT(t_ns)},
    [FV_COLUMN_FRAME_MS] = {"frame_ms", FV_COLUMN_FLOAT, AT(frame_ms)},
    [FV_COLUMN_CPU_MS] = {"cpu_ms", FV_COLUMN_FLOAT, AT(cpu_ms)},
    [FV_COLUMN_CONTROL_MS] = {"control_ms", FV_COLUMN_FLOAT, AT(control_ms)},
    [FV_COLUMN_IDLE_MS] = {"idle_ms", FV_COLUMN_FLOAT, AT(idle_ms)},
    [FV_COLUMN_PREDICTED_MS] = {"predicted_ms", FV_COLUMN_FLOAT, AT(predicted_ms)},
    [FV_COLUMN_BUDGET_MS] = {"budget_ms", FV_COLUMN_FLOAT, AT(budget_ms)},
    [FV_COLUMN_LATCH_MS] = {"latch_ms", FV_COLUMN_FLOAT, AT(latch_ms)},
    [FV_COLUMN_STAGE] = {"stage", FV_COLUMN_FLOAT, AT(stage_ms)},
    [FV_COLUMN_LEVEL] = {"level", FV_COLUMN_INT32, AT(level)},
    [FV_COLUMN_PERIODS] = {"periods", FV_COLUMN_INT32, AT(periods)},
    [FV_COLUMN_R0] = {"r0_deg", FV_COLUMN_FLOAT, AT(r0_deg)},
    [FV_COLUMN_R1] = {"r1_deg", FV_COLUMN_FLOAT, AT(r1_deg)},
    [FV_COLUMN_P_MIN] = {"p_min", FV_COLUMN_FLOAT, AT(p_min)},
    [FV_COLUMN_PRIMARY] = {"rays_primary", FV_COLUMN_INT64, AT(rays[FV_RAY_PRIMARY])},
    [FV_COLUMN_SHADOW] = {"rays_shadow", FV_COLUMN_INT64, AT(rays[FV_RAY_SHADOW])},
    [FV_COLUMN_SECONDARY] = {"rays_secondary", FV_COLUMN_INT64, AT(rays[FV_RAY_SECONDARY])},
    [FV_COLUMN_MARCH_STEPS] = {"rays_march_steps", FV_COLUMN_INT64, AT(rays[FV_RAY_MARCH_STEPS])},
    [FV_COLUMN_MARCH_LIMITED] = {"rays_march_limited", FV_COLUMN_INT64, AT(rays[FV_RAY_MARCH_LIMITED])},
    [FV_COLUMN_SAMPLED] = {"sampled_fraction", FV_COLUMN_FLOAT, AT(sampled_fraction)},
    [FV_COLUMN_GAZE] = {"gaze_left_x_px", FV_COLUMN_FLOAT, AT(gaze_px[0][0])},
    [FV_COLUMN_GAZE + 1] = {"gaze_left_y_px", FV_COLUMN_FLOAT, AT(gaze_px[0][1])},
    [FV_COLUMN_GAZE + 2] = {"gaze_right_x_px", FV_COLUMN_FLOAT, AT(gaze_px[1][0])},
    [FV_COLUMN_GAZE + 3] = {"gaze_right_y_px", FV_COLUMN_FLOAT, AT(gaze_px[1][1])},
    [FV_COLUMN_GAZE_LATENCY] = {"gaze_latency_ms", FV_COLUMN_FLOAT, AT(gaze_latency_ms)},
    [FV_COLUMN_MISSED] = {"missed", FV_COLUMN_BOOL, AT(missed)},
    [FV_COLUMN_CUT] = {"cut", FV_COLUMN_BOOL, AT(cut)},
    [FV_COLUMN_CUT_TILES] = {"cut_tiles", FV_COLUMN_INT32, AT(cut_tiles)},
    [FV_COLUMN_LATE_STAGES] = {"late_stages", FV_COLUMN_UINT32, AT(late_stages)},
};

struct fv_column fv_column_stage(int stage)
{
    struct fv_column column = fv_columns[FV_COLUMN_STAGE];
    column.offset += (size_t)stage * sizeof(float);
    return column;
}

int64_t fv_recorded(const struct fv_session *s)
{
    int64_t n = s->frames < s->capacity ? s->frames : s->capacity;
    return s->record && n > 0 ? n : 0;
}

int fv_stages(const struct fv_session *s)
{
    return s->stages < FV_STAGES_MAX ? s->stages : FV_STAGES_MAX;
}

const char *fv_stage_name(const struct fv_session *s, int stage)
{
    return s->stage[stage] ? s->stage[stage] : "";
}

double fv_record_value(const struct fv_frame_record *record, const struct fv_column *column)
{
    const char *at = (const char *)record + column->offset;
    switch (column->kind) {
    case FV_COLUMN_INT32: return *(const int32_t *)at;
    case FV_COLUMN_UINT32: return *(const uint32_t *)at;
    case FV_COLUMN_INT64: return (double)*(const int64_t *)at;
    case FV_COLUMN_BOOL: return *(const bool *)at;
    case FV_COLUMN_FLOAT: break;
    }
    double value = *(const float *)at;
    return isfinite(value) ? value : (double)NAN;
}

double fv_column_value(const struct fv_session *s, const struct fv_column *column, int64_t record)
{
    return fv_record_value(&s->record[record], column);
}

/* Floats in order of size as unsigned integers, and back. */
static uint32_t key_of(double value)
{
    float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits >> 31 ? ~bits : bits | 1u << 31;
}

static double value_of(uint32_t key)
{
    uint32_t bits = key >> 31 ? key & ~(1u << 31) : ~key;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

double fv_column_percentile(const struct fv_session *s, const struct fv_column *column, int64_t first,
                            int64_t count, double percent)
{
    /* Digits of the key from the highest down: each round counts, among the values that share the
     * digits found so far, how many have each next digit. */
    enum { DIGIT = 11, DIGITS = 1 << DIGIT };
    static const int shifts[] = {32 - DIGIT, 32 - 2 * DIGIT, 0};
    int64_t rank = 0;
    uint32_t found = 0, known = 0; /* known: mask of the digits found */
    for (int round = 0; round < 3; round++) {
        uint32_t counts[DIGITS] = {0};
        int64_t values = 0, below = 0;
        for (int64_t i = first; i < first + count; i++) {
            double value = fv_column_value(s, column, i);
            if (isnan(value)) continue;
            values++;
            uint32_t key = key_of(value);
            if ((key & known) == found)
                counts[key >> shifts[round] & (DIGITS - 1) & (~known >> shifts[round])]++;
        }
        if (values == 0) return (double)NAN;
        if (round == 0) {
            rank = (int64_t)ceil(percent * (double)values / 100);
            rank = rank < 1 ? 1 : rank > values ? values : rank;
        }
        uint32_t digit = 0;
        while (below + counts[digit] < rank) below += counts[digit++];
        rank -= below;
        found |= digit << shifts[round];
        known |= ~0u << shifts[round];
    }
    return value_of(found);
}

struct fv_summary fv_column_summary(const struct fv_session *s, const struct fv_column *column)
{
    struct fv_summary out = {(double)NAN, (double)NAN, (double)NAN};
    double sum = 0;
    int64_t values = 0;
    for (int64_t i = 0; i < fv_recorded(s); i++) {
        double value = fv_column_value(s, column, i);
        if (isnan(value)) continue;
        out.min = fmin(out.min, value);
        out.max = fmax(out.max, value);
        sum += value;
        values++;
    }
    if (values) out.mean = sum / (double)values;
    return out;
}

double fv_record_seconds(const struct fv_session *s, int64_t record)
{
    int64_t last = fv_recorded(s) - 1;
    double period_s = isfinite(s->period_ms) && s->period_ms > 0 ? s->period_ms * 1e-3 : 1;
    double length = ((double)s->record[last].t_ns - (double)s->record[0].t_ns) * 1e-9;
    if (length <= 0) return (double)record * period_s;
    double t = ((double)s->record[record].t_ns - (double)s->record[0].t_ns) * 1e-9;
    return fmin(fmax(t, 0), length);
}

void fv_column_series(const struct fv_session *s, const struct fv_column *column, struct fv_series *series)
{
    int64_t n = fv_recorded(s);
    series->binned = n > FV_POINTS_MAX;
    series->count = series->binned ? FV_BINS : (int)n;
    for (int i = 0; i < series->count; i++) {
        int64_t first = i * n / series->count, count = (i + 1) * n / series->count - first;
        series->t_s[i] = fv_record_seconds(s, first + count / 2);
        series->y[i] = series->min[i] = series->max[i] = fv_column_value(s, column, first);
        if (!series->binned) continue;
        series->y[i] = fv_column_percentile(s, column, first, count, 50);
        for (int64_t k = first + 1; k < first + count; k++) {
            series->min[i] = fmin(series->min[i], fv_column_value(s, column, k));
            series->max[i] = fmax(series->max[i], fv_column_value(s, column, k));
        }
    }
}
