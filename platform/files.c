/* files: reading and atomic writing; see files.h. */
#include "platform/files.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int fv_file_read(const char *path, size_t most, char **bytes, size_t *size, struct fv_error *error)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a FIFO must not hold us up */
    if (fd < 0) return fv_error_set(error, "%s: %s", path, strerror(errno));
    struct stat status;
    if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(fd);
        return fv_error_set(error, "%s: not a regular file", path);
    }
    if ((size_t)status.st_size > most) {
        close(fd);
        return fv_error_set(error, "%s: %lld bytes, more than the %zu allowed", path,
                            (long long)status.st_size, most);
    }
    size_t length = (size_t)status.st_size, have = 0;
    char *data = malloc(length + 1);
    while (data && have < length) {
        ssize_t n = read(fd, data + have, length - have);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        have += (size_t)n;
    }
    close(fd);
    if (!data || have < length) {
        free(data);
        return fv_error_set(error, "%s: could not be read whole", path);
    }
    data[length] = 0;
    *bytes = data;
    *size = length;
    return 0;
}

bool fv_file_exists(const char *path)
{
    return access(path, F_OK) == 0;
}

void fv_file_remove(const char *folder, const char *name)
{
    char path[FV_PATH_MAX];
    if (fv_path_join(path, folder, name) == 0) unlink(path);
}

bool fv_same_folder(const char *a, const char *b)
{
    struct stat sa, sb;
    return stat(a, &sa) == 0 && stat(b, &sb) == 0 && sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino;
}

int fv_folder_make(const char *path, struct fv_error *error)
{
    char part[FV_PATH_MAX];
    size_t length = strlen(path);
    if (length == 0 || length >= sizeof part) return fv_error_set(error, "'%s': not a usable folder name", path);
    for (size_t i = 1; i <= length; i++) {
        if (path[i] != '/' && path[i] != 0) continue;
        memcpy(part, path, i);
        part[i] = 0;
        if (mkdir(part, 0777) != 0 && errno != EEXIST)
            return fv_error_set(error, "%s: cannot make the folder: %s", part, strerror(errno));
    }
    struct stat status;
    if (stat(path, &status) != 0 || !S_ISDIR(status.st_mode))
        return fv_error_set(error, "%s: not a folder", path);
    if (access(path, W_OK | X_OK) != 0) return fv_error_set(error, "%s: cannot be written into: %s", path, strerror(errno));
    return 0;
}

int fv_path_join(char out[FV_PATH_MAX], const char *folder, const char *name)
{
    const char *join = folder[0] && name[0] != '/' ? "/" : "";
    int n = snprintf(out, FV_PATH_MAX, "%s%s%s", join[0] ? folder : "", join, name);
    return n < FV_PATH_MAX ? 0 : -1;
}

void fv_path_folder(char out[FV_PATH_MAX], const char *path)
{
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) : 0;
    if (!slash || length >= FV_PATH_MAX) snprintf(out, FV_PATH_MAX, ".");
    else snprintf(out, FV_PATH_MAX, "%.*s", length ? (int)length : 1, path);
}

static bool to_standard_output(const struct fv_writer *w)
{
    return strcmp(w->path, "-") == 0;
}

int fv_writer_open(struct fv_writer *w, const char *path, struct fv_error *error)
{
    char temporary[FV_PATH_MAX + 8];
    w->used = 0;
    w->failed = 0;
    w->fd = -1;
    if (snprintf(w->path, sizeof w->path, "%s", path) >= (int)sizeof w->path)
        return fv_error_set(error, "%.60s...: path too long", path);
    if (to_standard_output(w)) {
        w->fd = STDOUT_FILENO;
        return 0;
    }
    snprintf(temporary, sizeof temporary, "%s.part", w->path);
    w->fd = open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (w->fd < 0) return fv_error_set(error, "%s: cannot be written: %s", path, strerror(errno));
    return 0;
}

static void write_all(struct fv_writer *w, const char *bytes, size_t size)
{
    while (size > 0 && !w->failed) {
        ssize_t n = write(w->fd, bytes, size);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) w->failed = errno;
        else bytes += n, size -= (size_t)n;
    }
}

void fv_writer_flush(struct fv_writer *w)
{
    write_all(w, w->buffer, w->used);
    w->used = 0;
}

void fv_writer_bytes(struct fv_writer *w, const void *bytes, size_t size)
{
    if (size > sizeof w->buffer - w->used) fv_writer_flush(w);
    if (size > sizeof w->buffer) {
        write_all(w, bytes, size);
        return;
    }
    memcpy(w->buffer + w->used, bytes, size);
    w->used += size;
}

void fv_writer_print(struct fv_writer *w, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    int n = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (n < 0) return;
    if ((size_t)n < sizeof text) {
        fv_writer_bytes(w, text, (size_t)n);
        return;
    }
    /* Too long for the stack buffer: format again into the writer's own. */
    fv_writer_flush(w);
    va_start(arguments, format);
    n = vsnprintf(w->buffer, sizeof w->buffer, format, arguments);
    va_end(arguments);
    w->used = (size_t)n < sizeof w->buffer ? (size_t)n : sizeof w->buffer - 1;
}

/* Four letters for `count` (1 to 3) bytes, padded with '='. */
static void write_group(struct fv_writer *w, const unsigned char *bytes, int count)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned bits = (unsigned)bytes[0] << 16;
    if (count > 1) bits |= (unsigned)bytes[1] << 8;
    if (count > 2) bits |= bytes[2];
    char group[4];
    for (int i = 0; i < 4; i++) group[i] = i <= count ? letters[bits >> (18 - 6 * i) & 63] : '=';
    fv_writer_bytes(w, group, sizeof group);
}

void fv_writer_base64(struct fv_writer *w, struct fv_base64 *state, const void *bytes, size_t size)
{
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; i++) {
        state->carry[state->carried++] = at[i];
        if (state->carried < 3) continue;
        write_group(w, state->carry, 3);
        state->carried = 0;
    }
}

void fv_writer_base64_end(struct fv_writer *w, struct fv_base64 *state)
{
    if (state->carried) write_group(w, state->carry, state->carried);
    state->carried = 0;
}

int fv_writer_close(struct fv_writer *w, struct fv_error *error)
{
    fv_writer_flush(w);
    if (to_standard_output(w))
        return w->failed ? fv_error_set(error, "standard output: %s", strerror(w->failed)) : 0;
    char temporary[FV_PATH_MAX + 8];
    snprintf(temporary, sizeof temporary, "%s.part", w->path);
    if (close(w->fd) != 0 && !w->failed) w->failed = errno;
    if (!w->failed && rename(temporary, w->path) != 0) w->failed = errno;
    if (w->failed) {
        unlink(temporary);
        return fv_error_set(error, "%s: cannot be written: %s", w->path, strerror(w->failed));
    }
    return 0;
}

int fv_writer_close_cut(struct fv_writer *w, struct fv_error *error)
{
    fv_writer_flush(w);
    int failed = w->failed;
    if (failed) w->failed = 0, w->used = 0;
    if (fv_writer_close(w, error)) return -1;
    return failed ? fv_error_set(error, "%s: not whole: %s", w->path, strerror(failed)) : 0;
}
