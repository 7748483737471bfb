/* man: the manual page; see man.c. */
#ifndef FV_CLI_MAN_H
#define FV_CLI_MAN_H

#include "platform/files.h"

void fv_man_print(struct fv_writer *out);

#endif
