/* page: the frame of an HTML report: one file, no network, no script. Curves: plot.h. Nothing allocates. */
#ifndef FV_CLI_PAGE_H
#define FV_CLI_PAGE_H

#include "cli/markup.h"
#include "platform/files.h"

/* Doctype to <main>, and </main> to the end. */
void fv_page_open(struct fv_writer *out, const char *title);
void fv_page_close(struct fv_writer *out);

/* A section with a heading; `note` (NULL: none) is a sentence below it. Both plain text. */
void fv_section_open(struct fv_writer *out, const char *heading, const char *note);
void fv_section_close(struct fv_writer *out);

/* A section that says in n rows what terms mean: the term, plain text, and its explanation, HTML. */
void fv_terms(struct fv_writer *out, const char *heading, const char *const (*rows)[2], int n);

/* A large number with its name above and a remark below, inside <dl class="facts">. All plain text. */
void fv_fact(struct fv_writer *out, const char *name, struct fv_shown value, const char *unit,
             const char *more);

/* A table in a box of its own, which scrolls sideways where it is too wide. `cells`: HTML of the head. */
void fv_table_open(struct fv_writer *out, const char *class, const char *cells);
void fv_table_close(struct fv_writer *out);

/* Cells of a row: its name, a number, a bar `fraction` (clamped to 0..1) of its column wide. */
void fv_name_cell(struct fv_writer *out, const char *name);
void fv_number_cell(struct fv_writer *out, struct fv_shown shown);
void fv_bar_cell(struct fv_writer *out, double fraction);

#endif
