/* y4m: an uncompressed video stream that players and encoders read from a file or pipe.
 *
 * Pixels are 4:4:4, 8 bits, limited range. The header names sampling and range, but the format has
 * no word for the matrix: it is BT.709, which players assume for pictures of this size. */
#include "display/sink.h"
#include "platform/arena.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char marker[] = "FRAME\n";
enum { MARKER = sizeof marker - 1, HEADER_MAX = 160 };

struct y4m_sink {
    int fd;
    char path[FV_TEXT_MAX]; /* for messages */
    size_t plane, size;     /* bytes of one plane, and of a frame with its marker */
    uint8_t *frame;
};

/* BT.709 (ITU-R BT.709-6, item 3): luma 16 to 235, chroma 16 to 240. */
#define KR 0.2126
#define KB 0.0722
#define KG (1 - KR - KB)

/* Weights are in units of 2^-15. A component, times 128, times a weight, keeps 6 bits of fraction
 * above the upper half of the product: 16-bit lanes suffice, and the error before rounding is
 * below 0.06. */
#define WEIGHT(x) ((int16_t)((x)*32768 + ((x) < 0 ? -0.5 : 0.5)))
#define LUMA(k) WEIGHT((k)*219 / 255)
#define CHROMA(k, own) WEIGHT((k) / (2 * (1 - (own))) * 224 / 255)
#define TIMES(component, weight) ((int16_t)((int)(component) * (weight) >> 16))

static void convert_row(const uint8_t *restrict rgb, int width, uint8_t *restrict luma,
                        uint8_t *restrict blue, uint8_t *restrict red)
{
    for (int i = 0; i < width; i++) {
        uint32_t pixel; /* r in the lowest byte: one load of a word is what vectorises well */
        memcpy(&pixel, rgb + 4 * i, sizeof pixel);
        int16_t r = (int16_t)((pixel & 255) << 7), g = (int16_t)((pixel >> 8 & 255) << 7),
                b = (int16_t)((pixel >> 16 & 255) << 7);
        int16_t y = TIMES(r, LUMA(KR)) + TIMES(g, LUMA(KG)) + TIMES(b, LUMA(KB));
        int16_t cb = TIMES(r, CHROMA(-KR, KB)) + TIMES(g, CHROMA(-KG, KB)) + TIMES(b, CHROMA(1 - KB, KB));
        int16_t cr = TIMES(r, CHROMA(1 - KR, KR)) + TIMES(g, CHROMA(-KG, KR)) + TIMES(b, CHROMA(-KB, KR));
        luma[i] = (uint8_t)((int16_t)(y + 16 * 64 + 32) >> 6);
        blue[i] = (uint8_t)((int16_t)(cb + 128 * 64 + 32) >> 6);
        red[i] = (uint8_t)((int16_t)(cr + 128 * 64 + 32) >> 6);
    }
}

