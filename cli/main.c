/* main: the command line, by two tables: verbs and options. */
#include "cli/cli.h"

#include "platform/log.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const struct fv_verb fv_verbs[] = {
    {"run", fv_verb_run, "--config --set --out --frames ", false, "run [--frames N]",
     "the frame loop; until N frames, SIGINT or SIGTERM; report in --out (default: out)"},
    {"replay", fv_verb_replay, "--config --set --out --frames ", true, "replay DIR",
     "runs a recorded session again; the same bytes of every picture"},
    {"plan", fv_verb_plan, "--config --set --frames ", false, "plan",
     "what this scene and method need, what is left out and why; no frame is run"},
    {"help", fv_verb_help, "", true, "help [VERB|SECTION|KEY]", "this; the settings of a section; one setting"},
    {"version", fv_verb_version, "", false, "version", "the version"},
};
const int fv_verbs_count = sizeof fv_verbs / sizeof fv_verbs[0];

static int unusable(const char *format, const char *what)
{
    fv_log(format, what);
    return -1;
}

static int read_option(struct fv_arguments *a, const char *name, const char *value)
{
    struct fv_config_request *r = &a->request;
    if (strcmp(name, "--config") == 0) {
        if (r->files == 16) return unusable("%s: at most 16 settings files", name);
        r->file[r->files++] = value;
    } else if (strcmp(name, "--set") == 0) {
        if (r->sets == 64) return unusable("%s: at most 64 of them; put the rest into a settings file", name);
        r->set[r->sets++] = value;
    } else if (strcmp(name, "--out") == 0) {
        a->out = value;
    } else {
        char *end;
        errno = 0;
        a->frames = strtoll(value, &end, 10);
        if (errno || *end || end == value || a->frames < 1 || a->frames > 100000000)
            return unusable("--frames %s: must be a whole number from 1 to 100000000", value);
    }
    return 0;
}

static bool takes(const char *options, const char *name)
{
    const char *at = strstr(options, name);
    return at && at[strlen(name)] == ' ';
}

/* Options may be written "--name value" or "--name=value". */
static int read_arguments(int verb, int count, char **text, struct fv_arguments *a)
{
    for (int i = 0; i < count; i++) {
        char name[16] = "";
        const char *value = strchr(text[i], '=');
        if (strncmp(text[i], "--", 2) != 0) {
            if (!fv_verbs[verb].operand || a->operand) return unusable("'%s': not expected here; see 'foveola help'", text[i]);
            a->operand = text[i];
            continue;
        }
        size_t length = value ? (size_t)(value - text[i]) : strlen(text[i]);
        if (length < sizeof name) memcpy(name, text[i], length);
        if (!name[0] || !takes(fv_verbs[verb].options, name))
            return unusable("%s: this verb has no such option; see 'foveola help'", text[i]);
        if (value) value++;
        else if (++i < count) value = text[i];
        else return unusable("%s: a value must follow", name);
        if (read_option(a, name, value)) return -1;
    }
    return 0;
}

static int run_verb(int count, char **text)
{
    struct fv_arguments arguments = {.out = "out", .frames = -1};
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
