/* builtin: scenes that need no file, by name. A new one is a function and a row here. */
#include "rt/scene/builtin_atrium.h"
#include "rt/scene/builtin_cornell.h"

#include <string.h>

static const struct {
    const char *name;
    int (*read)(struct fv_build *build, struct fv_error *error);
} scenes[] = {
    {"atrium", fv_atrium_read},
    {"cornell", fv_cornell_read},
};

int fv_builtin_read(struct fv_build *build, const char *name, struct fv_error *error)
{
    for (unsigned i = 0; i < sizeof scenes / sizeof scenes[0]; i++)
        if (strcmp(name, scenes[i].name) == 0) return scenes[i].read(build, error);
    return fv_error_set(
        error, "builtin:%.100s: there is no such scene; there are builtin:atrium and builtin:cornell", name);
}
