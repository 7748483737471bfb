/* report_sections: what the parts of report.html share; report_html.c puts them in order. */
#ifndef FV_CLI_REPORT_SECTIONS_H
#define FV_CLI_REPORT_SECTIONS_H

#include "cli/report.h"

struct fv_report_page {
    struct fv_writer *out;
    const struct fv_session *session;
    const struct fv_config *config;
    const struct fv_picture *picture; /* NULL: none */
    struct fv_png *png;
    double period_ms;    /* NaN where the session's is of no use */
    double frame_top_ms; /* where plots of the frame time end */
    int failed;
    struct fv_error *error;
};

/* report_time.c */
void fv_report_time(struct fv_report_page *page);

/* report_histogram.c */
void fv_report_histogram(struct fv_report_page *page);

/* report_rings.c; nothing where nothing was measured or cut */
void fv_report_eccentricity(struct fv_report_page *page);
void fv_report_cuts(struct fv_report_page *page);

/* report_tables.c */
void fv_report_stages(struct fv_report_page *page);
void fv_report_plan(struct fv_report_page *page);
void fv_report_memory(struct fv_report_page *page);
void fv_report_sealed(struct fv_report_page *page);
void fv_report_settings(struct fv_report_page *page);

#endif
