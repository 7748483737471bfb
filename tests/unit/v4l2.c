/* v4l2: a made-up camera behind struct fv_camera_io: formats decoded byte by byte, what is negotiated, frames
 * in order, and each way in which a camera fails while it streams. */
#include "sensors/eye/v4l2.h"

#include "tests/support/fake_camera.h"
#include "tests/support/random.h"

#define COUNT(table) (sizeof table / sizeof table[0])
enum { SIDE = FAKE_SIDE, BUFFER = FAKE_BUFFER };
static const int64_t ms = 1000000;

static struct fv_camera camera;
static struct fv_camera_frame frame;
static struct fv_error error;
static uint8_t grey[SIDE * SIDE];

static struct fv_camera_settings wishes(void)
{
    return (struct fv_camera_settings){"eye.device", "/dev/eye", NULL, SIDE, SIDE, 120, 4 * ms};
}

static void streaming(void)
{
    plug();
    struct fv_camera_settings settings = wishes();
    if (fv_camera_open(&camera, &settings, &fake_io, &error)) fail_msg("%s", error.text);
    assert_true(fake.streaming && fake.mapped == FV_CAMERA_BUFFERS && camera.queued == FV_CAMERA_BUFFERS);
    assert_int_equal(fv_camera_grey_bytes(&camera), SIDE * SIDE);
    fv_camera_lend(&camera, grey, sizeof grey);
}

static enum fv_camera_event step(unsigned ready)
{
    memset(grey, 0xee, sizeof grey);
    enum fv_camera_event event = fv_camera_step(&camera, ready, &frame);
    assert_true(camera.fd < 0 ? fake.opened == 0 && fake.mapped == 0 : fake.opened == 1);
    return event;
}

static bool all_queued(void)
{
    int queued = 0;
    for (uint32_t i = 0; i < fake.buffers; i++) queued += fake.queued[i];
    return queued == FV_CAMERA_BUFFERS && camera.queued == FV_CAMERA_BUFFERS;
}

static void decoding(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint8_t bytes[16];
        size_t stride, size;
        uint8_t grey[4];
    } table[] = {
        {"GREY", {1, 2, 9, 3, 4}, 3, 5, {1, 2, 3, 4}},
        {"NV12", {1, 2, 9, 3, 4, 9, 128, 128}, 3, 8, {1, 2, 3, 4}},
        {"YUYV", {1, 128, 2, 128, 3, 127, 255, 0}, 4, 8, {1, 2, 3, 255}},
        {"Y10", {4, 0, 0xff, 3, 0, 2, 0, 4}, 4, 8, {1, 255, 128, 255}},
        {"Y12", {0x10, 0, 0xff, 0x0f, 0, 8, 0xff, 0xff}, 4, 8, {1, 255, 128, 255}},
        {"Y16", {0xff, 1, 0, 255, 0, 128, 255, 0}, 4, 8, {1, 255, 128, 0}},
    };
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct fv_camera_layout layout = {fv_camera_format_named(table[i].name), 2, 2, table[i].stride};
        assert_non_null(layout.format);
        assert_ptr_equal(fv_camera_format_of(layout.format->fourcc), layout.format);
        assert_int_equal(fv_camera_frame_bytes(&layout), table[i].size);
        /* A block of its own, so that a sanitizer sees its end; rows of grey further apart stay as they are
         * between. */
        uint8_t *bytes = malloc(table[i].size), out[10];
        memcpy(bytes, table[i].bytes, table[i].size);
        memset(out, 7, sizeof out);
        assert_false(fv_camera_decode(&layout, bytes, table[i].size - 1, out, 5));
        assert_false(fv_camera_decode(&layout, bytes, table[i].size, out, 1));
        assert_int_equal(out[0], 7);
        assert_true(fv_camera_decode(&layout, bytes, table[i].size, out, 5));
        const uint8_t *g = table[i].grey, expected[10] = {g[0], g[1], 7, 7, 7, g[2], g[3], 7, 7, 7};
        for (int k = 0; k < 10; k++)
            if (out[k] != expected[k]) fail_msg("%s: byte %d is %d", table[i].name, k, out[k]);
        free(bytes);
    }
    assert_null(fv_camera_format_named("MJPG"));
    assert_null(fv_camera_format_of(V4L2_PIX_FMT_MJPEG));
}

