/* pupil: sizes and scratch memory of the pupil search, and where it looks. See the header. */
#include "sensors/eye/pupil_work.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Around the last pupil is looked this many times its major axis to each side: a saccade's fastest, 700
 * degrees a second, moves it by one width between frames at 120 Hz. Its width changes by at most a third. */
static const double region_share = 1.6, region_change = 1.35;
enum { REGION_LEAST = 24, REGION_SIDE = 160 };
/* The narrowest pupil that can be told at all: 2.5 px in radius at the working size. */
static const double width_least = 5;

struct fv_pupil_limits fv_pupil_limits(int width, int height)
{
    double longer = width > height ? width : height, shorter = width > height ? height : width;
    return (struct fv_pupil_limits){fmax(8, longer / 32), 0.42 * shorter};
}

static int scale_of(int width, int height, int side)
{
    int longer = width > height ? width : height;
    return (longer + side - 1) / side;
}

static size_t taken(char *base, size_t *used, size_t bytes, void **part)
{
    *part = base ? base + *used : NULL;
    *used += (bytes + 63) & ~(size_t)63;
    return *used;
}

/* Lays the parts out in the scratch memory (NULL: only counts); returns the bytes. */
static size_t lay_out(int width, int height, int side, struct fv_pupil_work *work, void *scratch)
{
    size_t used = 0, wide = (size_t)width;
    memset(work, 0, sizeof *work);
    work->scale = scale_of(width, height, side);
    work->width = width / work->scale;
    work->height = height / work->scale;
    work->row = (work->width + 15) & ~15;
    size_t pixels = (size_t)work->row * (size_t)work->height;
    taken(scratch, &used, 2 * pixels, (void **)&work->grey);
    taken(scratch, &used, 2 * pixels, (void **)&work->smooth);
    taken(scratch, &used, 2 * pixels, (void **)&work->across);
    taken(scratch, &used, 2 * pixels, (void **)&work->gx);
    taken(scratch, &used, 2 * pixels, (void **)&work->gy);
    taken(scratch, &used, 2 * pixels, (void **)&work->slope);
    taken(scratch, &used, 2 * pixels, (void **)&work->at);
    taken(scratch, &used, pixels, (void **)&work->thin);
    taken(scratch, &used, pixels, (void **)&work->hidden);
    taken(scratch, &used, wide * sizeof *work->column, (void **)&work->column);
    taken(scratch, &used, FV_EDGES_MAX * sizeof *work->edge, (void **)&work->edge);
    taken(scratch, &used, FV_EDGES_MAX * sizeof *work->order, (void **)&work->order);
    return taken(scratch, &used, FV_ARCS_MAX * sizeof *work->arc, (void **)&work->arc);
}

static bool can_search(int width, int height)
{
    return width >= 1 && height >= 1 && width <= FV_PUPIL_SIDE_MAX && height <= FV_PUPIL_SIDE_MAX;
}

size_t fv_pupil_scratch_bytes(int width, int height)
{
    struct fv_pupil_work work;
    if (!can_search(width, height)) return 0;
    /* Regions are smaller than the frame but less boxed down: never more than this. */
    size_t whole = lay_out(width, height, FV_PUPIL_SIDE, &work, NULL);
    return whole + 2 * 64 * (size_t)(width + height) + (size_t)16 * REGION_SIDE * (REGION_SIDE + 16);
}

/* In working pixels, rounded down; limits that are no number are 0. */
static int radius_of(double width, int scale)
{
    return (int)fmin(fmax(width, 0) / (2 * scale), FV_PUPIL_SIDE);
}

static void search(const struct fv_eye_frame *frame, const struct fv_pupil_limits *limits, int side,
                   void *scratch, struct fv_pupil *pupil)
{
    struct fv_pupil_work work;
    memset(pupil, 0, sizeof *pupil);
    lay_out(frame->width, frame->height, side, &work, scratch);
    work.least = radius_of(fmax(limits->least, width_least * work.scale), work.scale);
    work.most = radius_of(limits->most, work.scale);
    /* Too small for an outline with something around it. */
    int room = 2 * work.least + 2 * FV_PUPIL_BORDER;
    if (work.least < 1 || work.most < work.least || work.width < room || work.height < room) return;
    fv_pupil_edges(frame, &work);
    fv_pupil_arcs(&work);
    fv_pupil_outline(frame, &work, pupil);
    pupil->found = pupil->confidence >= FV_PUPIL_CONFIDENT;
}

static int within(double at, int size)
{
    return (int)fmin(fmax(at, 0), size);
}

/* Around the last pupil; false where it is not found there. */
static bool follow(const struct fv_eye_frame *frame, const struct fv_pupil *last, void *scratch,
                   struct fv_pupil *pupil)
{
    double half = fmax(region_share * last->major, REGION_LEAST);
    int left = within(last->x - half, frame->width), right = within(last->x + half + 1, frame->width);
    int top = within(last->y - half, frame->height), bottom = within(last->y + half + 1, frame->height);
    if (left >= right || top >= bottom) return false;
    struct fv_eye_frame region = {frame->pixels + top * frame->stride + left, right - left, bottom - top,
                                  frame->stride};
    struct fv_pupil_limits limits = {last->major / region_change, last->major * region_change};
    search(&region, &limits, REGION_SIDE, scratch, pupil);
    if (!pupil->found) return false;
    pupil->x += left;
    pupil->y += top;
    return true;
}

void fv_pupil_find(const struct fv_eye_frame *frame, const struct fv_pupil_limits *limits,
                   struct fv_pupil_track *track, void *scratch, struct fv_pupil *pupil)
{
    memset(pupil, 0, sizeof *pupil);
    if (can_search(frame->width, frame->height)) {
        struct fv_pupil_limits usual = fv_pupil_limits(frame->width, frame->height);
        bool followed = track && track->last.found && follow(frame, &track->last, scratch, pupil);
        if (track) track->followed += followed;
        if (!followed) search(frame, limits ? limits : &usual, FV_PUPIL_SIDE, scratch, pupil);
    }
    if (!track) return;
    track->last = *pupil;
    track->frames++;
    track->found += pupil->found;
}