static long long gcd(long long a, long long b)
{
    while (b) {
        long long rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

/* The rate as a ratio: whole numbers and the 1000/1001 rates exactly, others to a millionth. */
static void rate_ratio(double hz, long long *numerator, long long *denominator)
{
    static const long long tried[] = {1, 1001, 1000, 1000000};
    for (int i = 0; i < 4; i++) {
        *denominator = tried[i];
        *numerator = llround(hz * (double)tried[i]);
        if (fabs((double)*numerator / (double)tried[i] - hz) < 1e-7 * hz) break;
    }
    long long common = gcd(*numerator, *denominator);
    *numerator /= common;
    *denominator /= common;
}

/* Writes it all; a full pipe is waited for, also where someone made it non-blocking. Returns errno. */
static int write_all(int fd, const void *bytes, size_t size)
{
    const char *at = bytes;
    while (size > 0) {
        ssize_t n = write(fd, at, size);
        if (n < 0 && errno == EAGAIN) {
            struct pollfd ready = {.fd = fd, .events = POLLOUT};
            poll(&ready, 1, -1);
        } else if (n < 0 && errno != EINTR) {
            return errno;
        } else if (n > 0) {
            at += n;
            size -= (size_t)n;
        }
    }
    return 0;
}

static int write_error(const struct y4m_sink *s, int number, struct fv_error *error)
{
    const char *name = s->fd == STDOUT_FILENO ? "standard output" : s->path;
    if (number == EPIPE)
        return fv_error_set(error, "%s: the reader has closed the pipe; the stream ends", name);
    return fv_error_set(error, "%s: cannot be written: %s; the stream ends", name, strerror(number));
}

static int open_stream(const struct fv_config *config, struct fv_error *error)
{
    if (strcmp(config->display_y4m_path, "-") == 0) {
        if (!isatty(STDOUT_FILENO)) return STDOUT_FILENO;
        return fv_config_error(error, "display.y4m_path",
                               "standard output is a terminal: name a file, or redirect it");
    }
    int fd = open(config->display_y4m_path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        fv_config_error(error, "display.y4m_path", "%.200s: cannot be written: %s", config->display_y4m_path,
                        strerror(errno));
    return fd;
}

static void *y4m_open(const struct fv_config *config, const char *folder, struct fv_error *error)
{
    (void)folder;
    signal(SIGPIPE, SIG_IGN);
    int fd = open_stream(config, error);
    if (fd < 0) return NULL;
    struct y4m_sink *s = fv_arena_take(fv_arena(), "display", sizeof *s, 64);
    long long width = config->display_width * config->display_eyes, height = config->display_height;
    s->fd = fd;
    memcpy(s->path, config->display_y4m_path, sizeof s->path);
    s->plane = (size_t)(width * height);
    s->size = MARKER + 3 * s->plane;
    s->frame = fv_arena_take(fv_arena(), "display", s->size, 64);
    memcpy(s->frame, marker, MARKER);
    char header[HEADER_MAX];
    long long numerator, denominator;
    rate_ratio(config->budget_hz, &numerator, &denominator);
    int n = snprintf(header, sizeof header,
                     "YUV4MPEG2 W%lld H%lld F%lld:%lld Ip A1:1 C444 XYSCSS=444 XCOLORRANGE=LIMITED\n", width,
                     height, numerator, denominator);
    int failed = write_all(fd, header, (size_t)n);
    if (!failed) return s;
    write_error(s, failed, error);
    if (fd != STDOUT_FILENO) close(fd);
    return NULL;
}

static bool y4m_wants(const void *state, int64_t frame, bool last)
{
    (void)state, (void)frame, (void)last;
    return true;
}

static int y4m_present(void *state, const struct fv_picture *picture, int64_t frame, struct fv_error *error)
{
    (void)frame;
    struct y4m_sink *s = state;
    size_t width = (size_t)picture->width, stride = width * (size_t)picture->eyes;
    for (int eye = 0; eye < picture->eyes; eye++) {
        uint8_t *out = s->frame + MARKER + (size_t)eye * width;
        for (int y = 0; y < picture->height; y++, out += stride)
            convert_row(picture->pixels[eye] + y * picture->stride_bytes, picture->width, out, out + s->plane,
                        out + 2 * s->plane);
    }
    off_t start = lseek(s->fd, 0, SEEK_CUR);
    int failed = write_all(s->fd, s->frame, s->size);
    if (!failed) return 0;
    /* A file ends with its last whole frame; what cannot be cut is no regular file. */
    bool cut = start >= 0 && ftruncate(s->fd, start) == 0;
    (void)cut;
    return write_error(s, failed, error);
}

static int y4m_close(void *state, struct fv_error *error)
{
    struct y4m_sink *s = state;
    if (s->fd == STDOUT_FILENO || close(s->fd) == 0) return 0;
    return write_error(s, errno, error);
}

const struct fv_sink fv_sink_y4m = {"y4m", y4m_open, y4m_wants, y4m_present, y4m_close, NULL, NULL};