static void layouts_that_cannot_be(void **state)
{
    (void)state;
    const struct fv_camera_format *g = fv_camera_format_named("GREY"), *n = fv_camera_format_named("NV12"),
                                  *y = fv_camera_format_named("YUYV");
    const struct fv_camera_layout table[] = {
        {NULL, 2, 2, 2}, {g, 0, 2, 2}, {g, 2, 0, 2}, {g, -1, 2, 2}, {g, 4, 4, 3},     {g, 8193, 2, 8193},
        {g, 2, 8193, 2}, {n, 3, 2, 4}, {y, 3, 2, 8}, {y, 4, 2, 7},  {g, 2, 2, 65537},
    };
    uint8_t out[64];
    for (unsigned i = 0; i < COUNT(table); i++) {
        assert_int_equal(fv_camera_frame_bytes(&table[i]), 0);
        assert_false(fv_camera_decode(&table[i], out, sizeof out, out, 8));
    }
    /* Any layout that can be reads nothing past the bytes it says. */
    uint64_t seed = 3;
    for (int i = 0; i < 2000; i++) {
        struct fv_camera_layout l = {&fv_camera_formats[random_bits(&seed) % FV_CAMERA_FORMATS],
                                     1 + (int)(random_bits(&seed) >> 60), 1 + (int)(random_bits(&seed) >> 60),
                                     0};
        l.stride = (size_t)l.width * (size_t)l.format->step + (random_bits(&seed) >> 61);
        size_t size = fv_camera_frame_bytes(&l);
        if (!size) continue;
        uint8_t *bytes = calloc(size, 1), *to = malloc((size_t)l.width * (size_t)l.height);
        assert_true(fv_camera_decode(&l, bytes, size, to, (size_t)l.width));
        free(bytes), free(to);
    }
}

/* The nearest size and rate win, then the cheapest format; what the driver says it set counts. */
static void negotiation(void **state)
{
    (void)state;
    struct fv_camera_settings settings = wishes();
    streaming();
    assert_non_null(
        strstr(camera.text, "/dev/eye (made up): GREY 64x64, 120 Hz; asked for any 64x64, 120 Hz"));
    assert_int_equal(fake.rate, 120);
    fv_camera_close(&camera);
    plug(); /* a size and a stride of its own; one rate only */
    fake.offered[1] = V4L2_PIX_FMT_Y16, fake.offered[2] = V4L2_PIX_FMT_YUYV;
    fake.width = 48, fake.height = 32, fake.stride = 128, fake.hz[1] = 0;
    assert_int_equal(fv_camera_open(&camera, &settings, &fake_io, &error), 0);
    assert_non_null(strstr(camera.text, "YUYV 48x32, 30 Hz"));
    assert_int_equal(camera.layout.stride, 128);
    fv_camera_close(&camera);
    plug(); /* no list of rates */
    fake.hz[0] = 0;
    assert_int_equal(fv_camera_open(&camera, &settings, &fake_io, &error), 0);
    assert_non_null(strstr(camera.text, "120 Hz;"));
    fv_camera_close(&camera);
    plug(); /* S_FMT gives another format that is read */
    fake.given = V4L2_PIX_FMT_Y10;
    assert_int_equal(fv_camera_open(&camera, &settings, &fake_io, &error), 0);
    assert_non_null(strstr(camera.text, "Y10 64x64"));
    assert_int_equal(camera.layout.stride, 128);
    fv_camera_close(&camera);
    assert_true(fake.opened == 0 && fake.mapped == 0);
}

static void refusals(void **state)
{
    (void)state;
    static const char *const expected[] = {
        "No such file",  "captures no video", "several planes", "does not stream",
        "gives none of", "another format",    "cannot have",    "in use",
        "1 buffers",     "begin to stream",   "only: MJPG",     "at most 8192"};
    for (unsigned i = 0; i < COUNT(expected); i++) {
        struct fv_camera_settings settings = wishes();
        plug();
        if (i == 0) fake.plugged = false;
        if (i == 1) fake.capabilities = V4L2_CAP_STREAMING;
        if (i == 2) fake.capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_CAPTURE_MPLANE;
        if (i == 3) fake.capabilities = V4L2_CAP_VIDEO_CAPTURE;
        if (i == 4) settings.format = fv_camera_format_named("Y12");
        if (i == 5) fake.given = V4L2_PIX_FMT_MJPEG;
        if (i == 6) fake.stride = 10;
        if (i == 7) fake.busy = true;
        if (i == 8) fake.buffers = 1;
        if (i == 9) fake.fail_start = EIO;
        if (i == 10) fake.offered[1] = 0;
        if (i == 11) fake.width = 9000, fake.height = 2;
        assert_int_equal(fv_camera_open(&camera, &settings, &fake_io, &error), -1);
        if (!strstr(error.text, expected[i]) || !strstr(error.text, "/dev/eye") || strchr(error.text, '\n'))
            fail_msg("%s: %s", expected[i], error.text);
        assert_true(camera.fd < 0 && fake.opened == 0 && fake.mapped == 0);
    }
}

