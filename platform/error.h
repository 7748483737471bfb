/* error: an error as a value: one line saying what, where, and what would be right.
 *
 * Functions that can fail on input take a `struct fv_error *` last and return 0 when
 * done, -1 when the error has been set. Assertions are for our own mistakes only. */
#ifndef FV_PLATFORM_ERROR_H
#define FV_PLATFORM_ERROR_H

struct fv_error {
    char text[512];
};

/* Writes the message (printf form) and returns -1, so that `return fv_error_set(...)` reads well. */
int fv_error_set(struct fv_error *error, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
