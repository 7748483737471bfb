/* log: messages and errors as text. Formats into a stack buffer and writes it with one
 * call, so that lines of several threads do not mix and nothing is allocated. */
#include "platform/log.h"

#include "platform/error.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

static atomic_bool progress_shown; /* devices' threads log too */

static void write_line(const char *before, const char *format, va_list arguments, const char *after)
{
    char line[768];
    int start = snprintf(line, sizeof line, "%s", before);
    int length = vsnprintf(line + start, sizeof line - (size_t)start - 8, format, arguments);
    size_t end = (size_t)start + (length > 0 ? (size_t)length : 0);
    if (end > sizeof line - 8) end = sizeof line - 8;
    memcpy(line + end, after, strlen(after));
    end += strlen(after);
    ssize_t written = write(STDERR_FILENO, line, end);
    (void)written; /* nowhere left to say that standard error is gone */
}

void fv_log(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(progress_shown ? "\r\033[Kfoveola: " : "foveola: ", format, arguments, "\n");
    progress_shown = false;
    va_end(arguments);
}

bool fv_log_is_terminal(void)
{
    static int terminal = -1;
    if (terminal < 0) terminal = isatty(STDERR_FILENO);
    return terminal != 0;
}

void fv_log_line(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(progress_shown ? "\r\033[K" : "", format, arguments, "\n");
    progress_shown = false;
    va_end(arguments);
}

void fv_log_progress(const char *format, ...)
{
    if (!fv_log_is_terminal()) return;
    static const char clear[] = "\033[K";
    char line[256] = "\r";
    struct winsize size;
    size_t room = sizeof line - sizeof clear;
    /* A line that wraps could not be rewritten. */
    bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    if (known && size.ws_col < room) room = size.ws_col;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line + 1, room, format, arguments);
    va_end(arguments);
    strcat(line, clear);
    ssize_t written = write(STDERR_FILENO, line, strlen(line));
    (void)written;
    progress_shown = true;
}

static void (*at_death)(void);

void fv_die_calls(void (*function)(void))
{
    at_death = function;
}

void fv_die(int code, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_line(progress_shown ? "\r\033[Kfoveola: " : "foveola: ", format, arguments, "\n");
    va_end(arguments);
    void (*function)(void) = at_death;
    at_death = NULL; /* what fails while it runs ends the program all the same */
    if (function) function();
    _exit(code);
}

int fv_error_set(struct fv_error *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return -1;
}
