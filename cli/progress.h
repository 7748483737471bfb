/* progress: what `run` says on standard error: a line that changes while it runs, and its closing lines. */
#ifndef FV_CLI_PROGRESS_H
#define FV_CLI_PROGRESS_H

#include "config/config.h"
#include "rt/frame/session.h"

/* The newest frame in one line, on a terminal only; `frames`: how many were asked for, -1: no end. */
void fv_progress_line(const struct fv_session *session, const struct fv_frame_record *record, int64_t frames);

/* What hints go by. */
struct fv_hints {
    bool adapts;   /* the method has levels to adapt */
    bool replayed; /* all was decided before: none would help */
};

/* The stage table; what was done and where to look; where many frames were late, which setting would help. */
void fv_progress_close(const struct fv_session *session, const struct fv_config *config,
                       const struct fv_hints *hints, const char *out);

#endif
