/* frames_csv: frames.csv, a row a frame, written while frames run. Nothing here allocates. */
#ifndef FV_CLI_FRAMES_CSV_H
#define FV_CLI_FRAMES_CSV_H

#include "platform/error.h"
#include "rt/frame/session.h"

/* Opens the file and writes the header: the names of columns.h, with a column for each of the session's
 * stages. The file is seen under its name once it is closed. */
int fv_frames_csv_open(const struct fv_session *session, const char *path, struct fv_error *error);

/* Numbers in full, booleans as 0 and 1, nothing where a value is not finite. A disk that fills ends the
 * file after the last block of rows that fitted, not the run: said once. */
void fv_frames_csv_row(const struct fv_session *session, const struct fv_frame_record *record);

/* Returns -1 where rows are missing, too. */
int fv_frames_csv_close(struct fv_error *error);

#endif
