/* man: the manual page, foveola(1), from the tables that parse the command line and the settings: `foveola help man`. */
#include "cli/cli.h"
#include "cli/man.h"

#include "rt/method/method.h"

#include <stdio.h>
#include <string.h>

/* Text as roff takes it: no line begins with a request, and what roff reads otherwise is escaped. */
static void put(struct fv_writer *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '\\') fv_writer_print(out, "\\e");
        else if (*text == '-') fv_writer_print(out, "\\-");
        else if (*text == '\'') fv_writer_print(out, "\\(aq");
        else fv_writer_bytes(out, text, 1);
    }
}

static void entry(struct fv_writer *out, const char *name, const char *more, const char *what)
{
    fv_writer_print(out, ".TP\n.B ");
    put(out, name);
    put(out, more);
    fv_writer_print(out, "\n");
    put(out, what);
    fv_writer_print(out, "\n");
}

static void print_keys(struct fv_writer *out)
{
    char name[96], more[256];
    for (int i = 0; i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        if (i == 0 || strcmp(k->section, fv_keys[i - 1].section) != 0) fv_writer_print(out, ".SS %s\n", k->section);
        snprintf(name, sizeof name, "%s.%s", k->section, k->name);
        if (k->kind == FV_KEY_INT || k->kind == FV_KEY_REAL)
            snprintf(more, sizeof more, " = %s  (%.10g to %.10g%s%s)", k->initial, k->min, k->max, k->unit[0] ? " " : "", k->unit);
        else if (k->kind == FV_KEY_WORD) snprintf(more, sizeof more, " = %s  (%.200s)", k->initial, k->unit);
        else snprintf(more, sizeof more, " = %.200s", k->initial);
        entry(out, name, more, k->help);
    }
}

static const struct {
    const char *name, *what;
} files[] = {{"/etc/foveola/foveola.ini", "settings of the service"},
             {"/usr/share/foveola/config", "settings files of boards, headsets, scenes and methods, each usable by --config"},
             {"/var/lib/foveola/session", "what the service's newest session left"}},
  exits[] = {{"0", "done"},
             {"1", "ran, but not all that was asked for held; check: not ready"},
             {"2", "unusable input, nothing was run"},
             {"3", "a device failed for good, the watchdog or the sandbox ended the program"}};

void fv_man_print(struct fv_writer *out)
{
    fv_writer_print(out, ".TH FOVEOLA 1 \"\" \"foveola %s\" \"User Commands\"\n.SH NAME\nfoveola \\- renderer of a standalone VR headset\n", FV_VERSION);
    fv_writer_print(out, ".SH SYNOPSIS\n.B foveola\n.I VERB\n[\\-\\-config FILE.ini]... [\\-\\-set section.key=value]... [\\-\\-out DIR]\n");
    fv_writer_print(out, ".SH DESCRIPTION\nRay traces both eyes\\(aq pictures, sharpest where the eye looks, and has each frame ready before "
                         "the display needs it. A settings file is INI; later ones win over earlier, \\-\\-set over files.\n.SH VERBS\n");
    for (int i = 0; i < fv_verbs_count; i++) entry(out, fv_verbs[i].usage, "", fv_verbs[i].what);
    fv_writer_print(out, ".SH METHODS\n");
    for (int n = 0; fv_method_at(n); n++) entry(out, fv_method_at(n)->name, "", fv_method_at(n)->what);
    fv_writer_print(out, ".SH SETTINGS\n");
    print_keys(out);
    fv_writer_print(out, ".SH FILES\n");
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) entry(out, files[i].name, "", files[i].what);
    fv_writer_print(out, ".SH EXIT STATUS\n");
    for (size_t i = 0; i < sizeof exits / sizeof exits[0]; i++) entry(out, exits[i].name, "", exits[i].what);
}
