/* y4m: the stream's header, sizes and colours, and how it ends. */
#include "display/display.h"
#include "platform/heap.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <signal.h>
#include <unistd.h>

#include <cmocka.h>

static char path[64];
static struct fv_error error;
static struct fv_config config;

enum { WIDTH = 37, HEIGHT = 16, PIXELS = WIDTH * HEIGHT };
static uint8_t pixels[2][PIXELS * 4];
static const struct fv_picture picture = {2, WIDTH, HEIGHT, WIDTH * 4, {pixels[0], pixels[1]}};

static void set_up_config(const char *file, double hz)
{
    config.display_eyes = 2;
    config.display_width = WIDTH;
    config.display_height = HEIGHT;
    config.budget_hz = hz;
    strcpy(config.display_sink, "y4m");
    strcpy(config.display_y4m_path, file);
}

static void header_names_size_rate_and_sampling(void **unused)
{
    (void)unused;
    static const struct {
        double hz;
        const char *rate;
    } rows[] = {{75, "F75:1"},        {59.94, "F2997:50"},       {60000.0 / 1001, "F60000:1001"},
                {1, "F1:1"},          {1000, "F1000:1"},         {72.5, "F145:2"},
                {89.999999, "F90:1"}, {M_PI, "F3141593:1000000"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct fv_display *display;
        char *text, expected[200];
        size_t size;
        set_up_config(path, rows[i].hz);
        assert_int_equal(fv_display_open(&display, &config, "", &error), 0);
        assert_int_equal(fv_display_close(display, &error), 0);
        assert_int_equal(fv_file_read(path, 1 << 20, &text, &size, &error), 0);
        snprintf(expected, sizeof expected,
                 "YUV4MPEG2 W74 H16 %s Ip A1:1 C444 XYSCSS=444 XCOLORRANGE=LIMITED\n", rows[i].rate);
        assert_string_equal(text, expected);
        free(text);
    }
}

/* ITU-R BT.709 in double. */
static void exact(const uint8_t *rgb, double out[3])
{
    double r = rgb[0] / 255.0, g = rgb[1] / 255.0, b = rgb[2] / 255.0;
    double y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    out[0] = 16 + 219 * y;
    out[1] = 128 + 224 * (b - y) / 1.8556;
    out[2] = 128 + 224 * (r - y) / 1.5748;
}

/* Every colour of a grid that holds the primaries and all greys, in rounds of one frame. */
static void colours_are_bt709(void **unused)
{
    (void)unused;
    struct fv_display *display;
    size_t size, colours = 256 + 18 * 18 * 18, next = 0;
    char *bytes;
    set_up_config(path, 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), 0);
    uint8_t *colour = malloc(colours * 3 + 6 * PIXELS);
    for (size_t i = 0; i < colours + 2 * PIXELS; i++) {
        size_t k = i < 256 ? 0 : (i - 256) % (18 * 18 * 18);
        uint8_t rgb[3] = {(uint8_t)(k % 18 * 15), (uint8_t)(k / 18 % 18 * 15), (uint8_t)(k / 324 * 15)};
        if (i < 256) memset(rgb, (int)i, 3);
        memcpy(colour + 3 * i, rgb, 3);
    }
    int frames = 0;
    for (; next < colours; frames++) {
        for (int i = 0; i < 2 * PIXELS; i++) {
            uint8_t *out = pixels[i / PIXELS] + 4 * (i % PIXELS);
            memcpy(out, colour + 3 * next++, 3);
            out[3] = (uint8_t)i;
        }
        assert_int_equal(fv_display_present(display, &picture, frames, &error), 0);
    }
    assert_int_equal(fv_display_close(display, &error), 0);
    assert_int_equal(fv_file_read(path, 1 << 24, &bytes, &size, &error), 0);
    size_t header = (size_t)(strchr(bytes, '\n') + 1 - bytes), plane = 2 * PIXELS, frame = 6 + 3 * plane;
    assert_int_equal(size, header + (size_t)frames * frame);
    double worst = 0;
    for (int f = 0; f < frames; f++) {
        const char *at = bytes + header + (size_t)f * frame;
        assert_memory_equal(at, "FRAME\n", 6);
        for (int i = 0; i < 2 * PIXELS; i++) {
            int eye = i / PIXELS, x = i % WIDTH, y = i % PIXELS / WIDTH;
            const uint8_t *rgb = colour + 3 * ((size_t)f * 2 * PIXELS + (size_t)i);
            const uint8_t *yuv = (const uint8_t *)at + 6 + y * 2 * WIDTH + eye * WIDTH + x;
            double expected[3];
            exact(rgb, expected);
            for (size_t c = 0; c < 3; c++) worst = fmax(worst, fabs(yuv[c * plane] - expected[c]));
            if (rgb[0] == rgb[1] && rgb[1] == rgb[2]) {
                assert_int_equal(yuv[plane], 128);
                assert_int_equal(yuv[2 * plane], 128);
            }
        }
    }
    assert_true(worst < 0.6);
    free(colour);
    free(bytes);
}

