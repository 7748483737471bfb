/* check: what settings must hold beyond the ranges in keys.def: values against each other, lists by their
 * numbers. */
#ifndef FV_CONFIG_CHECK_H
#define FV_CONFIG_CHECK_H

#include "config/config.h"

/* 0, or -1 with "where it came from: section.name: what is wrong, what would be right" for the first that
 * does not hold. */
int fv_config_check(const struct fv_config *config, struct fv_error *error);

#endif
