/* png: what the sink writes reads back as the same pixels; errors end it with a value. */
#include "display/display.h"
#include "platform/heap.h"
#include "tests/support/random.h"

#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64];
static struct fv_error error;
static struct fv_config config;
static struct fv_writer writer;

static void set_up_config(int eyes, int width, int height, int every)
{
    config.display_eyes = eyes;
    config.display_width = width;
    config.display_height = height;
    config.output_every = every;
    strcpy(config.display_sink, "png");
}

/* Deterministic noise on a ramp, rows padded by 12 bytes; the fourth byte must not matter. */
static struct fv_picture make_picture(int eyes, int width, int height)
{
    struct fv_picture p = {.eyes = eyes, .width = width, .height = height, .stride_bytes = 4 * width + 12};
    uint64_t state = 12345;
    for (int eye = 0; eye < eyes; eye++) {
        uint8_t *pixels = malloc((size_t)p.stride_bytes * (size_t)height);
        for (int64_t i = 0; i < p.stride_bytes * height; i++)
            pixels[i] = (uint8_t)((random_bits(&state) & 15) + (uint64_t)i / 64);
        p.pixels[eye] = pixels;
    }
    return p;
}

static void free_picture(struct fv_picture *p)
{
    for (int eye = 0; eye < p->eyes; eye++) free((void *)(uintptr_t)p->pixels[eye]);
}

static void assert_same_pixels(png_image *image, const struct fv_picture *p, int eye)
{
    assert_int_equal(image->width, p->width);
    assert_int_equal(image->height, p->height);
    image->format = PNG_FORMAT_RGB;
    uint8_t *read = malloc(PNG_IMAGE_SIZE(*image));
    assert_true(png_image_finish_read(image, NULL, read, 0, NULL));
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++)
            assert_memory_equal(read + 3 * (y * p->width + x), p->pixels[eye] + y * p->stride_bytes + 4 * x,
                                3);
    free(read);
}

static void assert_file_holds(const char *name, const struct fv_picture *p, int eye)
{
    char path[FV_PATH_MAX];
    png_image image = {.version = PNG_IMAGE_VERSION};
    fv_path_join(path, folder, name);
    assert_true(png_image_begin_read_from_file(&image, path));
    assert_same_pixels(&image, p, eye);
}

static void pictures_read_back_the_same(void **unused)
{
    (void)unused;
    static const struct {
        int eyes, width, height;
    } rows[] = {{2, 16, 16}, {1, 16, 16}, {2, 1182, 64}, {2, 17, 301}, {1, 8192, 16}, {2, 3000, 20}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct fv_display *display;
        struct fv_picture p = make_picture(rows[i].eyes, rows[i].width, rows[i].height);
        set_up_config(p.eyes, p.width, p.height, 1);
        assert_int_equal(fv_display_open(&display, &config, folder, &error), 0);
        for (int frame = 0; frame < 3; frame++)
            assert_int_equal(fv_display_present(display, &p, frame, &error), 0);
        assert_int_equal(fv_display_present(display, &p, 1234567, &error), 0);
        assert_int_equal(fv_display_close(display, &error), 0);
        assert_file_holds("left-00000.png", &p, 0);
        assert_file_holds("left-1234567.png", &p, 0);
        if (p.eyes == 2) assert_file_holds("right-00002.png", &p, 1);
        free_picture(&p);
    }
}

static void every_level_reads_back_and_compresses(void **unused)
{
    (void)unused;
    struct fv_picture p = make_picture(1, 640, 200);
    struct fv_png *png = fv_png_open(640, 200);
    char path[FV_PATH_MAX];
    fv_path_join(path, folder, "level.png");
    for (int level = 0; level <= 9; level++) {
        assert_int_equal(fv_png_write(png, path, &p, 0, level, &error), 0);
        assert_file_holds("level.png", &p, 0);
        struct stat status;
        assert_int_equal(stat(path, &status), 0);
        if (level == 0) assert_true(status.st_size > 640 * 200 * 3);
        else assert_true(status.st_size < 640 * 200 * 3 * 8 / 10);
    }
    free_picture(&p);
}

static void writing_allocates_nothing(void **unused)
{
    (void)unused;
    struct fv_picture p = make_picture(1, 500, 100);
    struct fv_png *png = fv_png_open(500, 100);
    char path[FV_PATH_MAX];
    fv_path_join(path, folder, "sealed.png");
    int64_t before = fv_heap_calls() + fv_heap_system_calls();
#ifdef FV_HEAP
    void *volatile taken = malloc(1);
    free(taken);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before + 2); /* calls are counted */
    before += 2;
#endif
    assert_int_equal(fv_png_write(png, path, &p, 0, 1, &error), 0);
    assert_int_equal(fv_png_write(png, path, &p, 0, 9, &error), 0);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before);
    free_picture(&p);
}

static int letter_value(char c)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c ? strchr(letters, c) : NULL;
    return at ? (int)(at - letters) : -1;
}

