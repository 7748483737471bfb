/* report: writes a session's report.json and report.html; its frames.csv is written while it runs
 * (frames_csv.h). Allocates nothing, so that it may run after the heap is sealed. */
#ifndef FV_CLI_REPORT_H
#define FV_CLI_REPORT_H

#include "config/config.h"
#include "display/display.h"
#include "platform/error.h"
#include "rt/frame/session.h"

/* DESIGN's keys: version, host, config, scene, method, frames, ... sealed. */
int fv_report_json(const struct fv_session *session, const struct fv_config *config, const char *path,
                   struct fv_error *error);

/* A page readable without network: frame times over time with the budget line, and below them what was
 * cut, level, radius and density; stages, spread and cost by eccentricity; what was kept and left out,
 * memory, settings, and the last picture (NULL: none) of each eye. */
int fv_report_html(const struct fv_session *session, const struct fv_config *config,
                   const struct fv_picture *picture, struct fv_png *png, const char *path,
                   struct fv_error *error);

#endif
