/* main: the command line, by two tables: verbs and options. */
#include "cli/cli.h"

#include "platform/log.h"
#include "rt/measure/sweep.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const struct fv_verb fv_verbs[] = {
    {"run", fv_verb_run, "--config --set --out --frames ", 0, "run [--frames N]",
     "the frame loop; until N frames, SIGINT or SIGTERM; report in --out (default: out)"},
    {"replay", fv_verb_replay, "--config --set --out --frames ", 1, "replay DIR",
     "runs a recorded session again; the same bytes of every picture"},
    {"compare", fv_verb_compare, "--ppd --gaze --fov ", 2,
     "compare REFERENCE.png TEST.png [--ppd N] [--gaze x,y] [--fov DEGREES]",
     "PSNR, RMSE, SSIM and FLIP of a picture, by eccentricity from the gaze (pixels; default: the centre)"},
    {"measure", fv_verb_measure, "--config --set --out --method --level --seconds --shard --merge ", FV_OPERANDS_MAX,
     "measure [--method M] [--level L] [--seconds S] [--shard I/N] [--merge DIR...]",
     "error against run time: sweeps methods and levels on a scene; measure.csv and report.html in --out"},
    {"plan", fv_verb_plan, "--config --set --frames ", 0, "plan",
     "what this scene and method need, what is left out and why; no frame is run"},
    {"help", fv_verb_help, "", 1, "help [VERB|SECTION|KEY]", "this; the settings of a section; one setting"},
    {"version", fv_verb_version, "", 0, "version", "the version"},
};
const int fv_verbs_count = sizeof fv_verbs / sizeof fv_verbs[0];

static int unusable(const char *format, const char *what)
{
    fv_log(format, what);
    return -1;
}

static int read_config(struct fv_arguments *a, const char *value)
{
    if (a->request.files == 16) return unusable("--config %s: at most 16 settings files", value);
    a->request.file[a->request.files++] = value;
    return 0;
}

static int read_set(struct fv_arguments *a, const char *value)
{
    if (a->request.sets == 64)
        return unusable("--set %s: at most 64 of them; put the rest into a settings file", value);
    a->request.set[a->request.sets++] = value;
    return 0;
}

static int read_out(struct fv_arguments *a, const char *value)
{
    a->out = value;
    return 0;
}

static int read_frames(struct fv_arguments *a, const char *value)
{
    char *end;
    errno = 0;
    a->frames = strtoll(value, &end, 10);
    if (errno || *end || end == value || a->frames < 1 || a->frames > 100000000)
        return unusable("--frames %s: must be a whole number from 1 to 100000000", value);
    return 0;
}

/* Reads a number in [least, most] that ends with `closing`; *end: what is behind that. */
static bool read_number(double *out, const char *text, char closing, double least, double most,
                        const char **end)
{
    char *stop;
    *out = strtod(text, &stop);
    *end = stop + 1;
    return stop != text && *stop == closing && *out >= least && *out <= most;
}

static int read_ppd(struct fv_arguments *a, const char *value)
{
    const char *end;
    if (!read_number(&a->ppd, value, 0, 1, 1000, &end))
        return unusable("--ppd %s: must be a number of pixels per degree from 1 to 1000", value);
    return 0;
}

static int read_fov(struct fv_arguments *a, const char *value)
{
    const char *end;
    if (!read_number(&a->fov_deg, value, 0, 0.1, 179, &end))
        return unusable("--fov %s: must be a number of degrees from 0.1 to 179", value);
    return 0;
}

static int read_gaze(struct fv_arguments *a, const char *value)
{
    const char *at;
    if (!read_number(&a->gaze_px[0], value, ',', -1e6, 1e6, &at) ||
        !read_number(&a->gaze_px[1], at, 0, -1e6, 1e6, &at))
        return unusable("--gaze %s: must be two numbers of pixels, x,y, as in --gaze 320,240", value);
    a->has_gaze = true;
    return 0;
}

static int read_method(struct fv_arguments *a, const char *value)
{
    a->measure.method = value;
    return 0;
}

static int read_level(struct fv_arguments *a, const char *value)
{
    char *end;
    long level = strtol(value, &end, 10);
    if (*end || end == value || level < 0 || level > 1000) return unusable("--level %s: must be a whole number from 0", value);
    a->measure.level = (int)level;
    return 0;
}