static void base64_reads_back(void **unused)
{
    (void)unused;
    /* Sizes that end a PNG on each of the three remainders. */
    bool padded[3] = {false, false, false};
    char path[FV_PATH_MAX];
    fv_path_join(path, folder, "base64.txt");
    for (int width = 16; width < 64; width++) {
        struct fv_picture p = make_picture(1, width, 9);
        struct fv_png *png = fv_png_open(width, 9);
        assert_int_equal(fv_writer_open(&writer, path, &error), 0);
        assert_int_equal(fv_png_base64(png, &writer, &p, 0, 6, &error), 0);
        assert_int_equal(fv_writer_close(&writer, &error), 0);
        char *text;
        size_t length, decoded = 0;
        assert_int_equal(fv_file_read(path, 1 << 20, &text, &length, &error), 0);
        assert_int_equal(length % 4, 0);
        int padding = (text[length - 1] == '=') + (text[length - 2] == '=');
        padded[padding] = true;
        uint8_t *bytes = malloc(length);
        for (size_t i = 0; i < length; i += 4) {
            uint32_t bits = 0;
            for (size_t k = 0; k < 4; k++) {
                int value = letter_value(text[i + k]);
                assert_true(value >= 0 || i + k >= length - (size_t)padding);
                bits = bits << 6 | (uint32_t)(value < 0 ? 0 : value);
            }
            for (int k = 2; k >= 0; k--) bytes[decoded++] = (uint8_t)(bits >> 8 * k);
        }
        png_image image = {.version = PNG_IMAGE_VERSION};
        assert_true(png_image_begin_read_from_memory(&image, bytes, decoded - (size_t)padding));
        assert_same_pixels(&image, &p, 0);
        free(bytes);
        free(text);
        free_picture(&p);
    }
    assert_true(padded[0] && padded[1] && padded[2]);
}

static void takes_every_nth_and_the_last(void **unused)
{
    (void)unused;
    struct fv_display *display;
    set_up_config(2, 16, 16, 4);
    assert_int_equal(fv_display_open(&display, &config, folder, &error), 0);
    static const struct {
        int64_t frame;
        bool last, wanted;
    } rows[] = {{0, false, true}, {1, false, false}, {3, true, true}, {4, false, true}, {7, false, false}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_int_equal(fv_display_wants(display, rows[i].frame, rows[i].last), rows[i].wanted);
    strcpy(config.display_sink, "none");
    assert_int_equal(fv_display_open(&display, &config, folder, &error), 0);
    assert_false(fv_display_wants(display, 0, true));
    assert_int_equal(fv_display_close(display, &error), 0);
    strcpy(config.display_sink, "led");
    assert_int_equal(fv_display_open(&display, &config, folder, &error), -1);
    assert_non_null(strstr(error.text, "display.sink: 'led'"));
}

static void folder_gone_ends_the_sink(void **unused)
{
    (void)unused;
    char gone[128];
    struct fv_display *display;
    struct fv_picture p = make_picture(2, 16, 16);
    snprintf(gone, sizeof gone, "%s/gone", folder);
    set_up_config(2, 16, 16, 1);
    assert_int_equal(fv_display_open(&display, &config, gone, &error), 0);
    assert_true(fv_display_wants(display, 0, false));
    assert_int_equal(fv_display_present(display, &p, 0, &error), -1);
    assert_non_null(strstr(error.text, "gone/left-00000.png"));
    assert_false(fv_display_wants(display, 1, true));
    assert_int_equal(fv_display_present(display, &p, 1, &error), -1);
    assert_int_equal(fv_display_close(display, &error), 0);
    char endless[2000];
    memset(endless, 'a', sizeof endless - 1);
    endless[sizeof endless - 1] = 0;
    assert_int_equal(fv_display_open(&display, &config, endless, &error), -1);
    free_picture(&p);
}

static void disk_full_ends_the_sink(void **unused)
{
    (void)unused;
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: no /dev/full here\n");
        return;
    }
    /* The sink writes NAME.part: a link from there to a device that is always full. */
    char part[FV_PATH_MAX], path[FV_PATH_MAX];
    struct fv_display *display;
    struct fv_picture p = make_picture(2, 400, 300);
    fv_path_join(part, folder, "right-00777.png.part");
    fv_path_join(path, folder, "right-00777.png");
    assert_int_equal(symlink("/dev/full", part), 0);
    set_up_config(2, 400, 300, 1);
    assert_int_equal(fv_display_open(&display, &config, folder, &error), 0);
    assert_int_equal(fv_display_present(display, &p, 776, &error), 0);
    assert_int_equal(fv_display_present(display, &p, 777, &error), -1);
    assert_non_null(strstr(error.text, "No space left"));
    assert_false(fv_display_wants(display, 778, true));
    assert_false(fv_file_exists(path));
    assert_int_not_equal(access(part, F_OK), 0);
    assert_file_holds("left-00777.png", &p, 0);
    free_picture(&p);
}

static void pictures_that_do_not_fit_are_refused(void **unused)
{
    (void)unused;
    struct fv_picture p = make_picture(2, 64, 64);
    struct fv_png *png = fv_png_open(63, 64);
    struct fv_display *display;
    char path[FV_PATH_MAX];
    fv_path_join(path, folder, "refused.png");
    assert_int_equal(fv_png_write(png, path, &p, 0, 1, &error), -1);
    assert_non_null(strstr(error.text, "64 x 64"));
    assert_false(fv_file_exists(path));
    strcat(path, ".part");
    assert_false(fv_file_exists(path));
    set_up_config(2, 64, 32, 1);
    assert_int_equal(fv_display_open(&display, &config, folder, &error), 0);
    assert_int_equal(fv_display_present(display, &p, 0, &error), -1);
    free_picture(&p);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_read_back_the_same),
        cmocka_unit_test(every_level_reads_back_and_compresses),
        cmocka_unit_test(base64_reads_back),
        cmocka_unit_test(takes_every_nth_and_the_last),
        cmocka_unit_test(folder_gone_ends_the_sink),
        cmocka_unit_test(disk_full_ends_the_sink),
        cmocka_unit_test(pictures_that_do_not_fit_are_refused),
        cmocka_unit_test(writing_allocates_nothing),
    };
    snprintf(folder, sizeof folder, "/tmp/foveola-png-XXXXXX");
    if (!mkdtemp(folder)) return 1;
    fv_heap_seal(false);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[100];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return failed || system(command) != 0;
}
