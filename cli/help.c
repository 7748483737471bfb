/* help: the verbs, and the settings from the same table that parses them. */
#include "cli/cli.h"
#include "cli/man.h"

#include "platform/log.h"
#include "rt/method/method.h"

#include <string.h>

static void print_key(struct fv_writer *out, const struct fv_key *k)
{
    fv_writer_print(out, "  %s.%s = %s", k->section, k->name, k->initial[0] ? k->initial : "(empty)");
    if (k->kind == FV_KEY_WORD) fv_writer_print(out, "  [%s]", k->unit);
    else if (k->kind == FV_KEY_LIST || k->kind == FV_KEY_ROWS) fv_writer_print(out, "  rows of: %s", k->unit);
    else if (k->kind != FV_KEY_TEXT) fv_writer_print(out, "  [%.10g to %.10g%s%s]", k->min, k->max, k->unit[0] ? " " : "", k->unit);
    fv_writer_print(out, "\n      %s\n", k->help);
}

static void print_verb(struct fv_writer *out, const struct fv_verb *v)
{
    bool is_long = strlen(v->usage) > 25;
    fv_writer_print(out, "  %-25s%s%s\n", v->usage, is_long ? "\n                            " : " ", v->what);
}

static void print_overview(struct fv_writer *out)
{
    fv_writer_print(out, "usage: foveola VERB [--config FILE.ini]... [--set section.key=value]... [--out DIR]\n\n");
    for (int i = 0; i < fv_verbs_count; i++) print_verb(out, &fv_verbs[i]);
    fv_writer_print(out, "\nmethods:\n");
    for (int n = 0; fv_method_at(n); n++)
        fv_writer_print(out, "  %-10s %s\n", fv_method_at(n)->name, fv_method_at(n)->what);
    static const char *const kinds[][2] = {{"headsets", "display.headset"}, {"scenes", "scene.name"}, {"boards", "--config config/boards/"}};
    for (int i = 0; i < 3; i++) {
        fv_writer_print(out, "%s (%s):", kinds[i][0], kinds[i][1]);
        for (int n = 0; fv_preset_name(kinds[i][0], n); n++) fv_writer_print(out, " %s", fv_preset_name(kinds[i][0], n));
        fv_writer_print(out, "\n");
    }
    fv_writer_print(out, "settings by section:");
    for (int i = 0; i < fv_keys_count; i++)
        if (i == 0 || strcmp(fv_keys[i].section, fv_keys[i - 1].section) != 0) fv_writer_print(out, " %s", fv_keys[i].section);
    fv_writer_print(out, "\nexit: 0 done; 1 ran, but not all held; 2 unusable input, nothing was run; 3 a device failed\n");
}

int fv_verb_help(const struct fv_arguments *arguments)
{
    static struct fv_writer out;
    struct fv_error error;
    const char *topic = arguments->operand[0];
    if (fv_writer_open(&out, "-", &error)) return FV_EXIT_NOT_HELD;
    if (!topic) print_overview(&out);
    if (topic && strcmp(topic, "man") == 0) fv_man_print(&out);
    for (int i = 0; topic && i < fv_verbs_count; i++)
        if (strcmp(fv_verbs[i].name, topic) == 0) print_verb(&out, &fv_verbs[i]);
    for (int i = 0; topic && i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        if (strcmp(k->section, topic) == 0 || strcmp(k->name, topic) == 0 || fv_key_find(topic) == k)
            print_key(&out, k);
    }
    if (topic && out.used == 0) {
        fv_log("help: '%s' is no verb, section or key; 'foveola help' lists them", topic);
        return FV_EXIT_UNUSABLE;
    }
    return fv_writer_close(&out, &error) ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}

int fv_verb_version(const struct fv_arguments *arguments)
{
    static struct fv_writer out;
    struct fv_error error;
    (void)arguments;
    if (fv_writer_open(&out, "-", &error)) return FV_EXIT_NOT_HELD;
    fv_writer_print(&out, "foveola %s\n", FV_VERSION);
    return fv_writer_close(&out, &error) ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}
