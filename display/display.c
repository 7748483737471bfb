/* display: the table of sinks, and what they have in common: one that failed takes no more. */
#include "display/display.h"

#include "display/sink.h"
#include "platform/arena.h"

#include <string.h>

struct fv_display {
    const struct fv_sink *sink;
    void *state;
    bool failed;
    int width, height, eyes; /* what pictures must be */
};

static void *none_open(const struct fv_config *config, const char *folder, struct fv_error *error)
{
    (void)config, (void)folder, (void)error;
    static char nothing;
    return &nothing;
}

static bool none_wants(const void *state, int64_t frame, bool last)
{
    (void)state, (void)frame, (void)last;
    return false;
}

static int none_present(void *state, const struct fv_picture *picture, int64_t frame, struct fv_error *error)
{
    (void)state, (void)picture, (void)frame, (void)error;
    return 0;
}

static int none_close(void *state, struct fv_error *error)
{
    (void)state, (void)error;
    return 0;
}

static const struct fv_sink none = {"none", none_open, none_wants, none_present, none_close, NULL, NULL};
static const struct fv_sink *const sinks[] = {&fv_sink_png, &fv_sink_y4m, &fv_sink_kms, &none};
enum { SINKS = sizeof sinks / sizeof sinks[0] };

int fv_display_open(struct fv_display **display, const struct fv_config *config, const char *folder,
                    struct fv_error *error)
{
    const struct fv_sink *sink = NULL;
    for (int i = 0; i < SINKS; i++)
        if (strcmp(sinks[i]->name, config->display_sink) == 0) sink = sinks[i];
    if (!sink)
        return fv_config_error(error, "display.sink", "'%.60s' is not known; there are: png y4m kms none",
                               config->display_sink);
    void *state = sink->open(config, folder, error);
    if (!state) return -1;
    struct fv_display *d = fv_arena_take(fv_arena(), "display", sizeof *d, 64);
    *d = (struct fv_display){.sink = sink,
                             .state = state,
                             .width = (int)config->display_width,
                             .height = (int)config->display_height,
                             .eyes = (int)config->display_eyes};
    *display = d;
    return 0;
}

bool fv_display_wants(const struct fv_display *d, int64_t frame, bool last)
{
    return !d->failed && d->sink->wants(d->state, frame, last);
}

int fv_display_present(struct fv_display *d, const struct fv_picture *picture, int64_t frame,
                       struct fv_error *error)
{
    if (d->failed)
        return fv_error_set(error, "the %s sink takes no more since its first error", d->sink->name);
    if (picture->width != d->width || picture->height != d->height || picture->eyes != d->eyes)
        return fv_error_set(error, "the %s sink was opened for %d eyes of %d x %d, not %d of %d x %d",
                            d->sink->name, d->eyes, d->width, d->height, picture->eyes, picture->width,
                            picture->height);
    if (d->sink->present(d->state, picture, frame, error) == 0) return 0;
    d->failed = true;
    return -1;
}

int fv_display_close(struct fv_display *d, struct fv_error *error)
{
    return d->sink->close(d->state, error);
}

bool fv_display_beat(struct fv_display *d, struct fv_beat *beat)
{
    return d->sink->beat && d->sink->beat(d->state, beat);
}

struct fv_display_counts fv_display_counts(const struct fv_display *d)
{
    struct fv_display_counts counts = {.hz = 0};
    if (d->sink->counts) d->sink->counts(d->state, &counts);
    return counts;
}
