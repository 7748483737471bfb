/* kms_copy: a frame's pictures into a display's buffer (conversion to XRGB8888 on the way) against memcpy of the same
 * rows, by turns in one process, by thread CPU time. Memory here is cached; a display's is write-combined, where the
 * stores alone count. The ratio must stay below 1.25. */
#include "display/kms.h"
#include "platform/clock.h"
#include "tests/support/program.h"

enum { WIDTH = 1182, HEIGHT = 1464, ROUNDS = 41 };
static const size_t from_stride = 4 * 1184, to_stride = 4 * 2 * 1184;
static const double limit = 1.25;
static uint8_t *from, *to;

static void convert(int eye)
{
    fv_kms_copy(to + eye * 4 * WIDTH, to_stride, from, from_stride, WIDTH, HEIGHT);
}

static void move(int eye)
{
    for (int y = 0; y < HEIGHT; y++)
        memcpy(to + eye * 4 * WIDTH + (size_t)y * to_stride, from + (size_t)y * from_stride, 4 * WIDTH);
}

static double time_ns(void (*copy)(int eye))
{
    int64_t begun_ns = fv_clock_thread_ns();
    copy(0), copy(1);
    return (double)(fv_clock_thread_ns() - begun_ns);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void ratio(void **state)
{
    (void)state;
    double ours[ROUNDS], theirs[ROUNDS], ratios[ROUNDS], bytes = 2.0 * 4 * WIDTH * HEIGHT;
    from = malloc(from_stride * HEIGHT), to = malloc(to_stride * HEIGHT);
    memset(from, 7, from_stride * HEIGHT), memset(to, 9, to_stride * HEIGHT);
    for (int i = 0; i < ROUNDS; i++) {
        ours[i] = time_ns(convert);
        theirs[i] = time_ns(move);
        ratios[i] = ours[i] / theirs[i];
    }
    qsort(ours, ROUNDS, sizeof *ours, by_size), qsort(theirs, ROUNDS, sizeof *theirs, by_size);
    qsort(ratios, ROUNDS, sizeof *ratios, by_size);
    printf("a frame of 2 x %d x %d, %.1f MB: ours %.2f ms (%.1f GB/s), memcpy %.2f ms (%.1f GB/s), ratio %.2f (quartiles %.2f to %.2f)\n",
           WIDTH, HEIGHT, bytes * 1e-6, ours[ROUNDS / 2] * 1e-6, bytes / ours[ROUNDS / 2], theirs[ROUNDS / 2] * 1e-6,
           bytes / theirs[ROUNDS / 2], ratios[ROUNDS / 2], ratios[ROUNDS / 4], ratios[3 * ROUNDS / 4]);
    assert_true(ratios[ROUNDS / 2] < limit);
    free(from), free(to);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(ratio)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
