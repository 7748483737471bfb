/* lines: the lines of a text in memory, one after another. */
#ifndef FV_PLATFORM_LINES_H
#define FV_PLATFORM_LINES_H

#include <stdbool.h>

enum { FV_LINE_BYTES = 256 };

/* Begun with the text's name for messages, its start and its end; the rest 0. */
struct fv_lines {
    const char *name, *at, *end;
    int line; /* number of the line in `text`, from 1 */
    char text[FV_LINE_BYTES];
};

/* The next line, without its end; false: there is none. Longer ones are cut. */
bool fv_lines_next(struct fv_lines *lines);

#endif
