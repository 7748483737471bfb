/* decisions: see decisions.h. */
#include "cli/decisions.h"

#include "platform/arena.h"
#include "sensors/tape.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char first_line[] = "# foveola decisions 1", columns[] = "t_ns,level", late_column[] = "late_ns,";
static const int64_t latest_ns = 1000000000000000; /* as a tape's (sensors/tape.c) */

void fv_decisions_begin(struct fv_writer *writer, const char *const *stage, int stages, bool late)
{
    fv_writer_print(writer, "%s\n%s%s", first_line, columns, late ? ",late_ns" : "");
    for (int i = 0; i < stages; i++) fv_writer_print(writer, ",%s", stage[i]);
    fv_writer_print(writer, "\n");
}

void fv_decisions_write(struct fv_writer *writer, const struct fv_decision *decision, int stages, bool late)
{
    fv_writer_print(writer, "%lld,%d", (long long)decision->t_ns, (int)decision->level);
    if (late) fv_writer_print(writer, ",%lld", (long long)decision->late_ns);
    for (int i = 0; i < stages; i++) fv_writer_print(writer, ",%d", (int)decision->done[i]);
    fv_writer_print(writer, "\n");
}

struct reading {
    const struct fv_decisions_of *of;
    const char *name, *at, *end; /* what is not read yet */
    struct fv_error *error;
    int line, stages;
    bool ours; /* the stages are of->stage */
    bool late; /* there is a column late_ns */
};

/* Takes `text` and the comma or line end behind it; false where it does not stand there. */
static bool take_text(struct reading *r, const char *text, size_t length, char behind)
{
    if ((size_t)(r->end - r->at) < length || memcmp(r->at, text, length) != 0) return false;
    const char *at = r->at + length;
    if (behind == '\n' && at < r->end && *at == '\r') at++;
    if (at < r->end && *at != behind) return false;
    r->at = at < r->end ? at + 1 : at;
    return at < r->end || behind == '\n';
}

/* As take_text, an integer. strtoll stops at the zero byte behind the text. */
static bool take_number(struct reading *r, char behind, int64_t least, int64_t most, int64_t *out)
{
    char *stop;
    if (r->at == r->end || (*r->at != '-' && (*r->at < '0' || *r->at > '9'))) return false;
    errno = 0;
    long long value = strtoll(r->at, &stop, 10);
    if (stop == r->at || errno || value < least || value > most) return false;
    *out = value;
    return take_text(r, r->at, (size_t)(stop - r->at), behind);
}

/* The two lines before the first row. */
static int take_header(struct reading *r)
{
    r->line = 1;
    if (!take_text(r, first_line, sizeof first_line - 1, '\n'))
        return fv_error_set(r->error, "%s:1: not decisions of a version that is known; must be '%s'", r->name,
                            first_line);
    r->line = 2;
    const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
    struct reading line = *r;
    line.end = stop ? stop + 1 : r->end;
    for (const char *c = line.at; c < line.end; c++) r->stages += *c == ',';
    r->stages--;
    bool named = take_text(&line, columns, sizeof columns - 1, r->stages > 0 ? ',' : '\n');
    if ((size_t)(line.end - line.at) >= sizeof late_column - 1) r->late = named && memcmp(line.at, late_column, sizeof late_column - 1) == 0;
    if (r->late) line.at += sizeof late_column - 1, r->stages--;
    if (!named || r->stages < 1 || r->stages > FV_STAGES_MAX)
        return fv_error_set(r->error, "%s:2: column names are missing; must be %s and 1 to %d stages",
                            r->name, columns, FV_STAGES_MAX);
    r->ours = r->stages == r->of->stages;
    for (int i = 0; r->ours && i < r->stages; i++) {
        const char *stage = r->of->stage[i];
        r->ours = take_text(&line, stage, strlen(stage), i + 1 < r->stages ? ',' : '\n');
    }
    r->at = line.end;
    return 0;
}

static int take_row(struct reading *r, int64_t after_ns, struct fv_decision *d)
{
    int64_t value;
    bool decided;
    if (!take_number(r, ',', after_ns + 1, latest_ns, &d->t_ns))
        return fv_error_set(r->error, "%s:%d: t_ns is no time in ns behind the one before", r->name, r->line);
    if (!take_number(r, ',', 0, INT32_MAX, &value))
        return fv_error_set(r->error, "%s:%d: the level is not a number from 0 on", r->name, r->line);
    d->level = (int32_t)value;
    decided = d->level != 0;
    d->late_ns = 0;
    if (r->late && (!take_number(r, ',', 0, latest_ns, &d->late_ns) || (d->late_ns > 0 && d->late_ns <= d->t_ns)))
        return fv_error_set(r->error, "%s:%d: late_ns is neither 0 nor a time in ns behind t_ns", r->name, r->line);
    memset(d->done, -1, sizeof d->done);
    for (int i = 0; i < r->stages; i++) {
        if (!take_number(r, i + 1 < r->stages ? ',' : '\n', -1, INT32_MAX, &value))
            return fv_error_set(r->error, "%s:%d: not %d numbers of tiles, -1 for all, behind the level",
                                r->name, r->line, r->stages);
        d->done[i] = (int32_t)value;
        decided |= value != -1;
        if (value > r->of->tiles)
            return fv_error_set(r->error, "%s:%d: %lld tiles done of %d: not of pictures of this size",
                                r->name, r->line, (long long)value, r->of->tiles);
    }
    if (decided && !r->ours)
        return fv_error_set(r->error, "%s:%d: level and tiles of a method with other stages than this one's",
                            r->name, r->line);
    if (d->level >= r->of->levels)
        return fv_error_set(r->error, "%s:%d: level %d; must be 0 to %d, as the method has no other", r->name,
                            r->line, (int)d->level, r->of->levels - 1);
    return 0;
}

int fv_decisions_parse(const char *name, const char *text, size_t size, const struct fv_decisions_of *of,
                       struct fv_decision *decision, struct fv_error *error)
{
    struct reading r = {.of = of, .name = name, .at = text, .end = text + size, .error = error};
    struct fv_decision row = {.t_ns = -1, .late_ns = -1};
    int64_t rows = 0;
    if (take_header(&r)) return -1;
    for (; r.at < r.end; rows++) {
        r.line++;
        if (rows == of->frames) break;
        if (take_row(&r, row.late_ns > row.t_ns ? row.late_ns : row.t_ns, &row)) return -1;
        if (decision) decision[rows] = row;
    }
    if (rows == of->frames && r.at == r.end) return 0;
    return fv_error_set(error, "%s:%d: %s rows than the %lld frames that were recorded", name, r.line,
                        rows < of->frames ? "fewer" : "more", (long long)of->frames);
}

int fv_decisions_read(const struct fv_decision **decision, const char *path, const struct fv_decisions_of *of,
                      struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, FV_TAPE_BYTES_MAX, &text, &size, error)) return -1;
    int result = fv_decisions_parse(path, text, size, of, NULL, error);
    if (result == 0) {
        struct fv_decision *all =
            fv_arena_take(fv_arena(), "decisions", (size_t)of->frames * sizeof *all, 64);
        result = fv_decisions_parse(path, text, size, of, all, error);
        *decision = all;
    }
    free(text);
    return result;
}
