/* obj_check: what the lenient OBJ parser would let pass, found first, with its line. */
#ifndef FV_SCENE_OBJ_CHECK_H
#define FV_SCENE_OBJ_CHECK_H

#include "platform/error.h"

#include <stddef.h>

/* Checks the text of an OBJ file and changes it in place for the parser: lines ending in a backslash
 * are joined with the next, lines that it need not see become comments, blanks within a material's
 * name become underscores. Returns 0, or -1 with "path:line: ..." where a number is none or not
 * finite, an index is 0 or out of range, or there are too many elements. */
int fv_obj_check(const char *path, char *text, size_t size, struct fv_error *error);

/* The last of these for an MTL file: the names after newmtl. */
void fv_mtl_prepare(char *text);

#endif
