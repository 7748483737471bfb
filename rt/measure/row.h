/* row: one row of a sweep: a method at a quality level, how long its frames took and how far they
 * were from the reference. Kept as one small file each, so that an interrupted sweep goes on where it
 * stopped and the shares of several machines can be put together. */
#ifndef FV_MEASURE_ROW_H
#define FV_MEASURE_ROW_H

#include "platform/files.h"
#include "rt/measure/metrics.h"

enum { FV_ROWS_MAX = 256 };

/* Over a row's frames or judged pictures: the value itself, and the range between its error bars. */
struct fv_measured {
    double value, low, high;
};

struct fv_measure_row {
    char scene[64], method[32];
    int level;
    char parameters[128]; /* "r0=10 r1=20 p_min=0.05" */
    char about[320];      /* machine, display and reference: the same in all rows that one run measured */
    char key[32];         /* fingerprint of everything that rows of one sweep share */
    double period_ms;     /* of the display */
    int frames, pictures; /* timed frames; judged pictures */
    struct fv_measured frame_ms; /* median, quartiles */
    double frame_ms_p99;
    struct fv_measured full_frame_ms; /* of the full renderer at 1 sample, interleaved: median, quartiles */
    struct fv_measured speedup;       /* median of full / this at the same pose, quartiles */
    double rays, sampled_fraction;    /* means a frame */
    struct fv_measured
        psnr[FV_ZONES]; /* of the mean squared error of all judged pictures; worst and best one */
    struct fv_measured rmse[FV_ZONES]; /* root of the mean square of all; smallest and largest picture's */
    struct fv_measured ssim[FV_ZONES], flip[FV_ZONES]; /* mean; smallest and largest */
    struct fv_measured flicker;                        /* above the reference's: mean; smallest and largest */
};

/* One "name value" a line. Reading: -1 where the file is missing, damaged or of another version. */
int fv_row_write(const struct fv_measure_row *row, const char *path, struct fv_error *error);
int fv_row_read(struct fv_measure_row *row, const char *path, struct fv_error *error);

/* By scene, method in the order of the method table, and level. */
void fv_rows_sort(struct fv_measure_row *row, int rows);

/* True where no other row of the scene is both faster (in speed-up) and better in the zone's PSNR. */
bool fv_row_is_pareto(const struct fv_measure_row *row, int rows, int which, enum fv_zone zone);

/* The fastest row of a method whose PSNR in the zone reaches `decibel`; -1 where none does. Rows of one
 * scene. */
int fv_rows_reach(const struct fv_measure_row *row, int rows, const char *method, enum fv_zone zone,
                  double decibel);

/* measure.csv: the columns that scripts depend on. Cells without a value are empty. */
int fv_rows_csv(const struct fv_measure_row *row, int rows, const char *path, struct fv_error *error);

#endif
