/* frames_csv: the columns of columns.h as text; see frames_csv.h. */
#include "cli/frames_csv.h"

#include "cli/columns.h"
#include "platform/json.h"
#include "platform/log.h"

#include <ctype.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

/* No row is longer: every column's longest number and name are far below 64 bytes, but for names of stages.
 */
enum { ROW_MAX = 64 * (FV_COLUMNS + FV_STAGES_MAX) };

static struct fv_writer out;
static bool opened, ended;
static off_t whole; /* bytes of the file up to the end of a row, so far written */

static void write_integer(int64_t value)
{
    char text[24];
    char *at = text + sizeof text;
    uint64_t size = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    do *--at = (char)('0' + size % 10);
    while ((size /= 10) > 0);
    if (value < 0) *--at = '-';
    fv_writer_bytes(&out, at, (size_t)(text + sizeof text - at));
}

static void write_cell(const struct fv_frame_record *record, const struct fv_column *column)
{
    const char *at = (const char *)record + column->offset;
    double value = fv_record_value(record, column);
    switch (column->kind) {
    case FV_COLUMN_INT64: write_integer(*(const int64_t *)at); break;
    case FV_COLUMN_INT32:
    case FV_COLUMN_UINT32:
    case FV_COLUMN_BOOL: write_integer((int64_t)value); break;
    case FV_COLUMN_FLOAT:
        if (!isnan(value)) fv_json_number(&out, value);
        break;
    }
}

/* A stage's name as part of a column's. */
static void write_stage_header(const char *name)
{
    fv_writer_print(&out, "stage_");
    for (; *name; name++) fv_writer_print(&out, "%c", isalnum((unsigned char)*name) ? *name : '_');
    fv_writer_print(&out, "_ms");
}

/* The header where record is NULL. */
static void write_line(const struct fv_session *session, const struct fv_frame_record *record)
{
    for (int i = 0; i < FV_COLUMNS; i++) {
        int repeats = i == FV_COLUMN_STAGE ? fv_stages(session) : 1;
        for (int k = 0; k < repeats; k++) {
            struct fv_column column = i == FV_COLUMN_STAGE ? fv_column_stage(k) : fv_columns[i];
            if (i > 0) fv_writer_bytes(&out, ",", 1);
            if (record) write_cell(record, &column);
            else if (i == FV_COLUMN_STAGE) write_stage_header(fv_stage_name(session, k));
            else fv_writer_print(&out, "%s", column.name);
        }
    }
    fv_writer_bytes(&out, "\n", 1);
}

/* Writes out what is buffered, which ends with a row. */
static void flush_rows(void)
{
    if (out.used == 0 || out.failed) return;
    fv_writer_flush(&out);
    if (!out.failed) whole = lseek(out.fd, 0, SEEK_CUR);
}

int fv_frames_csv_open(const struct fv_session *session, const char *path, struct fv_error *error)
{
    if (fv_writer_open(&out, path, error)) return -1;
    opened = true;
    ended = false;
    whole = 0;
    write_line(session, NULL);
    return 0;
}

void fv_frames_csv_row(const struct fv_session *session, const struct fv_frame_record *record)
{
    if (!opened || ended) return;
    write_line(session, record);
    if (sizeof out.buffer - out.used < ROW_MAX) flush_rows();
    if (!out.failed) return;
    ended = true;
    fv_log("frames.csv: %s: it ends here, the run goes on", strerror(out.failed));
}

int fv_frames_csv_close(struct fv_error *error)
{
    if (!opened) return 0;
    flush_rows();
    opened = false;
    int failed = out.failed;
    if (failed && whole > 0 && ftruncate(out.fd, whole) == 0) out.failed = 0;
    out.used = 0;
    if (fv_writer_close(&out, error)) return -1;
    return failed ? fv_error_set(error, "%s: rows are missing: %s", out.path, strerror(failed)) : 0;
}
