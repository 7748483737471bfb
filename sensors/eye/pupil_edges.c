/* pupil_edges: the frame boxed down to the working size, smoothed, its gradient, and edges one pixel thin.
 * Rows are plain loops over whole numbers of 16 bits, which vectorise on every machine. */
#include "sensors/eye/pupil_work.h"

#include <math.h>
#include <string.h>

/* Slopes in levels of grey a working pixel. Below the least one, sensor noise of 2 levels (0.3 after box
 * and smoothing) makes edges; an outline of a pupil is never so steep that it needs more than the most. */
static const double slope_least = 1.25, slope_most = 4;
/* Of the pixels this share is taken as edgeless (skin, iris, background); Canny thresholds of published
 * detectors lie at 0.7 to 0.8. */
static const double edgeless_share = 0.8;

/* One working row of scale 2, the usual one. */
static void box_two(const uint8_t *restrict a, const uint8_t *restrict b, uint16_t *restrict out, int width)
{
    for (int x = 0; x < width; x++)
        out[x] = (uint16_t)((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]) * (FV_GREY / 4));
}

static void box_any(const struct fv_eye_frame *frame, int y, struct fv_pupil_work *work, uint16_t *out)
{
    int scale = work->scale, wide = work->width * scale;
    uint32_t *column = work->column;
    memset(column, 0, (size_t)wide * sizeof *column);
    for (int i = 0; i < scale; i++) {
        const uint8_t *from = frame->pixels + (ptrdiff_t)(y * scale + i) * frame->stride;
        for (int x = 0; x < wide; x++) column[x] += from[x];
    }
    float share = (float)FV_GREY / (float)(scale * scale);
    for (int x = 0; x < work->width; x++) {
        uint32_t sum = 0;
        for (int i = 0; i < scale; i++) sum += column[x * scale + i];
        out[x] = (uint16_t)((float)sum * share + 0.5f);
    }
}

static void box(const struct fv_eye_frame *frame, struct fv_pupil_work *work)
{
    for (int y = 0; y < work->height; y++) {
        uint16_t *out = work->grey + (size_t)y * (size_t)work->row;
        if (work->scale == 2) {
            const uint8_t *from = frame->pixels + (ptrdiff_t)(2 * y) * frame->stride;
            box_two(from, from + frame->stride, out, work->width);
        } else box_any(frame, y, work, out);
    }
}

/* Binomial smoothing over 5 pixels; sums of 16 times 4080 at most fit 16 bits. */
static void smooth_across(const uint16_t *restrict in, uint16_t *restrict out, int width)
{
    for (int x = 2; x < width - 2; x++)
        out[x] = (uint16_t)(in[x - 2] + 4 * in[x - 1] + 6 * in[x] + 4 * in[x + 1] + in[x + 2]) >> 4;
}

static void smooth_down(const uint16_t *restrict in, int row, uint16_t *restrict out, int width)
{
    for (int x = 2; x < width - 2; x++)
        out[x] =
            (uint16_t)(in[x - 2 * row] + 4 * in[x - row] + 6 * in[x] + 4 * in[x + row] + in[x + 2 * row]) >>
            4;
}

/* Central differences, and their length as the greater one + 3/8 of the lesser. */
static void gradient(const uint16_t *restrict in, int row, int16_t *restrict gx, int16_t *restrict gy,
                     int16_t *restrict slope, int width)
{
    for (int x = FV_PUPIL_BORDER; x < width - FV_PUPIL_BORDER; x++) {
        int16_t dx = (int16_t)(in[x + 1] - in[x - 1]), dy = (int16_t)(in[x + row] - in[x - row]);
        int16_t ax = dx < 0 ? (int16_t)-dx : dx, ay = dy < 0 ? (int16_t)-dy : dy;
        int16_t more = ax > ay ? ax : ay, less = ax > ay ? ay : ax;
        gx[x] = dx;
        gy[x] = dy;
        slope[x] = (int16_t)(more + (less >> 1) - (less >> 3));
    }
}

/* Highest along the gradient's nearest axis, of equals the first. */
static void thin_row(const int16_t *restrict gx, const int16_t *restrict gy, const int16_t *restrict slope,
                     int row, int16_t threshold, uint8_t *restrict thin, int width)
{
    for (int x = FV_PUPIL_BORDER + 1; x < width - FV_PUPIL_BORDER - 1; x++) {
        int16_t dx = gx[x], dy = gy[x], here = slope[x];
        int16_t ax = dx < 0 ? (int16_t)-dx : dx, ay = dy < 0 ? (int16_t)-dy : dy;
        int16_t left = slope[x - 1], right = slope[x + 1], up = slope[x - row], down = slope[x + row];
        int16_t one = ax >= ay ? left : up, other = ax >= ay ? right : down;
        thin[x] = (uint8_t)((here >= threshold) & (here > one) & (here >= other));
    }
}

