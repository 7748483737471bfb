/* embed: see embed.h. */
#include "cli/embed.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

enum { CHUNK = 3 << 14 };

static const struct kind {
    const char *type;
    unsigned char start[3];
} kinds[] = {{"jpeg", {0xFF, 0xD8, 0xFF}}, {"png", {0x89, 'P', 'N'}}};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

/* Opens one of the folder's pictures; -1 where there is none, or none of a kind that is known. */
static int open_picture(const char *folder, const char *name, char path[FV_PATH_MAX],
                        const struct kind **kind)
{
    unsigned char start[3] = {0};
    if (!folder || strchr(name, '/') || fv_path_join(path, folder, name)) return -1;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return -1;
    ssize_t n = pread(fd, start, 3, 0);
    for (*kind = kinds; *kind < kinds + KINDS; ++*kind)
        if (n == 3 && memcmp(start, (*kind)->start, 3) == 0) return fd;
    close(fd);
    return -1;
}

bool fv_embed_exists(const char *folder, const char *name)
{
    char path[FV_PATH_MAX];
    const struct kind *kind;
    int fd = open_picture(folder, name, path, &kind);
    if (fd >= 0) close(fd);
    return fd >= 0;
}

int fv_embed_picture(struct fv_writer *out, const char *folder, const char *name, const char *class,
                     const char *what, struct fv_error *error)
{
    static unsigned char chunk[CHUNK];
    struct fv_base64 state = {.carried = 0};
    char path[FV_PATH_MAX];
    const struct kind *kind;
    ssize_t n;
    int result = 0, fd = open_picture(folder, name, path, &kind);
    if (fd < 0) return 0;
    fv_writer_print(out, "<img class=\"%s\" alt=\"", class);
    fv_html_text(out, what);
    fv_writer_print(out, "\" src=\"data:image/%s;base64,", kind->type);
    while (result == 0 && (n = read(fd, chunk, sizeof chunk)) != 0) {
        if (n > 0) fv_writer_base64(out, &state, chunk, (size_t)n);
        else if (errno != EINTR)
            result = fv_error_set(error, "%s: cannot be read: %s", path, strerror(errno));
    }
    fv_writer_base64_end(out, &state);
    fv_writer_print(out, "\">");
    close(fd);
    return result;
}
