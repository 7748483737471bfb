/* table: the table of tables, and cells as text; see table.h. */
#include "rt/measure/table.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct fv_table *const tables[] = {&fv_table_weier2016, &fv_table_kim2021, &fv_table_peres2023, &fv_table_polychronakis2023};

const struct fv_table *fv_table_at(int n)
{
    return n >= 0 && n < (int)(sizeof tables / sizeof tables[0]) ? tables[n] : NULL;
}

const struct fv_table *fv_table_find(const char *name)
{
    for (int n = 0; fv_table_at(n); n++)
        if (strcmp(fv_table_at(n)->name, name) == 0) return fv_table_at(n);
    return NULL;
}

void fv_sheet_add(struct fv_sheet *s, const char *row, const char *quantity, const char *unit, double paper,
                  double ours)
{
    assert(s->cells < FV_SHEET_CELLS_MAX);
    if (s->cells == FV_SHEET_CELLS_MAX) return;
    struct fv_cell *c = &s->cell[s->cells++];
    snprintf(c->row, sizeof c->row, "%s", row);
    snprintf(c->quantity, sizeof c->quantity, "%s", quantity);
    snprintf(c->unit, sizeof c->unit, "%s", unit);
    c->paper = paper;
    c->ours = ours;
}

const struct fv_cell *fv_sheet_find(const struct fv_sheet *s, const char *row, const char *quantity)
{
    for (int i = 0; i < s->cells; i++)
        if (strcmp(s->cell[i].row, row) == 0 && strcmp(s->cell[i].quantity, quantity) == 0) return &s->cell[i];
    return NULL;
}

double fv_sheet_paper(const struct fv_sheet *s, const char *row, const char *quantity)
{
    const struct fv_cell *c = fv_sheet_find(s, row, quantity);
    return c ? c->paper : (double)NAN;
}

double fv_sheet_ours(const struct fv_sheet *s, const char *row, const char *quantity)
{
    const struct fv_cell *c = fv_sheet_find(s, row, quantity);
    return c ? c->ours : (double)NAN;
}

static const char columns[] = "row,quantity,unit,paper,ours\n";
static const char heading_text[] = "foveola table part 1\n";

static void write_cells(struct fv_writer *out, const struct fv_sheet *s)
{
    fv_writer_print(out, "%s", columns);
    for (const struct fv_cell *c = s->cell; c < s->cell + s->cells; c++) {
        fv_writer_print(out, "%s,%s,%s,", c->row, c->quantity, c->unit);
        if (!isnan(c->paper)) fv_writer_print(out, "%.6g", c->paper);
        fv_writer_print(out, ",");
        if (!isnan(c->ours)) fv_writer_print(out, "%.6g", c->ours);
        fv_writer_print(out, "\n");
    }
}

int fv_sheet_csv(const struct fv_sheet *sheet, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    write_cells(&out, sheet);
    return fv_writer_close(&out, error);
}

int fv_part_write(const struct fv_part_heading *heading, const struct fv_sheet *sheet, const char *path,
                  struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "%s%s\n%s\n", heading_text, heading->key, heading->about);
    write_cells(&out, sheet);
    return fv_writer_close(&out, error);
}

/* Cuts off what stands before the next `mark` and copies it; false where there is none or it is too long. */
static bool take(char **at, char mark, char *to, size_t size)
{
    char *end = strchr(*at, mark);
    if (!end || (size_t)(end - *at) >= size) return false;
    memcpy(to, *at, (size_t)(end - *at));
    to[end - *at] = 0;
    *at = end + 1;
    return true;
}

static bool take_value(char **at, char mark, double *value)
{
    char text[40], *end;
    if (!take(at, mark, text, sizeof text)) return false;
    *value = text[0] ? strtod(text, &end) : (double)NAN;
    return !text[0] || (end > text && !*end && isfinite(*value));
}

static bool take_cell(char **at, struct fv_sheet *s)
{
    struct fv_cell c;
    if (s->cells == FV_SHEET_CELLS_MAX || !take(at, ',', c.row, sizeof c.row) ||
        !take(at, ',', c.quantity, sizeof c.quantity) || !take(at, ',', c.unit, sizeof c.unit) ||
        !take_value(at, ',', &c.paper) || !take_value(at, '\n', &c.ours))
        return false;
    s->cell[s->cells++] = c;
    return true;
}

int fv_part_read(struct fv_part_heading *heading, struct fv_sheet *sheet, const char *path,
                 struct fv_error *error)
{
    char *text, *at;
    size_t size;
    if (fv_file_read(path, 1 << 20, &text, &size, error)) return -1;
    bool good = strncmp(text, heading_text, sizeof heading_text - 1) == 0;
    at = text + (good ? sizeof heading_text - 1 : 0);
    good = good && take(&at, '\n', heading->key, sizeof heading->key) &&
           take(&at, '\n', heading->about, sizeof heading->about) &&
           strncmp(at, columns, sizeof columns - 1) == 0;
    if (good) at += sizeof columns - 1;
    while (good && *at) good = take_cell(&at, sheet);
    good = good && at == text + size;
    free(text);
    if (good) return 0;
    return fv_error_set(error, "%s: not a whole part of this version's table; remove it to measure it again",
                        path);
}
