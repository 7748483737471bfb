/* lines: see the header. */
#include "platform/lines.h"

#include <stddef.h>
#include <string.h>

bool fv_lines_next(struct fv_lines *l)
{
    if (l->at >= l->end) return false;
    const char *stop = memchr(l->at, '\n', (size_t)(l->end - l->at));
    if (!stop) stop = l->end;
    size_t length = (size_t)(stop - l->at);
    if (length > 0 && l->at[length - 1] == '\r') length--;
    if (length >= sizeof l->text) length = sizeof l->text - 1;
    memcpy(l->text, l->at, length);
    l->text[length] = 0;
    l->at = stop < l->end ? stop + 1 : l->end;
    l->line++;
    return true;
}
