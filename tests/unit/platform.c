/* platform: arena, heap, files, workers, poses. */
#include "platform/arena.h"
#include "platform/cpu.h"
#include "platform/files.h"
#include "platform/heap.h"
#include "platform/pose.h"
#include "platform/threads.h"
#include "tests/support/program.h"

#include <math.h>
#include <stdatomic.h>
#include <unistd.h>

static void arena_books_by_name(void **state)
{
    (void)state;
    struct fv_arena *a = fv_arena();
    size_t before = a->used;
    char *p = fv_arena_take(a, "test block", 1000, 256), *q = fv_arena_take(a, "test block", 8, 64);
    assert_int_equal((uintptr_t)p % 256, 0);
    assert_int_equal((uintptr_t)q % 64, 0);
    assert_true(q >= p + 1000);
    for (int i = 0; i < 1000; i++) assert_int_equal(p[i], 0);
    size_t booked = 0;
    for (int i = 0; i < a->rows; i++)
        if (strcmp(a->row[i].name, "test block") == 0) booked = a->row[i].bytes;
    assert_int_equal(booked, a->used - before);
    assert_null(fv_arena_try(a, "test block", a->capacity, 16));
}

/* A torrent of sizes and alignments: blocks never overlap, contents stay, all can be given back. */
static void heap_keeps_blocks_apart(void **state)
{
    (void)state;
    enum { SLOTS = 400, STEPS = 60000 };
    static unsigned char *block[SLOTS];
    static size_t size[SLOTS];
    uint32_t r = 1;
    for (int step = 0; step < STEPS; step++) {
        r = r * 1664525u + 1013904223u;
        int slot = (int)(r >> 8) % SLOTS;
        size_t n = (size_t)1 << (r >> 28);
        n += r >> 12 & (n - 1);
        if (block[slot])
            for (size_t i = 0; i < size[slot]; i += 97) assert_int_equal(block[slot][i], slot & 255);
        if (block[slot] && (r & 64)) {
            block[slot] = realloc(block[slot], n);
        } else {
            free(block[slot]);
            size_t align = (size_t)16 << (r >> 5 & 7);
            void *p = NULL;
            if (r & 16) assert_int_equal(posix_memalign(&p, align, n), 0);
            else p = malloc(n), align = 16;
            assert_int_equal((uintptr_t)p % align, 0);
            block[slot] = p;
        }
        assert_non_null(block[slot]);
        size[slot] = n;
        memset(block[slot], slot, n);
    }
    for (int i = 0; i < SLOTS; i++) free(block[i]);
    unsigned char *zero = calloc(1000, 3);
    for (int i = 0; i < 3000; i++) assert_int_equal(zero[i], 0);
    free(zero);
#ifdef FV_HEAP
    /* Through pointers that the compiler cannot see through, or it assumes that these succeed. */
    void *(*volatile take)(size_t) = malloc, *(*volatile take_zeroed)(size_t, size_t) = calloc;
    volatile size_t huge = SIZE_MAX / 2;
    assert_null(take_zeroed(huge, 4));
    assert_null(take(huge));
#endif
}

static void files_are_whole_or_absent(void **state)
{
    (void)state;
    static struct fv_writer w;
    struct fv_error error;
    char path[256], missing[256], *bytes;
    size_t size;
    snprintf(path, sizeof path, "%s/file", program_folder());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    for (int i = 0; i < 30000; i++) fv_writer_print(&w, "%d\n", i);
    assert_false(fv_file_exists(path));
    assert_int_equal(fv_writer_close(&w, &error), 0);
    assert_int_equal(fv_file_read(path, 1 << 20, &bytes, &size, &error), 0);
    assert_int_equal(size, 168890);
    assert_string_equal(bytes + size - 6, "29999\n");
    free(bytes);
    assert_int_equal(fv_file_read(path, 1000, &bytes, &size, &error), -1);
    assert_non_null(strstr(error.text, "more than the 1000 allowed"));
    snprintf(missing, sizeof missing, "%s/no/such", program_folder());
    assert_int_equal(fv_file_read(missing, 1000, &bytes, &size, &error), -1);
    assert_int_equal(fv_writer_open(&w, missing, &error), -1);
    assert_int_equal(fv_folder_make("/proc/no", &error), -1);
    assert_int_equal(fv_folder_make(path, &error), -1);
    assert_non_null(strstr(error.text, "not a folder"));
}

static void full_disk_is_an_error_not_a_file(void **state)
{
    (void)state;
    static struct fv_writer w;
    struct fv_error error;
    char path[256], part[300];
    snprintf(path, sizeof path, "%s/full", program_folder());
    snprintf(part, sizeof part, "%s.part", path);
    assert_int_equal(symlink("/dev/full", part), 0);
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    for (int i = 0; i < 30000; i++) fv_writer_print(&w, "%d\n", i);
    assert_int_equal(fv_writer_close(&w, &error), -1);
    assert_non_null(strstr(error.text, "No space left"));
    assert_false(fv_file_exists(path));
}

