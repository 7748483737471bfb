/* gaze_map: from a pupil to a gaze, by a polynomial that a calibration fits: the user looks at 5, 9 or 13
 * known targets (any number from 5 on will do), many samples at each.
 *
 * Terms: 1 x y xy where fewer than 6 places were looked at, with x2 y2 from there on, with x2y xy2 from 12 on
 * (the usual ones; Cerrolaza, Villanueva and Cabeza 2008 compare them). Least squares by Householder's QR in
 * double, terms above the linear ones kept small by a ridge (Tikhonov), so that few or unluckily placed
 * targets bend little.
 *
 * Pupil minus glint moves less with the headset than the pupil alone: where the calibration saw the glint
 * often enough, a second map is fitted to the difference, and used whenever the glint is seen. */
#ifndef FV_SENSORS_GAZE_MAP_H
#define FV_SENSORS_GAZE_MAP_H

#include <stdbool.h>

/* What an eye image gives, pixels. */
struct fv_gaze_feature {
    double pupil[2];
    double glint[2]; /* meaningless where not seen */
    bool glint_seen;
};

/* One sample of a calibration: the target's direction in degrees right and up; its weight, such as the
 * pupil's confidence (0: left out). */
struct fv_gaze_target {
    struct fv_gaze_feature feature;
    double direction_deg[2], weight;
};

enum { FV_GAZE_TERMS = 8, FV_GAZE_TARGETS_MAX = 4096 };

struct fv_gaze_polynomial {
    int terms;               /* 0: there is none */
    double middle[2], scale; /* (x, y) are (feature - middle) / scale */
    double reach[2][2];      /* least and most of x and of y seen; beyond, the map goes on straight */
    double coefficient[2][FV_GAZE_TERMS];
    double error_deg; /* root mean square over the calibration's samples */
    double condition; /* of the system that was solved, ridge and all: largest over least singular value */
};

struct fv_gaze_map {
    struct fv_gaze_polynomial pupil, difference;
};

/* Why there is no map. */
enum fv_gaze_refusal {
    FV_GAZE_CALIBRATED,
    FV_GAZE_FEW,               /* fewer than 5 samples or 5 places */
    FV_GAZE_MANY,              /* more than FV_GAZE_TARGETS_MAX */
    FV_GAZE_TARGETS_EQUAL,     /* all targets within half a degree */
    FV_GAZE_TARGETS_COLLINEAR, /* all targets near one line */
    FV_GAZE_PUPIL_STILL,       /* the pupil did not move */
    FV_GAZE_PUPIL_COLLINEAR,   /* it moved along one line only */
    FV_GAZE_UNRELATED,         /* the fit's error is a large part of how far the targets are apart */
    FV_GAZE_REFUSALS
};
/* A sentence for each, for the user. */
extern const char *const fv_gaze_refusal_text[FV_GAZE_REFUSALS];

/* Fits the map. Samples that are not finite count as left out. On a refusal the map is empty. */
enum fv_gaze_refusal fv_gaze_calibrate(const struct fv_gaze_target *target, int n, struct fv_gaze_map *map);

/* The same for judging a calibration by what is left when a target's samples are given weight 0: 4 places
 * will do. */
enum fv_gaze_refusal fv_gaze_calibrate_rest(const struct fv_gaze_target *target, int n,
                                            struct fv_gaze_map *map);

/* Largest over least singular value of the upper triangle of terms x terms, by Jacobi's rotations of its
 * columns (one-sided; Hestenes 1958); infinite where the least is 0. Exposed for its test. */
double fv_gaze_condition(double (*row)[FV_GAZE_TERMS + 2], int terms);

/* The gaze of a feature, degrees right and up, and its error as known from the calibration, which grows with
 * the distance from where it looked. False where the map is empty or the feature not finite. */
bool fv_gaze_map_at(const struct fv_gaze_map *map, const struct fv_gaze_feature *feature,
                    double direction_deg[2], double *error_deg);

/* Solves min |A x - b| for two right sides at once: rows of terms + 2 numbers, n >= terms; overwrites them.
 * x: [2][FV_GAZE_TERMS]. False where A has not full rank to working precision. Exposed for its test. */
bool fv_gaze_solve(double (*row)[FV_GAZE_TERMS + 2], int n, int terms, double x[2][FV_GAZE_TERMS]);

#endif
