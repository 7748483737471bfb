/* files: whole files read into memory, and files written so that no half-written one is
 * ever seen: under a temporary name, renamed when complete. No stdio: nothing allocates. */
#ifndef FV_PLATFORM_FILES_H
#define FV_PLATFORM_FILES_H

#include "platform/error.h"

#include <stdbool.h>
#include <stddef.h>

enum { FV_PATH_MAX = 1024, FV_WRITER_BYTES = 1 << 16 };

/* Reads a regular file of at most `most` bytes with malloc (before the seal only); one zero
 * byte is put behind it. Errors name the path. */
int fv_file_read(const char *path, size_t most, char **bytes, size_t *size, struct fv_error *error);

bool fv_file_exists(const char *path);

/* Whether both are there and one folder. */
bool fv_same_folder(const char *a, const char *b);

/* Makes the folder, its parents too; 0 when it is there and can be written into. */
/* Removes what stands under this name in the folder, if anything does. */
void fv_file_remove(const char *folder, const char *name);

int fv_folder_make(const char *path, struct fv_error *error);

/* out = folder/name, or name where it is absolute or folder is empty; -1 when too long. */
int fv_path_join(char out[FV_PATH_MAX], const char *folder, const char *name);

/* The folder part of a path, "." where it has none. */
void fv_path_folder(char out[FV_PATH_MAX], const char *path);

/* A buffered writer. Errors stick: the first is reported by close, which then removes what
 * was written. Path "-" is standard output. */
struct fv_writer {
    int fd, failed; /* failed: errno of the first failure */
    size_t used;
    char path[FV_PATH_MAX];
    char buffer[FV_WRITER_BYTES];
};

int fv_writer_open(struct fv_writer *writer, const char *path, struct fv_error *error);
void fv_writer_bytes(struct fv_writer *writer, const void *bytes, size_t size);
void fv_writer_print(struct fv_writer *writer, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void fv_writer_flush(struct fv_writer *writer);

/* Base64 (RFC 4648, section 4) of bytes that come in any portions: start from a zeroed state, end once. */
struct fv_base64 {
    unsigned char carry[3]; /* bytes that wait for a full group of three */
    int carried;
};
void fv_writer_base64(struct fv_writer *writer, struct fv_base64 *state, const void *bytes, size_t size);
void fv_writer_base64_end(struct fv_writer *writer, struct fv_base64 *state);

int fv_writer_close(struct fv_writer *writer, struct fv_error *error);

/* The same of a file that is of use wherever it ends: one that could not be written whole keeps what fitted. -1 then too. */
int fv_writer_close_cut(struct fv_writer *writer, struct fv_error *error);

#endif
