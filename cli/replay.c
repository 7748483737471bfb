/* replay: runs a recorded session again: its settings, with its tape in the sensors' place and what the clock
 * decided then in the clock's. */
#include "cli/cli.h"

#include "platform/log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The number of frames that were recorded, -1 where it is not there. */
static int64_t recorded_frames(const char *folder, struct fv_error *error)
{
    char path[FV_PATH_MAX], *text;
    size_t size;
    if (fv_path_join(path, folder, "tape/settings.ini") == 0 && fv_file_exists(path) &&
        fv_path_join(path, folder, "tape/frames") == 0 && !fv_file_exists(path))
        return fv_error_set(error, "%s: not there: the recording was cut off, or goes on; its head.csv and gaze.csv are "
                            "tapes", path);
    if (fv_path_join(path, folder, "tape/frames")) return fv_error_set(error, "%s: path too long", folder);
    if (fv_file_read(path, 64, &text, &size, error)) return -1;
    char *end;
    long long frames = strtoll(text, &end, 10), dropped = 0;
    end += strspn(end, " \n");
    bool whole = sscanf(end, "dropped %lld", &dropped) != 1;
    bool good = end != text && (!whole || *end == 0) && frames >= 1;
    free(text);
    if (good && !whole)
        return fv_error_set(error, "%s: %lld rows were dropped while it was recorded: no replay of it can be exact; "
                            "its head.csv and gaze.csv are tapes", path, dropped);
    return good ? frames : fv_error_set(error, "%s: not a number of frames", path);
}

/* Puts the recording's settings before what the command line sets, so that it can still change the rest,
 * and behind it that nothing waits for a display, where no decisions (`decided`) see to that: with them the pace
 * stays what it was, as it says that late pictures are turned. */
static int take_settings(struct fv_config_request *r, const char *settings, const char *head,
                         const char *gaze, bool decided)
{
    const char *const first[] = {"eye.source=tape",         "imu.source=tape",        gaze, head, "threads.fifo=0",
                                 "threads.lock_memory=off", "threads.cpu_latency_us=-1"};
    enum { FIRST = sizeof first / sizeof first[0] };
    if (r->files == 16 || r->sets + FIRST + 1 > 64) return -1;
    for (int i = r->files++; i > 0; i--) r->file[i] = r->file[i - 1];
    r->file[0] = settings;
    for (int i = r->sets - 1; i >= 0; i--) r->set[i + FIRST] = r->set[i];
    memcpy(r->set, first, sizeof first);
    r->sets += FIRST;
    if (!decided) r->set[r->sets++] = "budget.pace=free";
    return 0;
}

/* The recording in `folder` as the arguments of a run. */
static int take_recording(struct fv_arguments *a, const char *folder, struct fv_error *error)
{
    static char settings[FV_PATH_MAX], decisions[FV_PATH_MAX], head[FV_PATH_MAX + 16], gaze[FV_PATH_MAX + 16];
    int64_t frames = recorded_frames(folder, error);
    if (frames < 0) return -1;
    if (fv_path_join(settings, folder, "tape/settings.ini") ||
        fv_path_join(decisions, folder, "tape/decisions.csv"))
        return fv_error_set(error, "%s: path too long", folder);
    if (fv_same_folder(folder, a->out))
        return fv_error_set(error, "replay: --out %s is the recording itself: name another folder", a->out);
    if (fv_file_exists(decisions)) {
        a->decisions = decisions;
        a->recorded = frames;
        if (a->frames > frames)
            return fv_error_set(error, "replay: --frames %lld: %lld were recorded", (long long)a->frames,
                                (long long)frames);
    }
    if (a->frames < 0) a->frames = frames;
    snprintf(gaze, sizeof gaze, "eye.tape=%.900s/tape/gaze.csv", folder);
    snprintf(head, sizeof head, "imu.tape=%.900s/tape/head.csv", folder);
    if (take_settings(&a->request, settings, head, gaze, a->recorded > 0))
        return fv_error_set(error, "replay: too many --config or --set");
    return 0;
}

int fv_verb_replay(const struct fv_arguments *arguments)
{
    struct fv_arguments a = *arguments;
    struct fv_error error;
    const char *folder = a.operand[0];
    if (!folder) {
        fv_log("replay: name the folder of the recorded run: foveola replay DIR --out OTHER");
        return FV_EXIT_UNUSABLE;
    }
    if (take_recording(&a, folder, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    return fv_verb_run(&a);
}
