/* json: text and numbers as JSON wants them, whatever bytes they hold. Nothing allocates. */
#ifndef FV_PLATFORM_JSON_H
#define FV_PLATFORM_JSON_H

#include "platform/files.h"

/* Bytes of the UTF-8 sequence at `text` (Unicode 15, table 3-7), 0 where there is none. */
int fv_utf8_length(const char *text);

/* U+FFFD, which stands for what is none. */
#define FV_UTF8_REPLACEMENT "\xEF\xBF\xBD"

/* A quoted string; bytes that are no UTF-8 become U+FFFD. NULL is the empty string. */
void fv_json_text(struct fv_writer *out, const char *text);

/* The shortest decimal that reads back as the same number (the same float, where it is one);
 * null where it is not finite. */
void fv_json_number(struct fv_writer *out, double value);

#endif
