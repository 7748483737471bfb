/* record: the tape of a session; see record.h. */
#include "cli/record.h"

#include "platform/log.h"
#include "sensors/tape.h"

#include <string.h>

static struct fv_writer head_file, gaze_file;
static bool recording;

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
        if (k->kind == FV_KEY_LIST) {
            /* One row a line: lines of settings files are short. */
            fv_writer_print(&out, "%s =", k->name);
            for (char *row = value; row; ) {
                char *next = strstr(row, ", ");
                if (next) *next = 0;
                fv_writer_print(&out, " %s\n%s", row, next ? "   " : "");
                row = next ? next + 2 : NULL;
            }
        } else {
            fv_writer_print(&out, "%s = %s\n", k->name, value);
        }
    }
    return fv_writer_close(&out, error);
}

static int open_one(struct fv_writer *writer, const char *folder, const char *name, struct fv_error *error)
{
    char path[FV_PATH_MAX];
    if (fv_path_join(path, folder, name)) return fv_error_set(error, "%s: path too long", folder);
    return fv_writer_open(writer, path, error);
}

int fv_record_open(const struct fv_config *config, const char *out, struct fv_error *error)
{
    char folder[FV_PATH_MAX];
    if (fv_path_join(folder, out, "tape")) return fv_error_set(error, "%s: path too long", out);
    if (fv_folder_make(folder, error) || write_settings(config, folder, error)) return -1;
    if (open_one(&head_file, folder, "head.csv", error) || open_one(&gaze_file, folder, "gaze.csv", error)) return -1;
    fv_tape_begin_head(&head_file);
    fv_tape_begin_gaze(&gaze_file);
    recording = true;
    return 0;
}

void fv_record_latch(int64_t t_ns, const struct fv_pose *head, const struct fv_gaze *gaze)
{
    if (!recording) return;
    struct fv_head_sample h = {.t_ns = t_ns, .pose = *head};
    struct fv_gaze_sample g = {.t_ns = t_ns, .valid = !gaze->held};
    memcpy(g.direction, gaze->direction, sizeof g.direction);
    fv_tape_write_head(&head_file, &h);
    fv_tape_write_gaze(&gaze_file, &g);
    if (!head_file.failed && !gaze_file.failed) return;
    recording = false;
    fv_log("tape: %s: recording ends here", strerror(head_file.failed ? head_file.failed : gaze_file.failed));
}

int fv_record_close(int64_t frames, const char *out, struct fv_error *error)
{
    static struct fv_writer count;
    char path[FV_PATH_MAX];
    if (!recording) return 0;
    recording = false;
    if (fv_writer_close(&head_file, error) || fv_writer_close(&gaze_file, error)) return -1;
    if (fv_path_join(path, out, "tape/frames")) return fv_error_set(error, "%s: path too long", out);
    if (fv_writer_open(&count, path, error)) return -1;
    fv_writer_print(&count, "%lld\n", (long long)frames);
    return fv_writer_close(&count, error);
}