/* The newest of those that wait; all go back; time stamps of both kinds; gaps by their numbers. */
static void frames_in_order(void **state)
{
    (void)state;
    streaming();
    assert_int_equal(step(0), FV_CAMERA_NOTHING);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_NOTHING); /* EAGAIN */
    fills(10, fake.t_ns - 9 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_EOF);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_int_equal(frame.t_ns, fake.t_ns - 11 * ms); /* end of frame - exposure / 2 */
    assert_true(frame.grey.width == SIDE && frame.grey.height == SIDE &&
                frame.grey.pixels[SIDE * SIDE - 1] == 10);
    assert_true(all_queued());
    for (int i = 0; i < 3; i++) fills(20 + i, fake.t_ns - (4 - i) * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
    fake.sequence += 5;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_int_equal(frame.t_ns, fake.t_ns); /* start of exposure + exposure / 2 */
    assert_int_equal(frame.grey.pixels[0], 22);
    assert_true(all_queued() && camera.counts.skipped == 2 && camera.counts.gaps == 0);
    fake.t_ns += 20 * ms;
    fills(30, fake.t_ns - 2 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_int_equal(camera.counts.gaps, 5);
    fake.sequence = 0; /* counted anew */
    fake.t_ns += 20 * ms;
    fills(31, fake.t_ns - 2 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_int_equal(camera.counts.gaps, 5);
    fake.sequence = UINT32_MAX; /* and around */
    for (int i = 0; i < 2; i++) {
        fake.t_ns += 20 * ms;
        fills(32, fake.t_ns - 2 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
        assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    }
    assert_int_equal(camera.counts.gaps, 5);
    assert_int_equal(camera.counts.untimed, 0);
    fv_camera_close(&camera);
}

/* Stamps that cannot be: another clock's, the future's, long past, before the frame before. */
static void stamps_that_cannot_be(void **state)
{
    (void)state;
    static const int64_t off_ms[] = {5000, -4000, -1000000000, 0};
    streaming();
    int64_t last_ns = 0;
    for (int i = 0; i < 12; i++) {
        fake.t_ns += 8 * ms;
        struct v4l2_buffer *b = fills(i, fake.t_ns + off_ms[i % 4] * ms, V4L2_BUF_FLAG_TSTAMP_SRC_EOF);
        if (i % 4 == 3) b->flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
        if (i == 5) b->timestamp.tv_usec = -1, b->timestamp.tv_sec = fake.t_ns / 1000000000;
        assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
        assert_true(frame.t_ns > last_ns && frame.t_ns == fake.t_ns - 2 * ms);
        last_ns = frame.t_ns;
    }
    assert_int_equal(camera.counts.untimed, 12);
    /* v4l2loopback: of this clock, but it does not say so. */
    fake.t_ns += 8 * ms;
    fills(1, fake.t_ns - 3 * ms, 0)->flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_true(frame.t_ns == fake.t_ns - 5 * ms && camera.counts.untimed == 12);
    last_ns = frame.t_ns;
    fills(1, last_ns - ms, V4L2_BUF_FLAG_TSTAMP_SRC_EOF); /* twice the same time */
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_true(frame.t_ns > last_ns);
    fv_camera_close(&camera);
}

/* Bad frames are counted and go back; a good one beside them is taken. */
static void bad_frames(void **state)
{
    (void)state;
    streaming();
    fills(1, fake.t_ns, 0)->flags |= V4L2_BUF_FLAG_ERROR;
    fills(2, fake.t_ns, 0)->bytesused = 0;
    fills(3, fake.t_ns, 0)->bytesused = SIDE * SIDE - 1;
    fills(4, fake.t_ns, 0)->bytesused = BUFFER + 1;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_NOTHING);
    assert_true(camera.counts.flagged == 1 && camera.counts.shorted == 2 && camera.counts.corrupt == 1);
    assert_true(all_queued() && grey[0] == 0xee);
    fills(5, fake.t_ns, 0);
    fills(6, fake.t_ns, 0)->bytesused = 0;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_true(frame.grey.pixels[0] == 5 && all_queued());
    /* Numbers of buffers that are none, or not the driver's: never touched. */
    for (int i = 0; i < 4; i++) {
        fake.waiting[fake.waits++] = (struct v4l2_buffer){.index = i % 2 ? UINT32_MAX : fake.buffers + 9};
        assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_NOTHING);
    }
    assert_int_equal(camera.counts.corrupt, 5);
    fills(7, fake.t_ns, 0);
    fake.waiting[1] = fake.waiting[0]; /* the same one twice */
    fake.waits = 2;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_int_equal(camera.counts.corrupt, 6);
    assert_true(all_queued());
    fv_camera_close(&camera);
}

/* From lost to back: said once, frames again, all memory given back and mapped anew. */
static void comes_back(void)
{
    int64_t before = camera.counts.lost;
    assert_non_null(strstr(camera.text, "lost ("));
    for (int i = 0; i < 50; i++) {
        fake.t_ns += 100 * ms;
        assert_int_equal(step(0), FV_CAMERA_NOTHING);
    }
    fake.plugged = true, fake.fail_dequeue = fake.fail_queue = 0;
    fake.t_ns = fv_camera_due_ns(&camera) - 1;
    if (camera.fd < 0) assert_int_equal(step(0), FV_CAMERA_NOTHING);
    if (camera.fd < 0) {
        assert_int_equal(fake.opened, 0);
        fake.t_ns++;
        assert_int_equal(step(0), FV_CAMERA_NOTHING);
    }
    assert_int_equal(fake.opened, 1);
    fills(99, fake.t_ns, 0);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_BACK);
    assert_true(frame.grey.pixels[0] == 99 && all_queued());
    assert_non_null(strstr(camera.text, "GREY 64x64"));
    assert_true(camera.counts.restarts == camera.counts.lost && camera.counts.lost == before);
}

