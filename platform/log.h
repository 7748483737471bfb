/* log: one line a message on standard error; see error.h for errors as values.
 *
 * Standard output holds only what was asked for. A progress line is rewritten in place
 * on a terminal and left out elsewhere. Nothing here allocates. */
#ifndef FV_PLATFORM_LOG_H
#define FV_PLATFORM_LOG_H

#include <stdbool.h>

/* Prints "foveola: message". */
void fv_log(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Prints a line without the program's name: a row of a table. */
void fv_log_line(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Rewrites the progress line, cut to the terminal's width; does nothing unless standard error is a terminal. */
void fv_log_progress(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* True when standard error is a terminal, so that progress is seen. */
bool fv_log_is_terminal(void);

/* Prints "foveola: message" and exits with the code (2: unusable input, 3: a device failed). */
void fv_die(int code, const char *format, ...) __attribute__((format(printf, 2, 3), noreturn));

/* What fv_die calls before it exits; one function, NULL: none. For what must not outlive the program: a screen. */
void fv_die_calls(void (*function)(void));

#endif
