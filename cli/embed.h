/* embed: pictures from files, JPEG or PNG, inside a page. */
#ifndef FV_CLI_EMBED_H
#define FV_CLI_EMBED_H

#include "cli/markup.h"

#include <stdbool.h>

/* True where the folder holds a picture of that name (no path); `folder` NULL: it does not. */
bool fv_embed_exists(const char *folder, const char *name);

/* Writes it as an <img> of the class with its description (plain text), or nothing where it is not there.
 * Returns 0, or -1 with the error set where it could not be read to its end. */
int fv_embed_picture(struct fv_writer *out, const char *folder, const char *name, const char *class,
                     const char *what, struct fv_error *error);

#endif
