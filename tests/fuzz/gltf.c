/* gltf: any bytes as a .glb or .gltf: read and laid out, or refused with a message. Every input gets the
 * arena as the one before found it. */
#include "platform/arena.h"
#include "rt/scene/gltf.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_scene scene;
    struct fv_error error = {""};
    struct fv_build *build = fv_build_create("fuzz");
    size_t used = fv_arena()->used;
    int result = fv_gltf_read_memory(build, data, size, "fuzz", NULL, 1, &error);
    if (result) fv_build_destroy(build);
    else result = fv_build_finish(build, &scene, &error);
    if (result != 0 && error.text[0] == 0) abort(); /* refused without saying why */
    if (result == 0 && scene.triangles < 1) abort();
    fv_arena()->used = used;
    return 0;
}
