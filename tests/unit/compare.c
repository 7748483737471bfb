/* compare: the verb as its users meet it: kinds of files, its lines, options and bad input. */
#include "tests/support/program.h"

#include <math.h>
#include <png.h>
#include <turbojpeg.h>

enum { W = 40, H = 24 };

/* The pattern's red channel; green and blue are derived from it. */
static int pattern(int x, int y)
{
    return (x * 37 + y * 59 + x * y) % 200;
}

/* kind: a PNG colour type. 16-bit samples are the 8-bit ones times 257; a palette has 200 entries. */
static void write_picture(const char *name, int kind, int bits, int offset)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    FILE *f = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, f);
    png_set_IHDR(png, info, W, H, bits, kind, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_color palette[200];
    for (int i = 0; i < 200; i++)
        palette[i] = (png_color){(png_byte)(i + offset), (png_byte)(i + offset), (png_byte)(i + offset)};
    if (kind == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 200);
    png_write_info(png, info);
    int channels = kind == PNG_COLOR_TYPE_PALETTE ? 1 : (kind & 2 ? 3 : 1) + (kind & 4 ? 1 : 0);
    for (int y = 0; y < H; y++) {
        png_byte row[W * 8];
        int at = 0;
        for (int x = 0; x < W; x++)
            for (int k = 0; k < channels; k++) {
                int alpha = (kind & 4) && k == channels - 1;
                int value =
                    alpha ? (x * 5) % 256 : pattern(x, y) + (kind == PNG_COLOR_TYPE_PALETTE ? 0 : offset);
                for (int b = 0; b < bits; b += 8) row[at++] = (png_byte)value;
            }
        png_write_row(png, row);
    }
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    fclose(f);
}

static void write_jpeg(const char *name, int subsampling)
{
    static uint8_t pixels[3 * W * H];
    unsigned char *bytes = NULL;
    unsigned long size = 0;
    for (int i = 0; i < 3 * W * H; i++) pixels[i] = (uint8_t)pattern(i / 3 % W, i / 3 / W);
    tjhandle jpeg = tjInitCompress();
    assert_int_equal(tjCompress2(jpeg, pixels, W, 3 * W, H, TJPF_RGB, &bytes, &size, subsampling, 100, 0), 0);
    program_write(name, bytes, size);
    tjFree(bytes);
    tjDestroy(jpeg);
}

static double value_of(const char *output, const char *name)
{
    char line[64];
    snprintf(line, sizeof line, "\n%s ", name);
    const char *at = strncmp(output, line + 1, strlen(line + 1)) == 0 ? output : strstr(output, line);
    if (!at) fail_msg("no line %s in: %s", name, output);
    return strtod(strchr(at + 1, ' '), NULL);
}

static int make_pictures(void **state)
{
    (void)state;
    write_picture("rgb.png", PNG_COLOR_TYPE_RGB, 8, 0);
    write_picture("grey.png", PNG_COLOR_TYPE_GRAY, 8, 0);
    write_picture("grey-alpha.png", PNG_COLOR_TYPE_GRAY_ALPHA, 8, 0);
    write_picture("rgba.png", PNG_COLOR_TYPE_RGB_ALPHA, 8, 0);
    write_picture("palette.png", PNG_COLOR_TYPE_PALETTE, 8, 0);
    write_picture("rgb16.png", PNG_COLOR_TYPE_RGB, 16, 0);
    write_picture("grey16.png", PNG_COLOR_TYPE_GRAY, 16, 0);
    write_jpeg("colour.jpg", TJSAMP_444);
    write_jpeg("grey.jpg", TJSAMP_GRAY);
    write_picture("off.png", PNG_COLOR_TYPE_RGB, 8, 17);
    return 0;
}

static void every_kind_of_png(void **state)
{
    static const char *const kinds[] = {"rgb", "grey", "grey-alpha", "rgba", "palette", "rgb16", "grey16"};
    (void)state;
    for (unsigned i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        struct program_result r = program("compare rgb.png %s.png", kinds[i]);
        if (r.code) fail_msg("%s: exit %d: %s", kinds[i], r.code, r.errors);
        assert_string_equal(r.errors, "");
        assert_true(strncmp(r.output, "psnr_all inf\n", 13) == 0);
        assert_true(value_of(r.output, "rmse") == 0 && value_of(r.output, "ssim") == 1 &&
                    value_of(r.output, "flip") == 0);
        r = program("compare %s.png off.png", kinds[i]);
        assert_true(fabs(value_of(r.output, "psnr_all") - 20 * log10(255.0 / 17)) < 1e-5);
        assert_true(value_of(r.output, "flip") > 0.01);
    }
}

static void jpegs_too(void **state)
{
    static const char *const names[] = {"colour.jpg", "grey.jpg"};
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct program_result r = program("compare rgb.png %s", names[i]);
        if (r.code) fail_msg("%s: exit %d: %s", names[i], r.code, r.errors);
        assert_true(value_of(r.output, "psnr_all") > 45 && value_of(r.output, "ssim") > 0.999);
    }
}

