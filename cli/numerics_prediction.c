/* numerics_prediction: the predictors of head pose and gaze against what came: on the simulated head and
 * eyes, and on the tapes that the sensors read. A recording is an array of samples; a prediction is made
 * at many of them from those up to there, for each horizon, and compared with the later samples. */
#include "cli/experiments.h"

#include "platform/arena.h"
#include "sensors/predict.h"
#include "sensors/tape.h"

#include <math.h>
#include <string.h>

enum {
    HISTORY = 32,
    PREDICTIONS = 4000, /* of one row at most */
    SIM_SECONDS = 60,
    HORIZONS = 5
};
static const int horizons_ms[HORIZONS] = {5, 10, 20, 40, 80};
static const int64_t head_period_ns = 1000000, gaze_period_ns = 5000000;

/* What came is known between samples at most this far apart. */
static const int64_t head_gap_ns = 50000000, gaze_gap_ns = 20000000;

struct heads {
    const char *name;
    const struct fv_head_sample *sample;
    int64_t count;
};

struct gazes {
    const char *name;
    const struct fv_gaze_sample *sample;
    int64_t count;
};

static double between_deg(const double a[3], const double b[3])
{
    double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double sine = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    return atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * (180 / M_PI);
}

/* The rotation at a time, between the samples *at and *at + 1, which is moved on to it; false where there
 * is none or they are too far apart. */
static bool head_at(const struct heads *h, int64_t *at, int64_t t_ns, double rotation[4])
{
    while (*at + 1 < h->count && h->sample[*at + 1].t_ns < t_ns) ++*at;
    if (*at + 1 >= h->count) return false;
    const struct fv_head_sample *a = &h->sample[*at], *b = a + 1;
    int64_t apart_ns = b->t_ns - a->t_ns;
    if (apart_ns > head_gap_ns || t_ns < a->t_ns) return false;
    fv_quat_slerp(a->pose.rotation, b->pose.rotation, (double)(t_ns - a->t_ns) / (double)apart_ns, rotation);
    return true;
}

static int head_errors(const struct heads *h, const struct fv_head_predictor *p, int64_t horizon_ns,
                       double *error)
{
    int64_t step = h->count / PREDICTIONS + 1, at = 0;
    int count = 0;
    for (int64_t i = HISTORY - 1; i < h->count; i += step) {
        struct fv_pose predicted;
        double came[4];
        int64_t t_ns = h->sample[i].t_ns + horizon_ns;
        if (at < i) at = i;
        if (!head_at(h, &at, t_ns, came)) continue;
        p->predict(h->sample + i - (HISTORY - 1), HISTORY, t_ns, &predicted);
        error[count++] = fv_quat_angle(predicted.rotation, came) * (180 / M_PI);
    }
    return count;
}

/* As head_at, for both eyes; samples that are lost are none. */
static bool gaze_at(const struct gazes *g, int64_t *at, int64_t t_ns, double direction[2][3])
{
    while (*at + 1 < g->count && g->sample[*at + 1].t_ns < t_ns) ++*at;
    if (*at + 1 >= g->count) return false;
    const struct fv_gaze_sample *a = &g->sample[*at], *b = a + 1;
    int64_t apart_ns = b->t_ns - a->t_ns;
    if (!a->valid || !b->valid || apart_ns > gaze_gap_ns || t_ns < a->t_ns) return false;
    double part = (double)(t_ns - a->t_ns) / (double)apart_ns;
    for (int eye = 0; eye < 2; eye++)
        for (int i = 0; i < 3; i++)
            direction[eye][i] = a->direction[eye][i] + (b->direction[eye][i] - a->direction[eye][i]) * part;
    return true;
}

