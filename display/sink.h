/* sink: a way to store frames; display.c holds the table. */
#ifndef FV_DISPLAY_SINK_H
#define FV_DISPLAY_SINK_H

#include "display/display.h"

struct fv_sink {
    const char *name; /* as in display.sink */
    /* Takes all memory and returns the sink's own state; NULL with the error set. */
    void *(*open)(const struct fv_config *config, const char *folder, struct fv_error *error);
    bool (*wants)(const void *state, int64_t frame, bool last);
    int (*present)(void *state, const struct fv_picture *picture, int64_t frame, struct fv_error *error);
    int (*close)(void *state, struct fv_error *error);
    /* Of a display, else NULL: its beat; what it has done. */
    bool (*beat)(void *state, struct fv_beat *beat);
    void (*counts)(const void *state, struct fv_display_counts *counts);
};

extern const struct fv_sink fv_sink_png, fv_sink_y4m, fv_sink_kms;

#endif
