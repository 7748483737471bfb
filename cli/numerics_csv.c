/* numerics_csv: numerics.csv, written and read back. Cells hold neither commas nor quotes; a number that
 * is not there is an empty cell. */
#include "cli/numerics.h"

#include <assert.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static const struct column {
    const char *name;
    size_t offset, size; /* size: of a text; 0: a number */
    bool needed;         /* may not be empty */
} columns[] = {
#define TEXT(name, needed) \
    {#name, offsetof(struct fv_numeric_row, name), sizeof ((struct fv_numeric_row *)0)->name, needed}
#define NUMBER(name) {#name, offsetof(struct fv_numeric_row, name), 0, false}
    TEXT(quantity, true), TEXT(method, true), TEXT(condition, false), NUMBER(error_p50), NUMBER(error_p95),
    TEXT(error_unit, false), NUMBER(cost), TEXT(cost_unit, false),
#undef TEXT
#undef NUMBER
};
enum { COLUMNS = sizeof columns / sizeof columns[0], BYTES_MAX = 1 << 16 };

int fv_numerics_write(const struct fv_numeric_row *row, int rows, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    for (int c = 0; c < COLUMNS; c++)
        fv_writer_print(&out, "%s%c", columns[c].name, c + 1 < COLUMNS ? ',' : '\n');
    for (const struct fv_numeric_row *r = row; r < row + rows; r++)
        for (int c = 0; c < COLUMNS; c++) {
            const void *cell = (const char *)r + columns[c].offset;
            if (columns[c].size) {
                assert(!strpbrk(cell, ",\"\r\n"));
                fv_writer_print(&out, "%s", (const char *)cell);
            } else if (isfinite(*(const double *)cell)) {
                fv_writer_print(&out, "%.6g", *(const double *)cell);
            }
            fv_writer_print(&out, "%c", c + 1 < COLUMNS ? ',' : '\n');
        }
    return fv_writer_close(&out, error);
}

/* Printable text without quotes that fits. */
static bool read_text(const char *cell, const struct column *column, char *out)
{
    size_t length = strlen(cell);
    if (length >= column->size || (column->needed && length == 0)) return false;
    for (const char *c = cell; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f || *c == '"') return false;
    memcpy(out, cell, length + 1);
    return true;
}

/* Errors and costs are finite and not negative. */
static bool read_number(const char *cell, double *out)
{
    char *end;
    *out = NAN;
    if (!*cell) return true;
    if (!strchr("0123456789", *cell)) return false;
    *out = strtod(cell, &end);
    return !*end && isfinite(*out);
}

/* A line without its end; cuts it up. */
static bool read_row(char *line, struct fv_numeric_row *row)
{
    for (int c = 0; c < COLUMNS; c++) {
        char *comma = strchr(line, ','), *to = (char *)row + columns[c].offset;
        if ((comma != NULL) != (c + 1 < COLUMNS)) return false;
        if (comma) *comma = 0;
        bool good =
            columns[c].size ? read_text(line, &columns[c], to) : read_number(line, (double *)(void *)to);
        if (!good) return false;
        if (comma) line = comma + 1;
    }
    return true;
}

static bool is_heading(const char *line)
{
    for (int c = 0; c < COLUMNS; c++) {
        size_t length = strlen(columns[c].name);
        if (strncmp(line, columns[c].name, length) != 0) return false;
        if (line[length] != (c + 1 < COLUMNS ? ',' : 0)) return false;
        line += length + 1;
    }
    return true;
}

int fv_numerics_read(struct fv_numeric_row *row, const char *path, struct fv_error *error)
{
    char *text, *at, *end;
    size_t size;
    int line = 0, rows = 0;
    const char *wrong = NULL;
    if (fv_file_read(path, BYTES_MAX, &text, &size, error)) return -1;
    at = text;
    while (!wrong && at < text + size) {
        line++;
        end = strchr(at, '\n');
        if (!end) {
            wrong = "the line is cut short; must end with a line break";
            break;
        }
        *end = 0;
        if (line == 1) wrong = is_heading(at) ? NULL : "not the columns of numerics.csv";
        else if (rows == FV_NUMERICS_MAX) wrong = "more rows than the table has";
        else if (!read_row(at, &row[rows++])) wrong = "not a row of texts and numbers that are not negative";
        at = end + 1;
    }
    free(text);
    if (!wrong && line > 0) return rows;
    return fv_error_set(error, "%s:%d: %s; measure it again", path, line ? line : 1,
                        wrong ? wrong : "the file is empty");
}
