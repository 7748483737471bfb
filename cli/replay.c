/* replay: runs a recorded session again: its settings, with its tape in the sensors' place. */
#include "cli/cli.h"

#include "platform/log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The number of frames that were recorded, -1 where it is not there. */
static int64_t recorded_frames(const char *folder, struct fv_error *error)
{
    char path[FV_PATH_MAX], *text;
    size_t size;
    if (fv_path_join(path, folder, "tape/frames")) return fv_error_set(error, "%s: path too long", folder);
    if (fv_file_read(path, 64, &text, &size, error)) return -1;
    char *end;
    long long frames = strtoll(text, &end, 10);
    bool good = end != text && end[strspn(end, " \n")] == 0 && frames >= 1;
    free(text);
    return good ? frames : fv_error_set(error, "%s: not a number of frames", path);
}

static bool same_folder(const char *a, const char *b)
{
    struct stat sa, sb;
    return stat(a, &sa) == 0 && stat(b, &sb) == 0 && sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino;
}

int fv_verb_replay(const struct fv_arguments *arguments)
{
    static char settings[FV_PATH_MAX], head[FV_PATH_MAX + 16], gaze[FV_PATH_MAX + 16];
    struct fv_arguments a = *arguments;
    struct fv_error error;
    const char *folder = a.operand[0];
    if (!folder) {
        fv_log("replay: name the folder of the recorded run: foveola replay DIR --out OTHER");
        return FV_EXIT_UNUSABLE;
    }
    int64_t frames = recorded_frames(folder, &error);
    if (frames >= 0 && fv_path_join(settings, folder, "tape/settings.ini"))
        frames = fv_error_set(&error, "%s: path too long", folder);
    if (frames >= 0 && same_folder(folder, a.out))
        frames = fv_error_set(&error, "replay: --out %s is the recording itself: name another folder", a.out);
    if (frames < 0) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    /* Before what the command line sets, so that it can still change the rest. */
    const char *first[4] = {"eye.source=tape", "imu.source=tape", gaze, head};
    snprintf(gaze, sizeof gaze, "eye.tape=%.900s/tape/gaze.csv", folder);
    snprintf(head, sizeof head, "imu.tape=%.900s/tape/head.csv", folder);
    struct fv_config_request *r = &a.request;
    if (r->files == 16 || r->sets + 4 > 64) {
        fv_log("replay: too many --config or --set");
        return FV_EXIT_UNUSABLE;
    }
    for (int i = r->files++; i > 0; i--) r->file[i] = r->file[i - 1];
    r->file[0] = settings;
    for (int i = r->sets - 1; i >= 0; i--) r->set[i + 4] = r->set[i];
    for (int i = 0; i < 4; i++) r->set[i] = first[i];
    r->sets += 4;
    if (a.frames < 0) a.frames = frames;
    return fv_verb_run(&a);
}
