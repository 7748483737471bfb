/* program: runs the program under test as a user would, in a fresh folder. For tests only. */
#ifndef FV_TESTS_PROGRAM_H
#define FV_TESTS_PROGRAM_H

#include <stdarg.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

struct program_result {
    int code;          /* exit code, -1 when killed by a signal */
    char errors[8192]; /* standard error */
    char output[16384];
};

/* A fresh folder, made once a test program; removed by the caller or left to the system. */
static inline const char *program_folder(void)
{
    static char folder[64];
    if (!folder[0]) {
        snprintf(folder, sizeof folder, "/tmp/foveola-test-XXXXXX");
        if (!mkdtemp(folder)) abort();
    }
    return folder;
}

static inline void program_slurp(const char *path, char *out, size_t size)
{
    FILE *f = fopen(path, "rb");
    size_t n = f ? fread(out, 1, size - 1, f) : 0;
    out[n] = 0;
    if (f) fclose(f);
}

/* Runs "foveola " + the formatted arguments through the shell, in the fresh folder. */
static inline struct program_result program(const char *format, ...) __attribute__((format(printf, 1, 2)));
static inline struct program_result program(const char *format, ...)
{
    static struct program_result r;
    char arguments[4096], command[6144], path[128];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    snprintf(command, sizeof command, "cd %s && %s %s >stdout.txt 2>stderr.txt </dev/null", program_folder(),
             FV_PROGRAM, arguments);
    int status = system(command);
    r.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    snprintf(path, sizeof path, "%s/stderr.txt", program_folder());
    program_slurp(path, r.errors, sizeof r.errors);
    snprintf(path, sizeof path, "%s/stdout.txt", program_folder());
    program_slurp(path, r.output, sizeof r.output);
    return r;
}

static inline void program_write(const char *name, const void *bytes, size_t size)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    fclose(f);
}

/* Removes the folder and what is in it. */
static inline int program_clean(void **state)
{
    char command[128];
    (void)state;
    snprintf(command, sizeof command, "rm -rf %s", program_folder());
    return system(command);
}

#endif
