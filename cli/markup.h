/* markup: text as HTML wants it, whatever bytes it holds, and numbers for people. Nothing allocates. */
#ifndef FV_CLI_MARKUP_H
#define FV_CLI_MARKUP_H

#include "platform/files.h"

/* Text between tags or in a quoted attribute; control characters and what is no UTF-8 become U+FFFD. */
void fv_html_text(struct fv_writer *out, const char *text);

/* Numbers for people, in a value that can be printed at once: fv_shown_ms(x).text. An en dash
 * where there is none. */
struct fv_shown {
    char text[32];
};
struct fv_shown fv_shown_fixed(double value, int decimals);
struct fv_shown fv_shown_count(double value);      /* 812, 12.3 k, 4.56 M */
struct fv_shown fv_shown_bytes(double bytes);      /* 812 B, 12.3 KB, 4.56 MB: powers of 1024 */
struct fv_shown fv_shown_percent(double fraction); /* 0.123 is 12.3 % */

#endif
