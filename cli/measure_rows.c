/* measure_rows: see measure.h. */
#include "cli/measure.h"
#include "cli/measure_page.h"

#include "rt/method/method.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool ends_with(const char *name, const char *ending)
{
    size_t n = strlen(name), m = strlen(ending);
    return n >= m && strcmp(name + n - m, ending) == 0;
}

/* Calls take(context, path, name) for each file of folder/sub that ends so; fewer than 0: ended by -1. A
 * folder that is not there has none. */
static int each_file(const char *folder, const char *sub, const char *ending,
                     int (*take)(void *context, const char *path, const char *name, struct fv_error *error),
                     void *context, struct fv_error *error)
{
    char path[FV_PATH_MAX + 300];
    int n = 0;
    snprintf(path, sizeof path, "%.1000s/%s", folder, sub);
    DIR *list = opendir(path);
    if (!list) return 0;
    for (struct dirent *d; n >= 0 && (d = readdir(list));) {
        if (d->d_name[0] == '.' || !ends_with(d->d_name, ending)) continue;
        snprintf(path, sizeof path, "%.1000s/%s/%.255s", folder, sub, d->d_name);
        n = take(context, path, d->d_name, error) ? -1 : n + 1;
    }
    closedir(list);
    return n;
}

static struct fv_measure_row row[FV_ROWS_MAX];
static struct fv_numeric_row numeric[FV_NUMERICS_MAX];

/* The path of the row read into row[i], for messages. */
static char row_path[FV_ROWS_MAX][FV_PATH_MAX];

static int take_row(void *context, const char *path, const char *name, struct fv_error *error)
{
    int *rows = context;
    (void)name;
    if (*rows == FV_ROWS_MAX)
        return fv_error_set(error, "%s: more than %d rows; keep them in two folders", path, FV_ROWS_MAX);
    if (fv_row_read(&row[*rows], path, error)) return -1;
    snprintf(row_path[*rows], sizeof row_path[0], "%.1000s", path);
    for (int i = 0; i < *rows; i++)
        if (strcmp(row[i].scene, row[*rows].scene) == 0 && strcmp(row[i].key, row[*rows].key) != 0)
            return fv_error_set(
                error, "%s and %s: measured with different versions or settings; measure one of them again",
                row_path[i], path);
    ++*rows;
    return 0;
}

/* Rows that a whole sweep of the scenes has and these have not. */
static int count_missing(int rows)
{
    int of_scene = 0, scenes = 0, missing;
    for (int n = 0; fv_method_at(n); n++) of_scene += fv_method_at(n)->measured;
    for (int i = 0; i < rows; i++) scenes += i == 0 || strcmp(row[i].scene, row[i - 1].scene) != 0;
    missing = scenes * of_scene - rows;
    return missing > 0 ? missing : 0;
}

int fv_measure_check(const char *out, const char *scene, const char *key, struct fv_error *error)
{
    char path[FV_PATH_MAX + 32];
    int rows = 0;
    if (each_file(out, "rows", ".row", take_row, &rows, error) < 0) return -1;
    for (int i = 0; i < rows; i++)
        if (strcmp(row[i].scene, scene) == 0 && strcmp(row[i].key, key) != 0)
            return fv_error_set(
                error, "%s: of another scene, version or other settings; remove it or give another --out",
                row_path[i]);
    snprintf(path, sizeof path, "%s/numerics.csv", out);
    return fv_file_exists(path) && fv_numerics_read(numeric, path, error) < 0 ? -1 : 0;
}

int fv_measure_write(const char *out, int *rows, int *missing, struct fv_error *error)
{
    char path[FV_PATH_MAX + 32], pictures[FV_PATH_MAX + 32];
    *rows = 0;
    if (each_file(out, "rows", ".row", take_row, rows, error) < 0) return -1;
    fv_rows_sort(row, *rows);
    *missing = count_missing(*rows);
    snprintf(path, sizeof path, "%s/measure.csv", out);
    if (fv_rows_csv(row, *rows, path, error)) return -1;
    if (*rows == 0) return 0;
    snprintf(path, sizeof path, "%s/numerics.csv", out);
    int numerics = fv_file_exists(path) ? fv_numerics_read(numeric, path, error) : 0;
    if (numerics < 0) return -1;
    snprintf(path, sizeof path, "%s/report.html", out);
    snprintf(pictures, sizeof pictures, "%s/pictures", out);
    struct fv_measure_report report = {.rows = *rows,
                                       .row = row,
                                       .numerics = numerics,
                                       .numeric = numeric,
                                       .missing = *missing,
                                       .pictures = pictures,
                                       .period_ms = row[0].period_ms};
    return fv_measure_page(&report, path, error);
}

struct copy {
    const char *out, *sub;
};

static int copy_file(void *context, const char *from, const char *name, struct fv_error *error)
{
    static struct fv_writer writer;
    const struct copy *c = context;
    char to[FV_PATH_MAX + 300], *bytes;
    size_t size;
    snprintf(to, sizeof to, "%.1000s/%s/%.255s", c->out, c->sub, name);
    if (fv_file_exists(to)) return 0;
    if (fv_file_read(from, 1 << 30, &bytes, &size, error)) return -1;
    int failed = fv_writer_open(&writer, to, error);
    if (!failed) {
        fv_writer_bytes(&writer, bytes, size);
        failed = fv_writer_close(&writer, error);
    }
    free(bytes);
    return failed;
}

/* All rows of the folders and of OUT, read before anything is copied: a bad one leaves OUT as it was. */
static int check_folders(const char *const *folder, int folders, const char *out, struct fv_error *error)
{
    int rows = 0;
    char path[FV_PATH_MAX + 32];
    for (int i = 0; i < folders; i++) {
        int before = rows;
        if (each_file(folder[i], "rows", ".row", take_row, &rows, error) < 0) return -1;
        snprintf(path, sizeof path, "%.1000s/measure.csv", folder[i]); /* a share may be empty */
        if (rows == before && !fv_file_exists(path))
            return fv_error_set(error, "%s: holds no rows of a measure (rows/*.row)", folder[i]);
    }
    if (rows == 0)
        return fv_error_set(error, "%s: none of the folders holds a row of a measure (rows/*.row)",
                            folder[0]);
    return each_file(out, "rows", ".row", take_row, &rows, error) < 0 ? -1 : 0;
}

int fv_measure_merge(const char *const *folder, int folders, const char *out, struct fv_error *error)
{
    static const struct {
        const char *sub, *ending;
    } kinds[] = {{"rows", ".row"}, {"pictures", ".jpg"}, {".", "numerics.csv"}};
    char path[FV_PATH_MAX + 32];
    if (check_folders(folder, folders, out, error)) return -1;
    for (unsigned k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        struct copy copy = {out, kinds[k].sub};
        snprintf(path, sizeof path, "%s/%s", out, kinds[k].sub);
        if (fv_folder_make(path, error)) return -1;
        for (int i = 0; i < folders; i++)
            if (each_file(folder[i], kinds[k].sub, kinds[k].ending, copy_file, &copy, error) < 0) return -1;
    }
    return 0;
}
