/* field: any bytes as a field file: read, or refused with a message that says where. */
#include "rt/scene/build.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fv_fields fields = {0};
    struct fv_error error = {""};
    struct fv_build *build = fv_build_create("fuzz");
    int result = fv_fields_read(&fields, build, (const char *)data, size, "fuzz", 1, &error);
    fv_build_destroy(build);
    if (result != 0 && strncmp(error.text, "fuzz:", 5) != 0) abort();
    if (result == 0 && (fields.parts < 1 || fields.codes < 1)) abort();
    return 0;
}