static void unplugged(void **state)
{
    (void)state;
    streaming();
    fake.plugged = false; /* DQBUF says ENODEV, poll an error */
    assert_int_equal(step(FV_CAMERA_READABLE | FV_CAMERA_BROKEN), FV_CAMERA_LOST);
    comes_back();
    fake.plugged = false; /* while frames wait: they are gone with it */
    fills(1, fake.t_ns, 0);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_LOST);
    comes_back();
    /* It comes back larger than memory was taken for: said once, not used; then as it was. */
    fake.plugged = false;
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_LOST);
    fake.plugged = true, fake.width = 2 * SIDE, fake.height = SIDE;
    int said = 0;
    for (int i = 0; i < 40; i++) {
        fake.t_ns += 100 * ms;
        if (step(0) != FV_CAMERA_LOST) continue;
        assert_non_null(strstr(camera.text, "larger frames"));
        said++;
    }
    assert_int_equal(said, 1);
    fake.width = 0;
    fake.t_ns = fv_camera_due_ns(&camera);
    assert_int_equal(step(0), FV_CAMERA_NOTHING);
    fills(9, fake.t_ns, 0);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_BACK);
    fv_camera_close(&camera);
    assert_true(fake.opened == 0 && fake.mapped == 0);
}

/* EIO now and then is lived with; again and again ends the stream; so do silence, errors of poll, of QBUF. */
static void stream_errors(void **state)
{
    (void)state;
    streaming();
    for (int i = 0; i < 100; i++) {
        fake.fail_dequeue = i % 8 < 5 ? EIO : 0;
        if (!fake.fail_dequeue) fills(i, fake.t_ns += ms, 0);
        assert_int_equal(step(FV_CAMERA_READABLE), fake.fail_dequeue ? FV_CAMERA_NOTHING : FV_CAMERA_FRAME);
    }
    fake.fail_dequeue = EIO;
    int steps = 0;
    while (step(FV_CAMERA_READABLE) != FV_CAMERA_LOST) assert_true(++steps < 10);
    fake.plugged = false;
    comes_back();
    static const int fatal[] = {EINVAL, EPIPE, ENODEV, EBADF};
    for (unsigned i = 0; i < COUNT(fatal); i++) {
        fake.fail_dequeue = fatal[i];
        assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_LOST);
        fake.plugged = false;
        comes_back();
    }
    assert_int_equal(step(FV_CAMERA_BROKEN), FV_CAMERA_LOST); /* POLLERR, and nothing waits */
    fake.plugged = false;
    comes_back();
    /* Silence: due after a second. */
    int64_t due_ns = fv_camera_due_ns(&camera);
    assert_true(due_ns - fake.t_ns == 1000 * ms);
    fake.t_ns = due_ns - 1;
    assert_int_equal(step(0), FV_CAMERA_NOTHING);
    fake.t_ns = due_ns;
    assert_int_equal(step(0), FV_CAMERA_LOST);
    fake.plugged = false;
    comes_back();
    /* Bad frames alone are silence too. */
    int lost = 0;
    for (int i = 0; i < 130 && !lost; i++) {
        fake.t_ns += 8 * ms;
        fills(1, fake.t_ns, 0)->flags |= V4L2_BUF_FLAG_ERROR;
        lost = step(FV_CAMERA_READABLE) == FV_CAMERA_LOST;
    }
    assert_true(lost);
    fake.plugged = false;
    comes_back();
    /* A buffer that was refused is offered again. */
    int64_t errors = camera.counts.errors;
    fake.fail_queue = EINVAL;
    fills(1, fake.t_ns, 0);
    assert_int_equal(step(FV_CAMERA_READABLE), FV_CAMERA_FRAME);
    assert_true(!all_queued() && camera.counts.errors == errors + 1);
    fake.fail_queue = 0;
    assert_int_equal(step(0), FV_CAMERA_NOTHING);
    assert_true(all_queued() && camera.counts.errors == errors + 1);
    fake.fail_queue = EIO; /* buffers are lost one after the other, until none is left */
    lost = 0;
    for (int i = 0; i < FV_CAMERA_BUFFERS + 1 && !lost; i++) {
        fake.t_ns += ms;
        fills(1, fake.t_ns, 0);
        lost = step(FV_CAMERA_READABLE) == FV_CAMERA_LOST;
    }
    assert_true(lost);
    fake.plugged = false;
    comes_back();
    fv_camera_close(&camera);
}