/* Both eyes' errors. */
static int gaze_errors(const struct gazes *g, const struct fv_gaze_predictor *p, int64_t horizon_ns,
                       double *error)
{
    int64_t step = g->count / PREDICTIONS + 1, at = 0;
    int count = 0;
    for (int64_t i = HISTORY - 1; i < g->count; i += step) {
        double predicted[2][3], came[2][3];
        int64_t t_ns = g->sample[i].t_ns + horizon_ns;
        if (at < i) at = i;
        if (!g->sample[i].valid || !gaze_at(g, &at, t_ns, came)) continue;
        p->predict(g->sample + i - (HISTORY - 1), HISTORY, t_ns, predicted);
        for (int eye = 0; eye < 2; eye++) error[count++] = between_deg(predicted[eye], came[eye]);
    }
    return count;
}

static void *take(size_t bytes)
{
    return fv_arena_take(fv_arena(), "numerics", bytes, 64);
}

/* The tape's readings, each once: where rows come faster than poses, what a head did lies between those
 * that differ. */
static struct heads tape_heads(const struct fv_tape *tape)
{
    struct fv_head_sample *sample = take((size_t)tape->heads * sizeof *sample);
    struct heads heads = {"imu.tape", sample, 0};
    for (int64_t i = 0; i < tape->heads; i++)
        if (i == 0 || memcmp(&tape->head[i].pose, &tape->head[i - 1].pose, sizeof tape->head[i].pose) != 0)
            sample[heads.count++] = tape->head[i];
    return heads;
}

void fv_experiment_head(struct fv_setup *setup, struct fv_numerics *n)
{
    int64_t count = SIM_SECONDS * 1000000000ll / head_period_ns;
    struct fv_head_sample *simulated = take((size_t)count * sizeof *simulated);
    const struct fv_tape *tape = fv_sensors_imu_tape(setup->sensors);
    double *error = take(PREDICTIONS * sizeof *error);
    for (int64_t i = 0; i < count; i++) {
        simulated[i].t_ns = i * head_period_ns;
        fv_sim_head((uint64_t)setup->config.imu_seed, simulated[i].t_ns, &simulated[i].pose);
    }
    struct heads heads[2] = {{"simulated head", simulated, count}};
    if (tape) heads[1] = tape_heads(tape);
    for (int source = 0; source < (tape ? 2 : 1); source++)
        for (int k = 0; k < HORIZONS; k++)
            for (int p = 0; p < FV_HEAD_PREDICTORS && !fv_numerics_stopped(n); p++) {
                const struct fv_head_predictor *predictor = &fv_head_predictors[p];
                struct fv_numeric_row *row =
                    fv_numerics_add(n, "head prediction", predictor->what, "deg", "%s %d ms ahead",
                                    heads[source].name, horizons_ms[k]);
                int errors = head_errors(&heads[source], predictor, horizons_ms[k] * 1000000ll, error);
                fv_numerics_errors(row, error, errors);
            }
}

void fv_experiment_gaze(struct fv_setup *setup, struct fv_numerics *n)
{
    int64_t count = SIM_SECONDS * 1000000000ll / gaze_period_ns;
    struct fv_gaze_sample *simulated = take((size_t)count * sizeof *simulated);
    const struct fv_tape *tape = fv_sensors_eye_tape(setup->sensors);
    double *error = take(2 * PREDICTIONS * sizeof *error);
    for (int64_t i = 0; i < count; i++)
        fv_sim_gaze((uint64_t)setup->config.eye_seed, i * gaze_period_ns, &simulated[i]);
    struct gazes gazes[2] = {{"simulated eyes", simulated, count}};
    if (tape) gazes[1] = (struct gazes){"eye.tape", tape->gaze, tape->gazes};
    for (int source = 0; source < (tape ? 2 : 1); source++)
        for (int k = 0; k < HORIZONS; k++)
            for (int p = 0; p < FV_GAZE_PREDICTORS && !fv_numerics_stopped(n); p++) {
                const struct fv_gaze_predictor *predictor = &fv_gaze_predictors[p];
                struct fv_numeric_row *row =
                    fv_numerics_add(n, "gaze prediction", predictor->name, "deg", "%s %d ms ahead",
                                    gazes[source].name, horizons_ms[k]);
                int errors = gaze_errors(&gazes[source], predictor, horizons_ms[k] * 1000000ll, error);
                fv_numerics_errors(row, error, errors);
            }
}
