/* builtin_cornell: the classic box, for checking light by eye: small, and known to everyone. */
#ifndef FV_SCENE_BUILTIN_CORNELL_H
#define FV_SCENE_BUILTIN_CORNELL_H

#include "rt/scene/build.h"

int fv_cornell_read(struct fv_build *build, struct fv_error *error);

#endif