static void its_lines(void **state)
{
    static const char *const names[] = {"psnr_all",  "psnr_fovea", "psnr_para", "psnr_peri", "psnr_near",
                                        "psnr_far",  "rmse",       "ssim",      "flip",      "rmse_fovea",
                                        "rmse_para", "rmse_peri",  "rmse_near", "rmse_far",  "ssim_fovea",
                                        "ssim_para", "ssim_peri",  "ssim_near", "ssim_far",  "flip_fovea",
                                        "flip_para", "flip_peri",  "flip_near", "flip_far"};
    (void)state;
    struct program_result r = program("compare rgb.png off.png --fov 120 --gaze=20,12 --ppd 5");
    const char *at = r.output;
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++) {
        size_t length = strlen(names[i]);
        char *end;
        if (strncmp(at, names[i], length) != 0 || at[length] != ' ')
            fail_msg("%s must follow at: %s", names[i], at);
        strtod(at + length + 1, &end);
        assert_true(*end == '\n');
        at = end + 1;
    }
    assert_true(*at == 0);
}

static void options_move_the_zones(void **state)
{
    (void)state;
    /* At 67 pixels a degree all of it is the fovea; at a field of view of 120 degrees it reaches the far
     * zone. */
    struct program_result r = program("compare rgb.png off.png");
    assert_true(value_of(r.output, "psnr_fovea") == value_of(r.output, "psnr_all"));
    assert_true(isnan(value_of(r.output, "psnr_para")) && strstr(r.output, "psnr_far nan\n"));
    r = program("compare rgb.png off.png --fov 120");
    assert_true(isfinite(value_of(r.output, "psnr_far")) && isfinite(value_of(r.output, "psnr_near")));
    /* Far outside of the picture. */
    r = program("compare rgb.png off.png --fov 120 --gaze 1e6,-1e6");
    assert_true(isnan(value_of(r.output, "psnr_fovea")) && isfinite(value_of(r.output, "psnr_far")));
    /* The focal length follows from ppd: 40 pixels at 4 a degree reach 5 degrees to each side. */
    r = program("compare rgb.png off.png --ppd 4");
    assert_true(isfinite(value_of(r.output, "psnr_para")) && isfinite(value_of(r.output, "psnr_peri")));
    assert_true(isnan(value_of(r.output, "psnr_near")));
}

static const struct {
    const char *arguments, *message;
} bad[] = {
    {"compare", "name two pictures"},
    {"compare rgb.png", "name two pictures"},
    {"compare rgb.png off.png rgba.png", "'rgba.png': not expected here"},
    {"compare missing.png off.png", "missing.png: No such file"},
    {"compare rgb.png missing.png", "missing.png: No such file"},
    {"compare rgb.png text.png", "text.png: neither PNG nor JPEG"},
    {"compare empty.png rgb.png", "empty.png: neither PNG nor JPEG"},
    {"compare cut.png rgb.png", "cut.png: damaged PNG"},
    {"compare rgb.png .", "."},
    {"compare rgb.png small.png", "small.png: 1 x 1 pixels, must be 40 x 24 as rgb.png is"},
    {"compare rgb.png off.png --ppd 0", "--ppd 0: must be a number of pixels per degree from 1 to 1000"},
    {"compare rgb.png off.png --ppd nan", "--ppd nan"},
    {"compare rgb.png off.png --ppd 12x", "--ppd 12x"},
    {"compare rgb.png off.png --ppd", "--ppd: a value must follow"},
    {"compare rgb.png off.png --fov 180", "--fov 180: must be a number of degrees"},
    {"compare rgb.png off.png --fov -10", "--fov -10"},
    {"compare rgb.png off.png --fov=", "--fov :"},
    {"compare rgb.png off.png --gaze 3", "--gaze 3: must be two numbers of pixels"},
    {"compare rgb.png off.png --gaze 3,", "--gaze 3,:"},
    {"compare rgb.png off.png --gaze 3,4,5", "--gaze 3,4,5"},
    {"compare rgb.png off.png --gaze inf,4", "--gaze inf,4"},
    {"compare rgb.png off.png --frames 3", "no such option"},
    {"run --ppd 3", "no such option"},
};

static void bad_input_ends_with_2_and_one_line(void **state)
{
    /* The 68 bytes of a PNG of one grey pixel. */
    static const uint8_t small[] =
        "\211PNG\r\n\032\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\b\0\0\0\0\x3a\x7e\x9b\x55\0\0\0\nIDAT"
        "\x78\x9c\x63\x60\0\0\0\2\0\1\x48\xaf\xa4\x71\0\0\0\0IEND\xae\x42\x60\x82";
    (void)state;
    program_write("small.png", small, sizeof small - 1);
    program_write("cut.png", small, 40);
    program_write("text.png", "not a picture at all", 20);
    program_write("empty.png", "", 0);
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct program_result r = program("%s", bad[i].arguments);
        if (r.code != 2) fail_msg("%s: exit %d: %s", bad[i].arguments, r.code, r.errors);
        if (!strstr(r.errors, bad[i].message))
            fail_msg("%s: '%s' does not hold '%s'", bad[i].arguments, r.errors, bad[i].message);
        char *end = strchr(r.errors, '\n');
        if (!end || end[1]) fail_msg("%s: not one line: %s", bad[i].arguments, r.errors);
        assert_string_equal(r.output, "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_png),
        cmocka_unit_test(jpegs_too),
        cmocka_unit_test(its_lines),
        cmocka_unit_test(options_move_the_zones),
        cmocka_unit_test(bad_input_ends_with_2_and_one_line),
    };
    return cmocka_run_group_tests(tests, make_pictures, program_clean);
}
