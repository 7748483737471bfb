/* columns: a session's frame records seen as columns of numbers, and what reports say of one.
 *
 * Values that are not finite (a poisoned measurement) stay out of every statistic; where no value
 * is left, the statistic is NaN. Nothing here allocates. */
#ifndef FV_CLI_COLUMNS_H
#define FV_CLI_COLUMNS_H

#include "rt/frame/session.h"

#include <stddef.h>

enum fv_column_name {
    FV_COLUMN_FRAME,
    FV_COLUMN_T_NS,
    FV_COLUMN_FRAME_MS,
    FV_COLUMN_CPU_MS,
    FV_COLUMN_CONTROL_MS,
    FV_COLUMN_IDLE_MS,
    FV_COLUMN_PREDICTED_MS,
    FV_COLUMN_BUDGET_MS,
    FV_COLUMN_LATCH_MS,
    FV_COLUMN_STAGE, /* the first stage; stands for all of them where columns are listed */
    FV_COLUMN_LEVEL,
    FV_COLUMN_PERIODS,
    FV_COLUMN_R0,
    FV_COLUMN_R1,
    FV_COLUMN_P_MIN,
    FV_COLUMN_PRIMARY,
    FV_COLUMN_SHADOW,
    FV_COLUMN_SECONDARY,
    FV_COLUMN_MARCH_STEPS,
    FV_COLUMN_MARCH_LIMITED,
    FV_COLUMN_SAMPLED,
    FV_COLUMN_GAZE, /* left x y, right x y */
    FV_COLUMN_GAZE_LATENCY = FV_COLUMN_GAZE + 4,
    FV_COLUMN_MISSED,
    FV_COLUMN_CUT,
    FV_COLUMN_CUT_TILES,
    FV_COLUMN_LATE_STAGES,
    FV_COLUMNS
};

enum fv_column_kind { FV_COLUMN_FLOAT, FV_COLUMN_INT32, FV_COLUMN_UINT32, FV_COLUMN_INT64, FV_COLUMN_BOOL };

struct fv_column {
    const char *name; /* as in the header of frames.csv; units last */
    enum fv_column_kind kind;
    size_t offset; /* in struct fv_frame_record */
};

extern const struct fv_column fv_columns[FV_COLUMNS];

/* The column of one stage, 0 to FV_STAGES_MAX - 1. */
struct fv_column fv_column_stage(int stage);

/* Frames that have a record, stages that have a name, and that name ("" where it is missing). */
int64_t fv_recorded(const struct fv_session *session);
int fv_stages(const struct fv_session *session);
const char *fv_stage_name(const struct fv_session *session, int stage);

/* One value, of a record or of a session's record of that number; NaN where it is not finite. */
double fv_record_value(const struct fv_frame_record *record, const struct fv_column *column);
double fv_column_value(const struct fv_session *session, const struct fv_column *column, int64_t record);

/* Percentile by nearest rank (the smallest value that at least `percent` of the values do not
 * exceed), of `count` records from `first` on, to single precision; 0 < percent <= 100. */
double fv_column_percentile(const struct fv_session *session, const struct fv_column *column, int64_t first,
                            int64_t count, double percent);

struct fv_summary {
    double min, mean, max;
};
struct fv_summary fv_column_summary(const struct fv_session *session, const struct fv_column *column);

/* A column over time, short enough to draw: each record a point, or in a long session smallest, median
 * and largest of as many bins of neighbours as keep within FV_POINTS_MAX drawn points. */
enum { FV_POINTS_MAX = 2000, FV_BINS = FV_POINTS_MAX / 3 };
struct fv_series {
    int count;
    bool binned; /* min and max differ from y */
    double t_s[FV_POINTS_MAX], y[FV_POINTS_MAX], min[FV_POINTS_MAX], max[FV_POINTS_MAX];
};
void fv_column_series(const struct fv_session *session, const struct fv_column *column,
                      struct fv_series *series);

/* Seconds from the first record to record i; the number of the record, in periods, where the session's
 * times do not grow. */
double fv_record_seconds(const struct fv_session *session, int64_t record);

#endif
