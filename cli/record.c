/* record: the tape of a session; see record.h. */
#include "cli/record.h"

#include "cli/decisions.h"
#include "sensors/eye/frame_tape.h"
#include "sensors/tape.h"

#include <string.h>

/* The files that grow while the session runs. */
enum { HEAD, GAZE, DECISIONS };
static const char *const names[FV_RECORD_FILES] = {
    [HEAD] = "head.csv", [GAZE] = "gaze.csv", [DECISIONS] = "decisions.csv"};
static struct fv_writer file[FV_RECORD_FILES];
static int stages;
static bool late_too; /* decisions have the column late_ns */
static bool opened;

/* What waits to be written. */
enum { LATCHED, DECIDED, SPOOLS };
static struct fv_spool spool[SPOOLS];
static struct fv_record_latched latched[FV_RECORD_ROWS];
static struct fv_decision decided[FV_RECORD_ROWS];
static atomic_int failed; /* the first failure ends the whole recording, not the run */

static int write_settings(const struct fv_config *config, const char *folder, struct fv_error *error)
{
    static struct fv_writer out;
    static char value[FV_LIST_MAX * 32];
    char path[FV_PATH_MAX];
    const char *section = "";
    if (fv_path_join(path, folder, "settings.ini")) return fv_error_set(error, "%s: path too long", folder);
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "; every setting of the recorded run\n");
    for (int i = 0; i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        if (strcmp(section, k->section) != 0) fv_writer_print(&out, "[%s]\n", section = k->section);
        fv_config_text(config, k, value, sizeof value);
        fv_writer_print(&out, "%s = ", k->name);
        /* Lists go on over indented lines: lines of settings files are short. */
        int words = 0;
        for (const char *c = value; *c; c++) {
            bool rows = k->kind == FV_KEY_LIST || k->kind == FV_KEY_ROWS;
            bool next_line = rows && *c == ' ' && ++words % 4 == 0;
            fv_writer_bytes(&out, next_line ? "\n   " : c, next_line ? 4 : 1);
        }
        fv_writer_print(&out, "\n");
    }
    return fv_writer_close(&out, error);
}

static int open_one(struct fv_writer *writer, const char *folder, const char *name, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    if (fv_path_join(path, folder, name)) return fv_error_set(error, "%s: path too long", folder);
    return fv_writer_open(writer, path, error);
}

static int write_latched(void *context, const void *row)
{
    const struct fv_record_latched *l = row;
    (void)context;
    fv_tape_write_head(&file[HEAD], &l->head);
    fv_tape_write_gaze(&file[GAZE], &l->gaze);
    return file[HEAD].failed ? file[HEAD].failed : file[GAZE].failed;
}

static int write_decided(void *context, const void *row)
{
    (void)context;
    fv_decisions_write(&file[DECISIONS], row, stages, late_too);
    return file[DECISIONS].failed;
}

int fv_record_open(const struct fv_config *config, const char *const *stage, int count, bool late, const char *out,
                   struct fv_spooler *spooler, struct fv_error *error)
{
    char folder[FV_PATH_MAX];
    if (fv_path_join(folder, out, "tape")) return fv_error_set(error, "%s: path too long", out);
    if (fv_folder_make(folder, error)) return -1;
    for (int i = 0; i < FV_RECORD_FILES; i++)
        if (open_one(&file[i], folder, names[i], error)) return -1;
    /* Nothing of an older recording may stand beside this one. */
    fv_file_remove(folder, "frames");
    fv_file_remove(folder, "imu.csv");
    fv_file_remove(folder, "eye.csv");
    for (int eye = 0; eye < 2; eye++) fv_file_remove(folder, fv_frame_tape_name[eye]);
    for (int i = 0; i < FV_RECORD_FILES; i++) fv_file_remove(folder, names[i]);
    if (write_settings(config, folder, error)) return -1;
    fv_tape_begin_head(&file[HEAD]);
    fv_tape_begin_gaze(&file[GAZE]);
    fv_decisions_begin(&file[DECISIONS], stage, stages = count, late_too = late);
    fv_spool_begin(&spool[LATCHED], "tape", latched, FV_RECORD_ROWS, sizeof latched[0], write_latched, NULL, &failed);
    fv_spool_begin(&spool[DECIDED], "tape", decided, FV_RECORD_ROWS, sizeof decided[0], write_decided, NULL, &failed);
    for (int i = 0; i < SPOOLS; i++) fv_spooler_add(spooler, &spool[i]);
    opened = true;
    return 0;
}

void fv_record_latch(int64_t t_ns, const struct fv_pose *head, const struct fv_gaze *gaze)
{
    struct fv_record_latched row = {
        .head = {.t_ns = t_ns, .pose = *head},
        .gaze = {.t_ns = t_ns, .valid = !gaze->held, .uncertainty_deg = gaze->uncertainty_deg}};
    memcpy(row.gaze.direction, gaze->direction, sizeof row.gaze.direction);
    fv_spool_put(&spool[LATCHED], &row);
}

void fv_record_decision(const struct fv_decision *decision)
{
    fv_spool_put(&spool[DECIDED], decision);
}

int fv_record_close(int64_t frames, const char *out, struct fv_error *error)
{
    static struct fv_writer count;
    char path[FV_PATH_MAX];
    if (!opened) return 0;
    opened = false;
    int cut = 0;
    int64_t dropped = 0;
    for (int i = 0; i < SPOOLS; i++) dropped += fv_spool_counts(&spool[i]).dropped;
    for (int i = 0; i < FV_RECORD_FILES; i++) cut |= fv_writer_close_cut(&file[i], error);
    if (cut)
        return fv_error_set(error, "%s/tape: the recording is not whole: it can be used as a tape, not replayed", out);
    if (fv_path_join(path, out, "tape/frames")) return fv_error_set(error, "%s: path too long", out);
    if (fv_writer_open(&count, path, error)) return -1;
    fv_writer_print(&count, "%lld\n", (long long)frames);
    if (dropped > 0) fv_writer_print(&count, "dropped %lld\n", (long long)dropped);
    if (fv_writer_close(&count, error)) return -1;
    return dropped > 0 ? fv_error_set(error,
                                      "%s/tape: %lld rows were dropped, as the disk did not keep up: it can be used as a "
                                      "tape, not replayed",
                                      out, (long long)dropped)
                       : 0;
}
