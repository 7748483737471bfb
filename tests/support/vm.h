/* vm: boots the guest (vm.sh) that a test judges, and finds in what its script printed. For tests of tests/vm. */
#ifndef FV_TESTS_VM_H
#define FV_TESTS_VM_H

#include "tests/support/program.h"

static char vm_output[1 << 18];

/* The part of the output under a headline "== NAME". */
static inline const char *vm_part(const char *name)
{
    static char text[1 << 16];
    char headline[64];
    snprintf(headline, sizeof headline, "== %s\n", name);
    const char *from = strstr(vm_output, headline), *to = from ? strstr(from + 3, "\n== ") : NULL;
    if (!from) fail_msg("the guest never said %s", headline);
    from += strlen(headline);
    size_t length = to ? (size_t)(to + 1 - from) : strlen(from);
    assert_true(length < sizeof text);
    memcpy(text, from, length);
    text[length] = 0;
    return text;
}

/* Of a line "NAME VALUE". */
static inline double vm_value(const char *text, const char *name)
{
    char line[64];
    snprintf(line, sizeof line, "\n%s ", name);
    const char *at = strncmp(text, line + 1, strlen(line + 1)) == 0 ? text - 1 : strstr(text, line);
    if (!at) fail_msg("no %s in: %s", name, text);
    return atof(at + strlen(line));
}

/* Of a report: "KEY":number, after the first `"object":`. */
static inline double vm_number(const char *text, const char *object, const char *key)
{
    char name[64];
    snprintf(name, sizeof name, "\"%s\":", object);
    const char *at = strstr(text, name);
    if (!at) fail_msg("no %s in: %s", name, text);
    snprintf(name, sizeof name, "\"%s\":", key);
    const char *value = strstr(at, name);
    if (!value) fail_msg("no %s in: %s", name, at);
    return atof(value + strlen(name));
}

/* Of a report, too: "gaze.cameras.lost". */
static inline double vm_at(const char *text, const char *path)
{
    char name[64];
    const char *at = text;
    while (*path) {
        size_t length = strcspn(path, ".");
        snprintf(name, sizeof name, "\"%.*s\":", (int)length, path);
        const char *found = strstr(at, name), *end = strchr(at == text ? text + strlen(text) : at, '\n');
        if (!found || (end && found > end)) fail_msg("no %s in: %s", path, text);
        at = found + strlen(name);
        path += length + (path[length] == '.');
    }
    return atof(at);
}

/* Runs the script with the programs that FV_VM_PROGRAMS names; a setup of cmocka. Ends the test as skipped where the
 * guest cannot be run here. */
static inline int vm_boot(const char *script)
{
    char command[4096], path[256];
    snprintf(path, sizeof path, "%s/vm.txt", program_folder());
    snprintf(command, sizeof command, "FV_VM_SHARE=%s sh %s/tests/vm/vm.sh '%s' %s/tests/vm/%s %s >%s 2>&1", program_folder(), FV_SOURCE_DIR, FV_VM_CACHE,
             FV_SOURCE_DIR, script, FV_VM_PROGRAMS, path);
    int status = system(command), code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    program_slurp(path, vm_output, sizeof vm_output);
    fputs(vm_output, stdout);
    if (code == 77) exit(77);
    return code;
}

#endif