static void closed_pipe_ends_the_stream(void **unused)
{
    (void)unused;
    char fifo[80];
    struct fv_display *display;
    snprintf(fifo, sizeof fifo, "%s.fifo", path);
    assert_int_equal(mkfifo(fifo, 0600), 0);
    int reader = open(fifo, O_RDONLY | O_NONBLOCK);
    assert_true(reader >= 0);
    set_up_config(fifo, 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), 0);
    assert_int_equal(fv_display_present(display, &picture, 0, &error), 0);
    assert_true(fv_display_wants(display, 1, false));
    close(reader);
    assert_int_equal(fv_display_present(display, &picture, 1, &error), -1);
    assert_non_null(strstr(error.text, "closed the pipe"));
    assert_false(fv_display_wants(display, 2, true));
    assert_int_equal(fv_display_present(display, &picture, 2, &error), -1);
    assert_int_equal(fv_display_close(display, &error), 0);
    unlink(fifo);
}

/* A limit on file sizes is a full disk: the file must end with its last whole frame. */
static void full_disk_leaves_whole_frames(void **unused)
{
    (void)unused;
    struct fv_display *display;
    struct rlimit before, limit;
    struct stat status;
    const size_t frame = 6 + 6 * PIXELS;
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before);
    limit = before;
    limit.rlim_cur = 5 * frame / 2;
    set_up_config(path, 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), 0);
    assert_int_equal(stat(path, &status), 0);
    off_t header = status.st_size;
    setrlimit(RLIMIT_FSIZE, &limit);
    int stored = 0;
    while (stored < 10 && fv_display_present(display, &picture, stored, &error) == 0) stored++;
    setrlimit(RLIMIT_FSIZE, &before);
    assert_int_equal(stored, 2);
    assert_non_null(strstr(error.text, "File too large"));
    assert_int_equal(fv_display_close(display, &error), 0);
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_size, header + 2 * (off_t)frame);
    if (access("/dev/full", W_OK) != 0) return;
    set_up_config("/dev/full", 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), -1);
    assert_non_null(strstr(error.text, "No space left"));
}

static void unusable_files_are_named(void **unused)
{
    (void)unused;
    struct fv_display *display;
    set_up_config("/tmp", 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), -1);
    assert_non_null(strstr(error.text, "display.y4m_path: /tmp"));
    set_up_config("/nowhere/at/all.y4m", 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), -1);
    assert_non_null(strstr(error.text, "/nowhere/at/all.y4m"));
}

static void presenting_allocates_nothing(void **unused)
{
    (void)unused;
    struct fv_display *display;
    set_up_config(path, 75);
    assert_int_equal(fv_display_open(&display, &config, "", &error), 0);
    int64_t before = fv_heap_calls() + fv_heap_system_calls();
#ifdef FV_HEAP
    void *volatile taken = malloc(1);
    free(taken);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before + 2); /* calls are counted */
    before += 2;
#endif
    assert_int_equal(fv_display_present(display, &picture, 0, &error), 0);
    assert_int_equal(fv_display_close(display, &error), 0);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(header_names_size_rate_and_sampling),
        cmocka_unit_test(colours_are_bt709),
        cmocka_unit_test(closed_pipe_ends_the_stream),
        cmocka_unit_test(full_disk_leaves_whole_frames),
        cmocka_unit_test(unusable_files_are_named),
        cmocka_unit_test(presenting_allocates_nothing),
    };
    snprintf(path, sizeof path, "/tmp/foveola-y4m-XXXXXX");
    int fd = mkstemp(path);
    if (fd < 0) return 1;
    close(fd);
    fv_heap_seal(false);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