/* The slope that edgeless_share of the pixels stay below, within its limits; by every fourth row. */
static int threshold_of(const struct fv_pupil_work *work)
{
    enum { BIN = 4, BINS = 64 };
    int histogram[BINS + 1] = {0}, counted = 0, below = 0, bin = 0;
    for (int y = FV_PUPIL_BORDER; y < work->height - FV_PUPIL_BORDER; y += 4) {
        const int16_t *slope = work->slope + (size_t)y * (size_t)work->row;
        for (int x = FV_PUPIL_BORDER; x < work->width - FV_PUPIL_BORDER; x += 2) {
            histogram[slope[x] / BIN < BINS ? slope[x] / BIN : BINS]++;
            counted++;
        }
    }
    for (; bin < BINS && below + histogram[bin] < edgeless_share * counted; bin++) below += histogram[bin];
    double least = slope_least * FV_SLOPE, most = slope_most * FV_SLOPE;
    return (int)fmin(fmax((double)bin * BIN, least), most);
}

/* Marks the edges; where there are more than the list holds, again with a higher threshold. */
static void thin(struct fv_pupil_work *work)
{
    work->threshold = threshold_of(work);
    for (int round = 0; round < 8; round++) {
        int found = 0;
        memset(work->thin, 0, (size_t)work->row * (size_t)work->height);
        for (int y = FV_PUPIL_BORDER + 1; y < work->height - FV_PUPIL_BORDER - 1; y++) {
            size_t at = (size_t)y * (size_t)work->row;
            int in_row = 0;
            thin_row(work->gx + at, work->gy + at, work->slope + at, work->row, (int16_t)work->threshold,
                     work->thin + at, work->width);
            for (int x = 0; x < work->row; x++) in_row += work->thin[at + (size_t)x];
            found += in_row;
        }
        if (found <= FV_EDGES_MAX) break;
        work->threshold += work->threshold / 2;
    }
}

/* How far from the pixel the slope is highest, from its neighbours' along one axis. */
static float summit(int before, int here, int after)
{
    int bend = 2 * here - before - after;
    return bend > 0 ? 0.5f * (float)(after - before) / (float)bend : 0;
}

static void add_edge(struct fv_pupil_work *work, int x, int y)
{
    size_t at = (size_t)y * (size_t)work->row + (size_t)x;
    float gx = work->gx[at], gy = work->gy[at], scale = 1 / sqrtf(gx * gx + gy * gy);
    const int16_t *slope = work->slope + at;
    bool across = fabsf(gx) >= fabsf(gy);
    struct fv_edge *e = &work->edge[work->edges];
    e->x = (float)x + (across ? summit(slope[-1], slope[0], slope[1]) : 0);
    e->y = (float)y + (across ? 0 : summit(slope[-work->row], slope[0], slope[work->row]));
    e->nx = gx * scale;
    e->ny = gy * scale;
    e->column = (int16_t)x;
    e->row = (int16_t)y;
    e->next = e->before = FV_NO_EDGE;
    e->link = 0;
    work->at[at] = (uint16_t)work->edges++;
}

static void collect(struct fv_pupil_work *work)
{
    work->edges = 0;
    for (int y = FV_PUPIL_BORDER + 1; y < work->height - FV_PUPIL_BORDER - 1; y++) {
        const uint8_t *row = work->thin + (size_t)y * (size_t)work->row;
        for (int x = 0; x < work->row; x += 8) {
            uint64_t eight;
            memcpy(&eight, row + x, 8);
            if (!eight) continue;
            for (int i = 0; i < 8; i++)
                if (row[x + i] && work->edges < FV_EDGES_MAX) add_edge(work, x + i, y);
        }
    }
}

void fv_pupil_edges(const struct fv_eye_frame *frame, struct fv_pupil_work *work)
{
    size_t row = (size_t)work->row, pixels = row * (size_t)work->height;
    box(frame, work);
    fv_pupil_spots(work);
    for (int y = 0; y < work->height; y++)
        smooth_across(work->grey + (size_t)y * row, work->across + (size_t)y * row, work->width);
    for (int y = 2; y < work->height - 2; y++)
        smooth_down(work->across + (size_t)y * row, work->row, work->smooth + (size_t)y * row, work->width);
    memset(work->slope, 0, pixels * sizeof *work->slope);
    memset(work->gx, 0, pixels * sizeof *work->gx);
    memset(work->gy, 0, pixels * sizeof *work->gy);
    for (int y = FV_PUPIL_BORDER; y < work->height - FV_PUPIL_BORDER; y++) {
        size_t at = (size_t)y * row;
        gradient(work->smooth + at, work->row, work->gx + at, work->gy + at, work->slope + at, work->width);
    }
    memset(work->at, 0xff, pixels * sizeof *work->at);
    thin(work);
    collect(work);
}
