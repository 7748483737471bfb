/* arena: all memory of the program, one static block carved by name at start-up.
 *
 * The block lies in .bss; its size is the build setting FV_ARENA_MB, and may be lowered
 * at run time (budget.memory_mb). Nothing is ever given back. The heap (heap.h) takes
 * its chunks from here too, under the name "heap". */
#ifndef FV_PLATFORM_ARENA_H
#define FV_PLATFORM_ARENA_H

#include <stdbool.h>
#include <stddef.h>

enum { FV_ARENA_NAMES_MAX = 64 };

struct fv_arena_row {
    const char *name; /* static string */
    size_t bytes;     /* sum of all takings under this name, padding included */
};

struct fv_arena {
    char *base;
    size_t built, capacity, used; /* bytes: of the block, of it what may be taken, what is taken */
    int rows;
    struct fv_arena_row row[FV_ARENA_NAMES_MAX];
};

/* The program's arena; ready before main. */
struct fv_arena *fv_arena(void);

/* Lowers the capacity; ignored where it would exceed the built size. bytes > 0. */
void fv_arena_limit(struct fv_arena *arena, size_t bytes);

/* Takes `bytes` zeroed bytes at an `align` boundary (a power of two), booked under `name`
 * (a static string). Too small: says who asked, for how much and the size to set, and
 * exits with code 2. */
void *fv_arena_take(struct fv_arena *arena, const char *name, size_t bytes, size_t align);

/* As fv_arena_take, but returns NULL when there is no room. Safe from several threads. */
void *fv_arena_try(struct fv_arena *arena, const char *name, size_t bytes, size_t align);

/* What was taken under `name`, 0 where nothing was. */
size_t fv_arena_bytes(const struct fv_arena *arena, const char *name);

/* Exits with code 2, saying that `name` wanted `bytes` more. */
void fv_arena_exhausted(const struct fv_arena *arena, const char *name, size_t bytes)
    __attribute__((noreturn));

#endif