struct tally {
    atomic_int seen[5000];
    atomic_int by_worker[4];
};

static void count_tile(void *context, int tile, int worker)
{
    struct tally *t = context;
    atomic_fetch_add(&t->seen[tile], 1);
    atomic_fetch_add(&t->by_worker[worker], 1);
}

static void every_tile_once(void **state)
{
    (void)state;
    static struct fv_workers w;
    static struct tally t;
    assert_int_equal(fv_workers_start(&w, 4), 4);
    for (int run = 1; run <= 200; run++) {
        int tiles = run % 2 ? 5000 : run % 7;
        fv_workers_run(&w, tiles, count_tile, &t);
    }
    int from_odd = 100;
    for (int i = 10; i < 5000; i++) assert_int_equal(atomic_load(&t.seen[i]), from_odd);
    fv_workers_stop(&w);
}

static void rotations(void **state)
{
    (void)state;
    static const double vectors[][3] = {{0, 0, 0}, {1e-300, 0, 0}, {1e-9, -2e-9, 3e-9}, {0.1, 0.2, 0.3},
                                        {3.1415926, 0, 0}, {0, 3, 0.5}, {-1, 2, -2}};
    for (unsigned i = 0; i < sizeof vectors / sizeof vectors[0]; i++) {
        double q[4], back[3];
        fv_quat_from_vector(vectors[i], q);
        fv_quat_to_vector(q, back);
        double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        assert_true(fabs(n - 1) < 1e-15);
        for (int k = 0; k < 3; k++) assert_true(fabs(back[k] - vectors[i][k]) < 1e-12 * (1 + fabs(vectors[i][k])));
    }
    double up[4], v[3] = {0, 0, -1};
    fv_quat_from_yaw_pitch_roll(M_PI / 2, 0, 0, up); /* to the left: -z becomes -x */
    fv_quat_rotate(up, v, v);
    assert_true(fabs(v[0] + 1) < 1e-15 && fabs(v[2]) < 1e-15);
    double nan_q[4] = {NAN, 0, 0, 0}, zero_q[4] = {0, 0, 0, 0};
    fv_quat_normalise(nan_q);
    fv_quat_normalise(zero_q);
    assert_true(nan_q[0] == 1 && zero_q[0] == 1);
    double a[4], b[4], half[4], same[4];
    fv_quat_from_vector(vectors[3], a);
    fv_quat_from_vector(vectors[5], b);
    fv_quat_slerp(a, b, 0, half);
    for (int k = 0; k < 4; k++) assert_true(fabs(half[k] - a[k]) < 1e-15);
    double minus[4] = {-a[0], -a[1], -a[2], -a[3]};
    fv_quat_slerp(a, minus, 0.5, same); /* the same rotation: nothing between */
    for (int k = 0; k < 4; k++) assert_true(fabs(fabs(same[k]) - fabs(a[k])) < 1e-12);
}

static void names_of_cores(void **state)
{
    (void)state;
#define CORE(part) "processor\t: 0\nBogoMIPS\t: 48.00\nCPU implementer\t: 0x41\nCPU architecture: 8\nCPU part\t: " part "\nCPU revision\t: 0\n\n"
    static const struct {
        const char *text, *name;
    } cases[] = {
        {"processor\t: 0\nmodel\t\t: 17\nmodel name\t: AMD EPYC 9R14\nflags\t\t: fpu\n", "AMD EPYC 9R14"},
        {CORE("0xd05") CORE("0xd05") CORE("0xd0b") CORE("0xd0b"), "Cortex-A55, Cortex-A76"},
        {CORE("0xd42") CORE("0xd41") CORE("0xd42"), "Cortex-A78AE, Cortex-A78"}, /* no name is taken for part of another */
        {"CPU implementer\t: 0x61\nCPU part\t: 0x022\n", "core 61:022"},
        {"CPU part\t:", "core 00:000"},
        {"Hardware\t: board\n", "unknown"},
        {"", "unknown"},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char name[64];
        fv_cpu_name_in(cases[i].text, name, sizeof name);
        assert_string_equal(name, cases[i].name);
        fv_cpu_name_in(cases[i].text, name, 8);
        assert_true(strlen(name) < 8 && strncmp(name, cases[i].name, strlen(name)) == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arena_books_by_name),   cmocka_unit_test(heap_keeps_blocks_apart),
        cmocka_unit_test(files_are_whole_or_absent), cmocka_unit_test(full_disk_is_an_error_not_a_file),
        cmocka_unit_test(every_tile_once),       cmocka_unit_test(rotations),
        cmocka_unit_test(names_of_cores),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
