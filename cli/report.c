/* report: frames.csv. The other files of a session: report_json.c, report_html.c. */
#include "cli/report.h"

#include "cli/columns.h"
#include "cli/markup.h"

#include <ctype.h>
#include <math.h>

/* A stage's name as part of a column's. */
static void write_stage_header(struct fv_writer *out, const char *name)
{
    fv_writer_print(out, "stage_");
    for (; *name; name++) fv_writer_print(out, "%c", isalnum((unsigned char)*name) ? *name : '_');
    fv_writer_print(out, "_ms");
}

/* Numbers in full, booleans as 0 and 1, nothing where a value is not finite. */
static void write_cell(struct fv_writer *out, const struct fv_session *session,
                       const struct fv_column *column, int64_t record)
{
    if (column->kind == FV_COLUMN_INT64) {
        const char *at = (const char *)&session->record[record] + column->offset;
        fv_writer_print(out, "%lld", (long long)*(const int64_t *)at);
        return;
    }
    double value = fv_column_value(session, column, record);
    if (!isnan(value)) fv_json_number(out, value);
}

/* One line: the header where record is negative. */
static void write_line(struct fv_writer *out, const struct fv_session *session, int64_t record)
{
    for (int i = 0; i < FV_COLUMNS; i++) {
        int repeats = i == FV_COLUMN_STAGE ? fv_stages(session) : 1;
        for (int k = 0; k < repeats; k++) {
            struct fv_column column = i == FV_COLUMN_STAGE ? fv_column_stage(k) : fv_columns[i];
            if (i > 0) fv_writer_bytes(out, ",", 1);
            if (record >= 0) write_cell(out, session, &column, record);
            else if (i == FV_COLUMN_STAGE) write_stage_header(out, fv_stage_name(session, k));
            else fv_writer_print(out, "%s", column.name);
        }
    }
    fv_writer_bytes(out, "\n", 1);
}

int fv_report_csv(const struct fv_session *session, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    for (int64_t record = -1; record < fv_recorded(session); record++) write_line(&out, session, record);
    return fv_writer_close(&out, error);
}
