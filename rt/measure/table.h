/* table: a published paper's table measured again: what its numbers are called, what the paper gives and what
 * is measured here, cell by cell. A table is a row of the table of tables in table.c and a file of its own
 * (table_weier2016.c, ...); cli/measure_table.h runs it and shows it.
 *
 * A table is measured in parts, each at a scene and settings of its own. Memory is never given back, so the
 * caller gives each part a process. */
#ifndef FV_MEASURE_TABLE_H
#define FV_MEASURE_TABLE_H

#include "rt/measure/contest.h"

enum { FV_SHEET_CELLS_MAX = 6144, FV_TABLE_SETTINGS_MAX = 16, FV_TABLE_FRAMES_MAX = 100000 };

/* A cell of table-NAME.csv: plain names, without commas, quotes or line ends. */
struct fv_cell {
    char row[64], quantity[40], unit[12];
    double paper, ours; /* NaN: the paper does not say; not measured */
};

struct fv_sheet {
    int cells;
    struct fv_cell cell[FV_SHEET_CELLS_MAX];
};

/* Adds a cell; longer names are cut. At most FV_SHEET_CELLS_MAX: more are our own mistake. */
void fv_sheet_add(struct fv_sheet *sheet, const char *row, const char *quantity, const char *unit, double paper,
                  double ours);

/* The cell; NULL where there is none. */
const struct fv_cell *fv_sheet_find(const struct fv_sheet *sheet, const char *row, const char *quantity);

/* Its two values; NaN where there is no such cell. */
double fv_sheet_paper(const struct fv_sheet *sheet, const char *row, const char *quantity);
double fv_sheet_ours(const struct fv_sheet *sheet, const char *row, const char *quantity);

/* Writes table-NAME.csv: row,quantity,unit,paper,ours; what is NaN stays empty. Returns 0, or -1 with the
 * error set. */
int fv_sheet_csv(const struct fv_sheet *sheet, const char *path, struct fv_error *error);

/* A part's file: below a heading the fingerprint of what decided it, the machine and the frames it is of, then
 * its cells as above. Reading appends the cells. Returns 0, or -1 with the error set. */
enum { FV_PART_KEY = 32, FV_PART_ABOUT = 320 };
struct fv_part_heading {
    char key[FV_PART_KEY], about[FV_PART_ABOUT];
};
int fv_part_write(const struct fv_part_heading *heading, const struct fv_sheet *sheet, const char *path,
                  struct fv_error *error);
int fv_part_read(struct fv_part_heading *heading, struct fv_sheet *sheet, const char *path,
                 struct fv_error *error);

/* A part: what must be set, whatever the user's settings are. */
struct fv_table_part {
    char name[48]; /* "sponza-point": a file's name */
    char scene[24];
    int settings;
    const char *setting[FV_TABLE_SETTINGS_MAX]; /* "section.key=value", static */
    int path_frames; /* frames in which the scene's path is walked once; 0: scene.path_seconds stays */
};

/* All that a part is measured with. Its gaze is straight ahead. */
struct fv_table_bench {
    const struct fv_config *config;
    const struct fv_tracer *tracer;
    struct fv_workers *workers;
    const struct fv_sweep_io *io;
    int frames; /* that are counted */
    const char *folder; /* for its pictures */
    struct fv_error *error;
};

struct fv_table {
    const char *name, *paper, *what;
    const char *headline, *over; /* the quantity that sums a part up by its first row: times as fast as what */
    int frames; /* counted where --frames does not say */
    int parts;
    void (*part)(int n, int frames, struct fv_table_part *part);
    /* Lights as the part wants them, once the scene is loaded and before the tracer is opened. */
    void (*relight)(int n, struct fv_scene *scene);
    /* Adds the part's cells. Returns 0; 1: stopped; -1 with the bench's error set. Takes memory. */
    int (*measure)(int n, const struct fv_table_bench *bench, struct fv_sheet *sheet);
};

/* NULL where there is none of that name; the n-th, NULL past the last. */
const struct fv_table *fv_table_find(const char *name);
const struct fv_table *fv_table_at(int n);

extern const struct fv_table fv_table_weier2016, fv_table_kim2021, fv_table_peres2023, fv_table_polychronakis2023;

/* A row's name there, until the next call. */
const char *fv_row_polychronakis2023(const char *scene, const char *kind, int ssaa, double fovea_deg, int refresh);

#endif