/* Whatever fails in whatever order: bounded, nothing leaks, and it comes back. */
static void anything(void **state)
{
    (void)state;
    uint64_t seed = 11;
    streaming();
    for (int i = 0; i < 100000; i++) {
        uint64_t r = random_bits(&seed) >> 40;
        fake.t_ns += (int64_t)(r % 40) * ms;
        fake.plugged = fake.plugged ? r % 997 != 0 : r % 31 == 0;
        fake.fail_dequeue = r % 61 == 0 ? EIO : r % 1009 == 0 ? ENODEV : 0;
        fake.fail_queue = r % 211 == 0 ? EIO : 0;
        fake.fail_start = r % 101 == 0 ? ENOSPC : 0;
        struct v4l2_buffer *b = camera.fd >= 0 && r % 3 ? fills((int)r & 255, fake.t_ns, 0) : NULL;
        if (b && r % 17 == 0) b->bytesused = (uint32_t)(r % (2 * BUFFER));
        if (b && r % 43 == 0) b->index = (uint32_t)r % 32;
        enum fv_camera_event event = step((unsigned)(r % 5 == 0 ? 3 : r % 2));
        if (event == FV_CAMERA_FRAME || event == FV_CAMERA_BACK)
            assert_true(frame.t_ns <= fake.t_ns &&
                        frame.grey.pixels[0] == frame.grey.pixels[SIDE * SIDE - 1]);
    }
    print_message("%d frames, %d lost, %d restarts\n", (int)camera.counts.frames, (int)camera.counts.lost,
                  (int)camera.counts.restarts);
    assert_true(camera.counts.lost > 50 && camera.counts.restarts >= camera.counts.lost - 1);
    fv_camera_close(&camera);
    assert_true(fake.opened == 0 && fake.mapped == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(decoding),        cmocka_unit_test(layouts_that_cannot_be),
        cmocka_unit_test(negotiation),     cmocka_unit_test(refusals),
        cmocka_unit_test(frames_in_order), cmocka_unit_test(stamps_that_cannot_be),
        cmocka_unit_test(bad_frames),      cmocka_unit_test(unplugged),
        cmocka_unit_test(stream_errors),   cmocka_unit_test(anything)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
