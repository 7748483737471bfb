/* config: all settings as one struct, made from the table keys.def.
 *
 * Order, later wins: defaults, headset preset, scene preset, --config files in order, --set.
 * Each value remembers where it came from, so that later checks can name file and line. */
#ifndef FV_CONFIG_CONFIG_H
#define FV_CONFIG_CONFIG_H

#include "platform/error.h"

#include <stdint.h>

enum { FV_TEXT_MAX = 512, FV_LIST_MAX = 1024, FV_ROWS_LONGEST = 8192 };

/* Numbers of lists are at most this far from 0, so that every pose on a path is sound (platform/pose.h),
 * where the curve overshoots its way points too. */
#define FV_LIST_LARGEST 5e8

struct fv_list {
    int count; /* numbers, a multiple of the key's columns */
    double value[FV_LIST_MAX];
};

struct fv_config {
#define FV_INT(section, name, unit, min, max, initial, help) int64_t section##_##name;
#define FV_REAL(section, name, unit, min, max, initial, help) double section##_##name;
#define FV_WORD(section, name, words, initial, help) char section##_##name[FV_TEXT_MAX];
#define FV_TEXT(section, name, initial, help) char section##_##name[FV_TEXT_MAX];
#define FV_LIST(section, name, unit, columns, initial, help) struct fv_list section##_##name;
#define FV_ROWS(section, name, unit, initial, help) char section##_##name[FV_ROWS_LONGEST];
#include "config/keys.def"
#undef FV_INT
#undef FV_REAL
#undef FV_WORD
#undef FV_TEXT
#undef FV_LIST
#undef FV_ROWS
};

enum fv_key_kind { FV_KEY_INT, FV_KEY_REAL, FV_KEY_WORD, FV_KEY_TEXT, FV_KEY_LIST, FV_KEY_ROWS };

struct fv_key {
    const char *section, *name; /* "fovea", "p_min" */
    enum fv_key_kind kind;
    const char *unit;  /* unit, or the words a WORD may take, or the columns of LIST and ROWS */
    double min, max;   /* INT, REAL */
    int columns;       /* LIST */
    const char *initial;
    const char *help;
    unsigned offset;   /* in struct fv_config */
};

extern const struct fv_key fv_keys[];
extern const int fv_keys_count;

/* "section.name" or just a unique "name"; NULL where there is none. */
const struct fv_key *fv_key_find(const char *dotted);

/* What the command line gave: --config files and --set assignments, in order. */
struct fv_config_request {
    int files, sets;
    const char *file[16], *set[64];
};

/* Fills `config`; on a bad file, key or value returns -1 with "file:line: what, what would be
 * right". */
int fv_config_load(struct fv_config *config, const struct fv_config_request *request,
                   struct fv_error *error);

/* Where the value of a key came from: "file:line", "--set" or "default". */
const char *fv_config_origin(const char *dotted);

/* Sets the error to "origin: section.name: message"; returns -1. For checks that only a user of
 * the value can make. */
int fv_config_error(struct fv_error *error, const char *dotted, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The value of a key as text that parses back to the same value. Returns `out`. */
const char *fv_config_text(const struct fv_config *config, const struct fv_key *key, char *out,
                           unsigned size);

/* The text of a preset compiled into the program (config/KIND/NAME.ini), NULL where there is none;
 * and the n-th name of a kind ("headsets", "boards", "scenes"), NULL past the last. */
const char *fv_preset_text(const char *kind, const char *name);
const char *fv_preset_name(const char *kind, int n);

#endif
