/* main: the command line, a table of verbs; options.c has the options. */
#include "cli/cli.h"

#include "platform/log.h"

#include <string.h>
#include <unistd.h>

const struct fv_verb fv_verbs[] = {
    {"run", fv_verb_run, "--config --set --out --frames ", 0, "run [--frames N]",
     "the frame loop; until N frames, SIGINT, SIGTERM or SIGHUP; report in --out (default: out)"},
    {"replay", fv_verb_replay, "--config --set --out --frames ", 1, "replay DIR",
     "runs a recorded session again; the same bytes of every picture"},
    {"compare", fv_verb_compare, "--ppd --gaze --fov ", 2,
     "compare REFERENCE.png TEST.png [--ppd N] [--gaze x,y] [--fov DEGREES]",
     "PSNR, RMSE, SSIM and FLIP of a picture, by eccentricity from the gaze (pixels; default: the centre)"},
    {"measure", fv_verb_measure, "--config --set --out --method --level --seconds --shard --merge --table --part --frames ",
     FV_OPERANDS_MAX,
     "measure [--method M] [--level L] [--seconds S] [--shard I/N] [--merge DIR...] | --table NAME [--part P] [--frames N]",
     "error against run time: sweeps methods and levels on a scene; or a paper's table measured again; in --out"},
    {"calibrate", fv_verb_calibrate, "--config --set --out --points ", 0, "calibrate [--points 5|9|13]",
     "shows targets, fits the gaze to the eye cameras' frames: calibration.csv for eye.calibration, report, in --out"},
    {"check", fv_verb_check, "--config --set --json --seconds --root ", 0, "check [--json] [--seconds S]",
     "is this board ready for these settings: devices, permissions, clock, heat, rays/s, the level that the budget holds"},
    {"plan", fv_verb_plan, "--config --set --frames ", 0, "plan",
     "what this scene and method need, what is left out and why; no frame is run"},
    {"help", fv_verb_help, "", 1, "help [VERB|SECTION|KEY|man]", "this; the settings of a section; one setting; the manual page"},
    {"version", fv_verb_version, "", 0, "version", "the version"},
};
const int fv_verbs_count = sizeof fv_verbs / sizeof fv_verbs[0];

static int run_verb(int count, char **text)
{
    struct fv_arguments arguments = {.out = "out",
                                     .frames = -1,
                                     .points = 9,
                                     .ppd = 67,
                                     .measure = {.level = -1, .shards = 1}};
    const char *verb = count > 1 ? text[1] : "help";
    if (strcmp(verb, "--help") == 0 || strcmp(verb, "-h") == 0) verb = "help";
    if (strcmp(verb, "--version") == 0) verb = "version";
    for (int i = 0; i < fv_verbs_count; i++) {
        if (strcmp(verb, fv_verbs[i].name) != 0) continue;
        if (count > 2 && fv_options_read(&arguments, &fv_verbs[i], count - 2, text + 2))
            return FV_EXIT_UNUSABLE;
        return fv_verbs[i].run(&arguments);
    }
    fv_log("'%s' is no verb; 'foveola help' lists them", verb);
    return FV_EXIT_UNUSABLE;
}

/* Ends without destructors: what libraries took is never given back, and the heap is sealed. */
int main(int count, char **text)
{
    int code = run_verb(count, text);
    fv_setup_close();
    _exit(code);
}
