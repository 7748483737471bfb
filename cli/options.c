/* options: the command line's options, a row each. A verb lists those that it takes. */
#include "cli/cli.h"

#include "platform/log.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

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

static int read_points(struct fv_arguments *a, const char *value)
{
    for (a->points = 5; a->points <= 13; a->points += 4)
        if (atoi(value) == a->points && strlen(value) == (a->points < 10 ? 1 : 2)) return 0;
    return unusable("--points %s: must be 5, 9 or 13", value);
}

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
    if (*end || end == value || level < 0 || level > 1000)
        return unusable("--level %s: must be a whole number from 0", value);
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
    if (*end != '/' || end == value || *last || last == end + 1 || shard < 1 || shard > shards ||
        shards > 100000)
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

static int read_table(struct fv_arguments *a, const char *value)
{
    a->measure.table = value;
    return 0;
}

static int read_part(struct fv_arguments *a, const char *value)
{
    a->measure.part = value;
    return 0;
}

static int read_root(struct fv_arguments *a, const char *value)
{
    a->root = value;
    return 0;
}

static int read_json(struct fv_arguments *a, const char *value)
{
    (void)value;
    a->json = true;
    return 0;
}

/* read returns 0, or -1 with the reason logged. */
static const struct option {
    const char *name;
    int (*read)(struct fv_arguments *arguments, const char *value);
    bool valued; /* a value belongs to it */
} options[] = {
    {"--config", read_config, true}, {"--set", read_set, true}, {"--out", read_out, true},
    {"--frames", read_frames, true}, {"--ppd", read_ppd, true}, {"--gaze", read_gaze, true},
    {"--fov", read_fov, true}, {"--method", read_method, true}, {"--level", read_level, true},
    {"--seconds", read_seconds, true}, {"--shard", read_shard, true}, {"--merge", read_merge, true},
    {"--table", read_table, true}, {"--part", read_part, true}, {"--root", read_root, true},
    {"--points", read_points, true}, {"--json", read_json, false},
};

/* The option that `text` begins with, as far as the verb takes it; NULL otherwise. */
static const struct option *find_option(const struct fv_verb *verb, const char *text, size_t length)
{
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        const char *name = options[i].name, *listed = strstr(verb->options, name);
        if (strlen(name) == length && strncmp(name, text, length) == 0)
            return listed && listed[length] == ' ' ? &options[i] : NULL;
    }
    return NULL;
}

int fv_options_read(struct fv_arguments *a, const struct fv_verb *verb, int count, char **text)
{
    for (int i = 0; i < count; i++) {
        const char *value = strchr(text[i], '=');
        if (strncmp(text[i], "--", 2) != 0) {
            if (a->operands == verb->operands)
                return unusable("'%s': not expected here; see 'foveola help'", text[i]);
            a->operand[a->operands++] = text[i];
            continue;
        }
        const struct option *o =
            find_option(verb, text[i], value ? (size_t)(value - text[i]) : strlen(text[i]));
        if (!o) return unusable("%s: this verb has no such option; see 'foveola help'", text[i]);
        if (value && !o->valued) return unusable("%s takes no value", o->name);
        if (value) value++;
        else if (!o->valued) value = "";
        else if (++i < count) value = text[i];
        else return unusable("%s: a value must follow", o->name);
        if (o->read(a, value)) return -1;
    }
    return 0;
}
