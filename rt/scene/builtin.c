/* builtin: scenes that need no file, by name. A new one is a function and a row here. */
#include "rt/scene/builtin_atrium.h"
#include "rt/scene/builtin_cornell.h"
#include "rt/scene/builtin_forest.h"
#include "rt/scene/builtin_pipes.h"

#include <string.h>

/* Of scenes that come in one detail only. */
static int read_atrium(struct fv_build *build, double detail, struct fv_error *error)
{
    (void)detail;
    return fv_atrium_read(build, error);
}

static int read_cornell(struct fv_build *build, double detail, struct fv_error *error)
{
    (void)detail;
    return fv_cornell_read(build, error);
}

static const struct {
    const char *name;
    int (*read)(struct fv_build *build, double detail, struct fv_error *error);
} scenes[] = {
    {"atrium", read_atrium},
    {"cornell", read_cornell},
    {"forest", fv_forest_read},
    {"pipes", fv_pipes_read},
};

int fv_builtin_read(struct fv_build *build, const char *name, double detail, struct fv_error *error)
{
    for (unsigned i = 0; i < sizeof scenes / sizeof scenes[0]; i++)
        if (strcmp(name, scenes[i].name) == 0) return scenes[i].read(build, detail, error);
    return fv_error_set(
        error, "builtin:%.100s: there is no such scene; there are builtin:atrium, builtin:cornell, builtin:forest and builtin:pipes", name);
}
