/* decisions: the third file of a recording, tape/decisions.csv: what the clock decided for each frame. With
 * what was latched (sensors/tape.h) it makes the same pictures again, however long frames take then.
 *
 *   # foveola decisions 1
 *   t_ns,level,select,support,reproject,sample
 *
 * A column for each stage, by its name, then rows, one a frame: struct fv_decision. Where late pictures are turned, a
 * column late_ns stands behind the level: 0, or the time that a picture was turned for. */
#ifndef FV_CLI_DECISIONS_H
#define FV_CLI_DECISIONS_H

#include "platform/files.h"
#include "rt/frame/session.h"

#include <stddef.h>

/* `late`: with that column. */
void fv_decisions_begin(struct fv_writer *writer, const char *const *stage, int stages, bool late);
void fv_decisions_write(struct fv_writer *writer, const struct fv_decision *decision, int stages, bool late);

/* What decisions are taken for. */
struct fv_decisions_of {
    const char *const *stage; /* names */
    int stages, levels, tiles;
    int64_t frames; /* that were recorded */
};

/* Reads the text of a file of decisions, `size` bytes followed by a zero byte, into `decision`, one for each
 * of of->frames; NULL only checks. `name` is for messages. Stages of other names, or another number of them,
 * are taken where nothing was decided but t_ns (level 0, nothing cut): any method can follow those. Returns
 * 0, or -1 with "name:line: ...". */
int fv_decisions_parse(const char *name, const char *text, size_t size, const struct fv_decisions_of *of,
                       struct fv_decision *decision, struct fv_error *error);

/* Reads a file into the arena ("decisions"). Before the seal only. */
int fv_decisions_read(const struct fv_decision **decision, const char *path, const struct fv_decisions_of *of,
                      struct fv_error *error);

#endif