static int read_seconds(struct fv_arguments *a, const char *value)
{
    char *end;
    a->measure.seconds = strtod(value, &end);
    if (*end || end == value || !(a->measure.seconds > 0 && a->measure.seconds <= 1e6))
        return unusable("--seconds %s: must be a number over 0, up to 1000000", value);
    return 0;
}

static int read_shard(struct fv_arguments *a, const char *value)
{
    char *end, *last;
    long shard = strtol(value, &end, 10), shards = *end == '/' ? strtol(end + 1, &last, 10) : 0;
    if (*end != '/' || end == value || *last || last == end + 1 || shard < 1 || shard > shards || shards > 100000)
        return unusable("--shard %s: must be I/N, the I-th of N shares, I from 1 to N", value);
    a->measure.shard = (int)shard - 1;
    a->measure.shards = (int)shards;
    return 0;
}

static int read_merge(struct fv_arguments *a, const char *value)
{
    a->measure.merge = true;
    if (a->operands == FV_OPERANDS_MAX) return unusable("--merge %s: too many folders", value);
    a->operand[a->operands++] = value;
    return 0;
}

/* Returns 0, or -1 with the reason logged. */
static const struct option {
    const char *name;
    int (*read)(struct fv_arguments *arguments, const char *value);
} options[] = {
    {"--config", read_config}, {"--set", read_set}, {"--out", read_out}, {"--frames", read_frames},
    {"--ppd", read_ppd},       {"--gaze", read_gaze}, {"--fov", read_fov},
    return 0;
}

    {"--method", read_method}, {"--level", read_level}, {"--seconds", read_seconds}, {"--shard", read_shard},
    {"--merge", read_merge},
};

/* The option that `text` begins with, as far as the verb takes it; NULL otherwise. */
static const struct option *find_option(int verb, const char *text, size_t length)
{
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        const char *name = options[i].name, *listed = strstr(fv_verbs[verb].options, name);
        if (strlen(name) == length && strncmp(name, text, length) == 0)
            return listed && listed[length] == ' ' ? &options[i] : NULL;
    }
    return NULL;
}

/* Options may be written "--name value" or "--name=value". */
static int read_arguments(int verb, int count, char **text, struct fv_arguments *a)
{
    for (int i = 0; i < count; i++) {
        const char *value = strchr(text[i], '=');
        if (strncmp(text[i], "--", 2) != 0) {
            if (a->operands == fv_verbs[verb].operands)
                return unusable("'%s': not expected here; see 'foveola help'", text[i]);
            a->operand[a->operands++] = text[i];
            continue;
        }
        size_t length = value ? (size_t)(value - text[i]) : strlen(text[i]);
        const struct option *o = find_option(verb, text[i], length);
        if (!o) return unusable("%s: this verb has no such option; see 'foveola help'", text[i]);
        if (value) value++;
        else if (++i < count) value = text[i];
        else return unusable("%s: a value must follow", o->name);
        if (o->read(a, value)) return -1;
    }
    return 0;
}

static int run_verb(int count, char **text)
{
    struct fv_arguments arguments = {.out = "out", .frames = -1, .ppd = 67};
    struct fv_arguments arguments = {.out = "out", .frames = -1, .measure = {.level = -1, .seconds = FV_SWEEP_SECONDS, .shards = 1}};
    const char *verb = count > 1 ? text[1] : "help";
    if (strcmp(verb, "--help") == 0 || strcmp(verb, "-h") == 0) verb = "help";
    if (strcmp(verb, "--version") == 0) verb = "version";
    for (int i = 0; i < fv_verbs_count; i++) {
        if (strcmp(verb, fv_verbs[i].name) != 0) continue;
        if (count > 2 && read_arguments(i, count - 2, text + 2, &arguments)) return FV_EXIT_UNUSABLE;
        return fv_verbs[i].run(&arguments);
    }
    fv_log("'%s' is no verb; 'foveola help' lists them", verb);
    return FV_EXIT_UNUSABLE;
}

/* Ends without destructors: what libraries took is never given back, and the heap is sealed. */
int main(int count, char **text)
{
    _exit(run_verb(count, text));
}
