/* eye_tape: see eye_tape.h. */
#include "sensors/eye/eye_tape.h"

#include "platform/arena.h"

#include <math.h>
#include <string.h>

static const char first_lines[] =
    "# foveola eye 1\n"
    "eye,t_ns,arrival_ns,found,confidence,pupil_x_px,pupil_y_px,major_px,minor_px,angle_deg,glint,glint_x_px,glint_y_px,"
    "seen,right_deg,up_deg,error_deg,event,event_ns\n";
static const char *const event_name[] = {[FV_EVENT_NONE] = "none",
                                         [FV_EVENT_FIXATION] = "fixation",
                                         [FV_EVENT_SACCADE] = "saccade",
                                         [FV_EVENT_PURSUIT] = "pursuit",
                                         [FV_EVENT_BLINK] = "blink"};

struct fv_eye_recorder {
    struct fv_writer writer;
    struct fv_spool spool;
    struct fv_eye_row ring[FV_EYE_RECORDER_ROWS];
};

static int write_row(void *context, const void *data)
{
    struct fv_eye_recorder *r = context;
    const struct fv_eye_row *row = data;
    const struct fv_pupil *p = &row->pupil;
    const struct fv_eye_look *l = &row->look;
    bool glint = l->feature.glint_seen;
    fv_writer_print(&r->writer, "%s,%lld,%lld,%d,%.4g,%.9g,%.9g,%.9g,%.9g,%.9g", row->eye ? "right" : "left",
                    (long long)l->t_ns, (long long)row->arrival_ns, p->found, p->confidence, p->x, p->y, p->major,
                    p->minor, p->angle * (180 / M_PI));
    fv_writer_print(&r->writer, ",%d,%.9g,%.9g,%d,%.9g,%.9g,%.9g,%s,%lld\n", glint, glint ? l->feature.glint[0] : 0,
                    glint ? l->feature.glint[1] : 0, l->seen, l->at_deg[0], l->at_deg[1], l->error_deg,
                    event_name[row->event], (long long)row->event_ns);
    return r->writer.failed;
}

int fv_eye_recorder_open(struct fv_eye_recorder **recorder, const char *folder, struct fv_spooler *spooler,
                         struct fv_error *error)
{
    struct fv_eye_recorder *r = fv_arena_take(fv_arena(), "sensors", sizeof *r, 64);
    char path[FV_PATH_MAX];
    memset(r, 0, sizeof *r);
    if (fv_path_join(path, folder, "eye.csv")) return fv_error_set(error, "%.100s: path too long", folder);
    if (fv_writer_open(&r->writer, path, error)) return -1;
    fv_writer_bytes(&r->writer, first_lines, sizeof first_lines - 1);
    fv_spool_begin(&r->spool, "tape/eye.csv", r->ring, FV_EYE_RECORDER_ROWS, sizeof r->ring[0], write_row, r, NULL);
    fv_spooler_add(spooler, &r->spool);
    *recorder = r;
    return 0;
}

void fv_eye_recorder_put(struct fv_eye_recorder *r, const struct fv_eye_row *row)
{
    fv_spool_put(&r->spool, row);
}

int fv_eye_recorder_close(struct fv_eye_recorder *r, int64_t session_ns, struct fv_error *error)
{
    if (!r->writer.failed && session_ns != INT64_MIN)
        fv_writer_print(&r->writer, "# session 0 = %lld ns\n", (long long)session_ns);
    return fv_writer_close_cut(&r->writer, error);
}
