/* config: from keys.def, presets, files and --set to struct fv_config. inih splits the lines;
 * what a line means is decided here, by the table. */
#include "config/config.h"

#include "config/check.h"
#include "platform/files.h"

#include <errno.h>
#include <ini.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct fv_key fv_keys[] = {
#define OFFSET(section, name) (unsigned)offsetof(struct fv_config, section##_##name)
#define FV_INT(section, name, unit, min, max, initial, help) \
    {#section, #name, FV_KEY_INT, unit, min, max, 0, #initial, help, OFFSET(section, name)},
#define FV_REAL(section, name, unit, min, max, initial, help) \
    {#section, #name, FV_KEY_REAL, unit, min, max, 0, #initial, help, OFFSET(section, name)},
#define FV_WORD(section, name, words, initial, help) \
    {#section, #name, FV_KEY_WORD, words, 0, 0, 0, initial, help, OFFSET(section, name)},
#define FV_TEXT(section, name, initial, help) \
    {#section, #name, FV_KEY_TEXT, "", 0, 0, 0, initial, help, OFFSET(section, name)},
#define FV_LIST(section, name, unit, columns, initial, help) \
    {#section, #name, FV_KEY_LIST, unit, 0, 0, columns, initial, help, OFFSET(section, name)},
#define FV_ROWS(section, name, unit, initial, help) \
    {#section, #name, FV_KEY_ROWS, unit, 0, 0, 0, initial, help, OFFSET(section, name)},
#include "config/keys.def"
};
enum { KEYS = sizeof fv_keys / sizeof fv_keys[0], TEXT_LONGEST = 160 };
const int fv_keys_count = KEYS;

static char origins[KEYS][160];

/* One file (or preset, or the command line) being read. */
struct reading {
    struct fv_config *config;
    struct fv_error *error;
    const char *source, *text; /* text: what is left of it */
    int line;
    bool failed;
    const struct fv_key *open_list; /* its last row is not complete yet */
    bool seen[KEYS]; /* lists: a second line of the same key appends */
};

const struct fv_key *fv_key_find(const char *dotted)
{
    const struct fv_key *found = NULL;
    const char *dot = strchr(dotted, '.');
    for (int i = 0; i < KEYS; i++) {
        const struct fv_key *k = &fv_keys[i];
        if (dot) {
            if (strlen(k->section) == (size_t)(dot - dotted) &&
                strncmp(dotted, k->section, (size_t)(dot - dotted)) == 0 && strcmp(dot + 1, k->name) == 0)
                return k;
        } else if (strcmp(dotted, k->name) == 0) {
            if (found) return NULL;
            found = k;
        }
    }
    return found;
}

static int fail(struct reading *r, const char *format, ...) __attribute__((format(printf, 2, 3)));
static int fail(struct reading *r, const char *format, ...)
{
    char text[400], place[FV_PATH_MAX];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (r->line) snprintf(place, sizeof place, "%s:%d", r->source, r->line);
    else snprintf(place, sizeof place, "%s", r->source);
    if (!r->failed) fv_error_set(r->error, "%s: %s", place, text);
    r->failed = true;
    return -1;
}

static bool has_word(const char *words, const char *word)
{
    size_t n = strchr(word, '|') ? 0 : strlen(word);
    for (const char *w = words; n && w; w = strchr(w, '|') ? strchr(w, '|') + 1 : NULL)
        if (strncmp(w, word, n) == 0 && (w[n] == '|' || w[n] == 0)) return true;
    return false;
}

/* A number followed by nothing but, perhaps, the key's unit. */
static int parse_number(struct reading *r, const struct fv_key *k, const char *text, double *out)
{
    char *end;
    errno = 0;
    *out = strtod(text, &end);
    if (end == text) return fail(r, "%s.%s = '%s': not a number", k->section, k->name, text);
    end += strspn(end, " \t");
    if (*end && strcmp(end, k->unit) != 0)
        return fail(r, "%s.%s = '%s': unit '%s' is not understood, %s%s", k->section, k->name, text, end,
                    k->unit[0] ? "values are in " : "it is a bare number", k->unit);
    if (!(*out >= k->min && *out <= k->max))
        return fail(r, "%s.%s = %s is out of range: from %.10g to %.10g%s%s", k->section, k->name, text,
                    k->min, k->max, k->unit[0] ? " " : "", k->unit);
    if (k->kind == FV_KEY_INT && *out != floor(*out))
        return fail(r, "%s.%s = %s: must be a whole number", k->section, k->name, text);
    return 0;
}

static int parse_list(struct reading *r, const struct fv_key *k, const char *text, struct fv_list *list)
{
    while (text[strspn(text, " \t,")]) {
        int in_row = 0;
        text += strspn(text, " \t,");
        for (; *text && *text != ','; text += strspn(text, " \t")) {
            char *end;
            if (list->count == FV_LIST_MAX)
                return fail(r, "%s.%s: more than %d numbers", k->section, k->name, FV_LIST_MAX);
            double value = strtod(text, &end);
            if (end == text || !isfinite(value) || (*end && !strchr(" \t,", *end)))
                return fail(r, "%s.%s: '%.20s' is not a finite number", k->section, k->name, text);
            if (fabs(value) > FV_LIST_LARGEST)
                return fail(r, "%s.%s: %.10g is out of range: from %.10g to %.10g", k->section, k->name, value,
                            -FV_LIST_LARGEST, FV_LIST_LARGEST);
            list->value[list->count++] = value;
            in_row++;
            text = end;
        }
        /* A row may go on on the next line, but not past a comma. */
        r->open_list = list->count % k->columns ? k : NULL;
        if (*text == ',' ? r->open_list != NULL : in_row > k->columns) {
            r->open_list = NULL;
            return fail(r, "%s.%s: a row of %d numbers, needs %d (%s)", k->section, k->name, in_row,
                        k->columns, k->unit);
        }
    }
    return 0;
}

/* A further line goes on after a blank. */
static int append_rows(struct reading *r, const struct fv_key *k, const char *text, char *rows, bool further)
{
    size_t used = further ? strlen(rows) : 0, length = strlen(text);
    if (strstr(text, " ;") || strchr(text, '\n'))
        return fail(r, "%s.%s: ' ;' or a line's end in it", k->section, k->name);
    if (used + length + 2 > FV_ROWS_LONGEST)
        return fail(r, "%s.%s: longer than %d characters", k->section, k->name, FV_ROWS_LONGEST - 2);
    snprintf(rows + used, FV_ROWS_LONGEST - used, "%s%s", used > 0 ? " " : "", text);
    return 0;
}

static int assign(struct reading *r, const struct fv_key *k, const char *text)
{
    void *at = (char *)r->config + k->offset;
    int index = (int)(k - fv_keys);
    double number;
    bool goes_on = k->kind == FV_KEY_LIST || k->kind == FV_KEY_ROWS;
    if (r->seen[index] && !goes_on)
        return fail(r, "%s.%s is set twice; only lists go on over indented lines", k->section, k->name);
    switch (k->kind) {
    case FV_KEY_INT:
        if (parse_number(r, k, text, &number)) return -1;
        *(int64_t *)at = (int64_t)number;
        break;
    case FV_KEY_REAL:
        if (parse_number(r, k, text, &number)) return -1;
        *(double *)at = number;
        break;
    case FV_KEY_WORD:
        if (!has_word(k->unit, text))
            return fail(r, "%s.%s = '%s': must be one of %s", k->section, k->name, text, k->unit);
        snprintf(at, FV_TEXT_MAX, "%s", text);
        break;
    case FV_KEY_TEXT:
        /* What a settings file can hold, so that a recorded run's settings read back. */
        if (strlen(text) > TEXT_LONGEST || strstr(text, " ;") || strchr(text, '\n'))
            return fail(r, "%s.%s: longer than %d characters, or ' ;' or a line's end in it", k->section, k->name, TEXT_LONGEST);
        snprintf(at, FV_TEXT_MAX, "%s", text);
        break;
    case FV_KEY_LIST:
        if (!r->seen[index]) ((struct fv_list *)at)->count = 0;
        if (parse_list(r, k, text, at)) return -1;
        break;
    case FV_KEY_ROWS:
        if (append_rows(r, k, text, at, r->seen[index])) return -1;
        break;
    }
    r->seen[index] = true;
    if (r->line) snprintf(origins[index], sizeof origins[index], "%.140s:%d", r->source, r->line);
    else snprintf(origins[index], sizeof origins[index], "%.150s", r->source);
    return 0;
}

/* inih's reader: one line a call; counts them. */
static char *next_line(char *out, int size, void *context)
{
    struct reading *r = context;
    if (!*r->text) return NULL;
    size_t n = strcspn(r->text, "\n");
    r->line++;
    if (n + 2 > (size_t)size) {
        fail(r, "line of %zu characters, at most %d are read; a list may go on on indented lines", n, size - 2);
        return NULL;
    }
    memcpy(out, r->text, n);
    r->text += n;
    if (*r->text == '\n') out[n++] = *r->text++;
    out[n] = 0;
    return out;
}

static bool is_section(const char *name)
{
    for (int i = 0; i < KEYS; i++)
        if (strcmp(name, fv_keys[i].section) == 0) return true;
    return false;
}

/* A list whose last row is short, once no further line can belong to it. */
static int close_list(struct reading *r)
{
    const struct fv_key *k = r->open_list;
    if (!k || r->failed) return r->failed ? -1 : 0;
    int count = ((const struct fv_list *)((const char *)r->config + k->offset))->count;
    r->open_list = NULL;
    return fail(r, "%s.%s: a row of %d numbers, needs %d (%s)", k->section, k->name, count % k->columns, k->columns, k->unit);
}

static int on_pair(void *context, const char *section, const char *name, const char *value)
{
    struct reading *r = context;
    char dotted[256];
    if (r->failed) return 0;
    snprintf(dotted, sizeof dotted, "%s.%s", section, name);
    const struct fv_key *k = fv_key_find(dotted);
    if (r->open_list && r->open_list != k && close_list(r)) return 0;
    if (k) return assign(r, k, value) == 0;
    if (!section[0]) fail(r, "'%s' stands before any [section]", name);
    else if (!is_section(section)) fail(r, "unknown section [%s]; 'foveola help' lists them", section);
    else fail(r, "unknown key '%s'; 'foveola help %s' lists the keys of [%s]", dotted, section, section);
    return 0;
}

static int read_text(struct fv_config *config, const char *source, const char *text, struct fv_error *error)
{
    struct reading r = {.config = config, .error = error, .source = source, .text = text};
    int bad_line = ini_parse_stream(next_line, &r, on_pair, &r);
    if (!r.failed && bad_line) {
        r.line = bad_line;
        fail(&r, "neither [section] nor key = value");
    }
    close_list(&r);
    return r.failed ? -1 : 0;
}

static int read_file(struct fv_config *config, const char *path, struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, 1 << 20, &text, &size, error)) return -1;
    int result = strlen(text) != size ? fv_error_set(error, "%s: not a text file", path)
                                      : read_text(config, path, text, error);
    free(text);
    return result;
}

static int read_set(struct fv_config *config, const char *assignment, struct fv_error *error)
{
    struct reading r = {.config = config, .error = error, .source = "--set"};
    char name[128];
    const char *equals = strchr(assignment, '=');
    if (!equals || (size_t)(equals - assignment) >= sizeof name)
        return fail(&r, "'%s': must be section.key=value", assignment);
    snprintf(name, sizeof name, "%.*s", (int)(equals - assignment), assignment);
    const struct fv_key *k = strchr(name, '.') ? fv_key_find(name) : NULL;
    if (!k) return fail(&r, "unknown key '%s'; 'foveola help' lists them", name);
    return assign(&r, k, equals + 1) || close_list(&r) ? -1 : 0;
}

static void set_defaults(struct fv_config *config)
{
    struct fv_error error;
    struct reading r = {.config = config, .error = &error, .source = "default"};
    memset(config, 0, sizeof *config);
    for (int i = 0; i < KEYS; i++)
        if (assign(&r, &fv_keys[i], fv_keys[i].initial)) abort(); /* the table contradicts itself */
}

static int read_requested(struct fv_config *config, const struct fv_config_request *request,
                          struct fv_error *error)
{
    for (int i = 0; i < request->files; i++)
        if (read_file(config, request->file[i], error)) return -1;
    for (int i = 0; i < request->sets; i++)
        if (read_set(config, request->set[i], error)) return -1;
    return 0;
}

static int read_preset(struct fv_config *config, const char *kind, const char *dotted, const char *name,
                       struct fv_error *error)
{
    char source[FV_TEXT_MAX + 64], known[256] = "";
    const char *text = fv_preset_text(kind, name);
    if (!text) {
        for (int n = 0; fv_preset_name(kind, n); n++) {
            size_t used = strlen(known);
            snprintf(known + used, sizeof known - used, " %s", fv_preset_name(kind, n));
        }
        return fv_config_error(error, dotted, "'%.60s' is not known; there are:%s", name, known);
    }
    snprintf(source, sizeof source, "config/%s/%s.ini", kind, name);
    return read_text(config, source, text, error);
}

int fv_config_load(struct fv_config *config, const struct fv_config_request *request, struct fv_error *error)
{
    /* Once to learn which presets are asked for, then again with the presets below the rest. */
    static char headset[FV_TEXT_MAX], scene[FV_TEXT_MAX];
    set_defaults(config);
    if (read_requested(config, request, error)) return -1;
    memcpy(headset, config->display_headset, sizeof headset);
    memcpy(scene, config->scene_name, sizeof scene);
    bool named = config->scene_file[0] || config->scene_fields[0];
    bool own_scene = named && strcmp(fv_config_origin("scene.name"), "default") == 0;
    if (!fv_preset_text("headsets", headset))
        return read_preset(config, "headsets", "display.headset", headset, error);
    if (!own_scene && !fv_preset_text("scenes", scene) && !named)
        return read_preset(config, "scenes", "scene.name", scene, error);
    set_defaults(config);
    if (read_preset(config, "headsets", "display.headset", headset, error)) return -1;
    if (!own_scene && fv_preset_text("scenes", scene) &&
        read_preset(config, "scenes", "scene.name", scene, error))
        return -1;
    if (read_requested(config, request, error)) return -1;
    return fv_config_check(config, error);
}

const char *fv_config_origin(const char *dotted)
{
    const struct fv_key *k = fv_key_find(dotted);
    return k ? origins[k - fv_keys] : "";
}

int fv_config_error(struct fv_error *error, const char *dotted, const char *format, ...)
{
    char text[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return fv_error_set(error, "%s: %s: %s", fv_config_origin(dotted), dotted, text);
}

/* The shortest decimal that reads back as the same double. */
static int print_real(char *out, size_t size, double value)
{
    for (int digits = 6; digits < 17; digits++) {
        int n = snprintf(out, size, "%.*g", digits, value);
        if (strtod(out, NULL) == value) return n;
    }
    return snprintf(out, size, "%.17g", value);
}

const char *fv_config_text(const struct fv_config *config, const struct fv_key *key, char *out, unsigned size)
{
    const void *at = (const char *)config + key->offset;
    switch (key->kind) {
    case FV_KEY_INT: snprintf(out, size, "%lld", (long long)*(const int64_t *)at); break;
    case FV_KEY_REAL: print_real(out, size, *(const double *)at); break;
    case FV_KEY_WORD:
    case FV_KEY_TEXT:
    case FV_KEY_ROWS: snprintf(out, size, "%s", (const char *)at); break;
    case FV_KEY_LIST: {
        const struct fv_list *list = at;
        unsigned used = 0;
        out[0] = 0;
        for (int i = 0; i < list->count && used + 32 < size; i++) {
            used += (unsigned)snprintf(out + used, size - used, "%s", i == 0 ? "" : i % key->columns ? " " : ", ");
            used += (unsigned)print_real(out + used, size - used, list->value[i]);
        }
        break;
    }
    }
    return out;
}
