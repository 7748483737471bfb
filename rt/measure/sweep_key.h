/* sweep_key: a fingerprint of everything that decides what a sweep measures: the program itself,
 * scene, settings and the frames looked at. Rows and references with the same one belong together. */
#ifndef FV_MEASURE_SWEEP_KEY_H
#define FV_MEASURE_SWEEP_KEY_H

#include "rt/measure/contest.h"

void fv_sweep_fingerprint(char *out, unsigned size, const struct fv_config *config,
                          const struct fv_scene *scene,
                          const struct fv_sweep_frame (*frames)[FV_SWEEP_FRAMES]);

/* The same of what is known before a scene is read: the program and all settings but where files lie and where
 * output goes; and `frames`, how many are counted. */
void fv_settings_fingerprint(char *out, unsigned size, const struct fv_config *config, int frames);

#endif
