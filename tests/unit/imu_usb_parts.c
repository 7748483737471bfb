/* imu_usb_parts: what lies around the feed of an inertial sensor on USB: the head that comes of its state, the list of
 * devices, the layout of unknown ones, the rules for udev, libusb's memory, the mailbox. */
#include "platform/mailbox.h"
#include "platform/threads.h"
#include "sensors/imu/factory.h"
#include "sensors/imu/head.h"
#include "sensors/imu/layout.h"
#include "sensors/imu/usb_find.h"
#include "sensors/imu/usb_memory.h"

#include "tests/support/program.h"

#include <math.h>
#include <zlib.h>

static const int64_t ms = 1000000;
static struct fv_error error;

static void heads(void **state)
{
    (void)state;
    const struct fv_neck neck = {0.075, 0.08};
    struct fv_imu_state s = {.good = 1, .t_ns = 1000 * ms, .arrival_ns = 1000 * ms, .rotation = {1, 0, 0, 0},
                             .rate = {0, 1, 0}};
    struct fv_pose head;
    double turn[3];
    assert_true(fv_imu_head(&s, &neck, true, 1010 * ms, 20 * ms, &head));
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.03) < 1e-12);
    assert_true(fv_imu_head(&s, &neck, false, 1010 * ms, 20 * ms, &head));
    assert_true(head.rotation[0] == 1 && head.position_m[2] == 0);
    assert_true(fv_imu_head(&s, &neck, true, 1100 * ms, 1000 * ms, &head)); /* no further than 0.1 s */
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.1) < 1e-12);
    assert_false(fv_imu_head(&s, &neck, true, 1100 * ms + 1, 0, &head));
    assert_false(fv_imu_head(&s, &neck, true, INT64_MAX, 0, &head));
    s.t_ns = INT64_MIN; /* a device whose clock is no clock */
    assert_true(fv_imu_head(&s, &neck, true, 1000 * ms, 0, &head));
    fv_quat_to_vector(head.rotation, turn);
    assert_true(fabs(turn[1] - 0.1) < 1e-12);
    s.t_ns = INT64_MAX;
    assert_true(fv_imu_head(&s, &neck, true, INT64_MIN, 0, &head) && head.rotation[0] == 1);
    s.good = 0;
    assert_false(fv_imu_head(&s, &neck, true, 1000 * ms, 0, &head));
}

static void layouts(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        {"bytes", "bytes: ''; must be a whole number from 1 to 1024"},
        {"bytes 52.5", "must be a whole number"},
        {"bytes 0", "bytes: ' 0'; must be"},
        {"bytes 50", "readings end at byte 51 of a report of 50"},
        {"hertz 5", "'hertz 5' is no field of a layout; there are interface, id"},
        {"axes 1 2", "axes:"},
        {"axes 1 2 -3", "left-handed"},
        {"number f16", "number: 'f16'; must be one of i16, i32, f32"},
        {"order little big", "order: ' big' is too much"},
        {"hz nan", "hz: ' nan'; must be"},
        {"acc_unit 0", "acc_unit"},
        {"hz 1000 2", "is too much"},
        {"hz 1000,, id 3", "'' is no field"},
    };
    struct fv_imu_device device;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(fv_imu_layout_read(bad[i][0], &device, &error), -1);
        if (!strstr(error.text, bad[i][1])) fail_msg("%s: %s", bad[i][0], error.text);
    }
    assert_int_equal(fv_imu_layout_read("", &device, &error), 0);
    assert_memory_equal(&device.layout, &fv_imu_devices[FV_IMU_GENERIC].layout, sizeof device.layout);
}

static void plug(const char *at, const char *vendor, const char *product, int bus, int number, const char *serial)
{
    char command[1024];
    snprintf(command, sizeof command,
             "d=%s/sys/bus/usb/devices/%s; mkdir -p $d && echo %s >$d/idVendor && echo %s >$d/idProduct && "
             "echo %d >$d/busnum && echo %d >$d/devnum && if [ -n '%s' ]; then echo '%s' >$d/serial; fi",
             program_folder(), at, vendor, product, bus, number, serial, serial);
    assert_int_equal(system(command), 0);
}

static const struct fv_usb_place *choose(const char *wish_text, struct fv_usb_place *places, int count)
{
    struct fv_usb_wish wish;
    assert_true(fv_usb_wish_read(wish_text, &wish));
    return fv_usb_choose(&wish, places, count);
}

static void finds(void **state)
{
    (void)state;
    static struct fv_usb_place places[FV_USB_PLACES_MAX];
    struct fv_usb_wish wish;
    char longer[200];
    assert_int_equal(fv_usb_list(program_folder(), places), -1);
    plug("1-2", "2833", "0021", 1, 12, "");
    plug("usb1", "1d6b", "0002", 1, 1, "0000:00:14.0");
    plug("1-1.4", "28DE", "2000", 1, 7, "LHR-1234");
    plug("3-1", "28de", "2000", 3, 2, "LHR-99");
    plug("1-2:1.0", "28de", "2000", 1, 5, "");
    plug("2-1", "28de", "", 2, 4, "");
    plug("2-2", "1234", "abcd", 2, 5, "X Y");
    int count = fv_usb_list(program_folder(), places);
    assert_int_equal(count, 5);
    for (int i = 1; i < count; i++)
        assert_true(places[i - 1].bus < places[i].bus || places[i - 1].number < places[i].number);
    assert_ptr_equal(choose("", places, count), &places[1]); /* in the table's order, then by bus */
    assert_ptr_equal(choose("rift-dk2", places, count), &places[2]);
    assert_ptr_equal(choose("2833:0021", places, count), &places[2]);
    assert_ptr_equal(choose("LHR-99", places, count), &places[4]);
    assert_ptr_equal(choose("X Y", places, count), &places[3]);
    assert_ptr_equal(choose("1234:ABCD", places, count), &places[3]);
    assert_null(choose("psvr", places, count));
    assert_null(choose("LHR-9", places, count));
    assert_null(choose("", places, 0));
    memset(longer, 'a', sizeof longer - 1);
    longer[sizeof longer - 1] = 0;
    assert_false(fv_usb_wish_read(longer, &wish));
}

/* What udev is told are the table's devices, for who sits there and nobody else. */
static void rules(void **state)
{
    (void)state;
    static char text[8192];
    char row[256];
    program_slurp(FV_SOURCE_DIR "/config/udev/70-foveola-imu.rules", text, sizeof text);
    assert_null(strstr(text, "MODE"));
    for (int i = 0; i < FV_IMU_DEVICES; i++) {
        const struct fv_imu_device *d = &fv_imu_devices[i];
        if (!d->vendor) continue;
        snprintf(row, sizeof row, "ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\", TAG+=\"uaccess\"\n", d->vendor,
                 d->product);
        if (!strstr(text, row)) fail_msg("no rule for %s: %s", d->name, row);
        assert_true(d->layout.bytes > 0 && d->layout.bytes <= 1024);
    }
}

/* The same takings for ever need no more than once; too much is refused, and nothing is lost by it. */
static void memory(void **state)
{
    (void)state;
    void *block[40];
    assert_null(fv_usb_malloc(10));
    fv_usb_memory_open();
    int64_t used = 0;
    for (int round = 0; round < 1000; round++) {
        for (int i = 0; i < 40; i++) {
            block[i] = fv_usb_calloc(1, (size_t)(1 + 97 * i));
            assert_non_null(block[i]);
            assert_true((uintptr_t)block[i] % 16 == 0);
            for (int k = 0; k < 1 + 97 * i; k++) assert_int_equal(((char *)block[i])[k], 0);
            memset(block[i], i, (size_t)(1 + 97 * i));
        }
        for (int i = 0; i < 40; i++)
            for (int k = 0; k < 1 + 97 * i; k++) assert_int_equal(((char *)block[i])[k], i);
        for (int i = 0; i < 40; i++) fv_usb_free(block[i]);
        if (round == 0) used = fv_usb_memory_counts().bytes;
    }
    assert_int_equal(fv_usb_memory_counts().bytes, used);
    char *grown = fv_usb_realloc(NULL, 10);
    strcpy(grown, "nine text");
    grown = fv_usb_realloc(grown, 5000);
    assert_string_equal(grown, "nine text");
    assert_ptr_equal(fv_usb_realloc(grown, 20), grown);
    assert_null(fv_usb_realloc(grown, FV_USB_BLOCK_MAX + 1));
    assert_string_equal(grown, "nine text");
    fv_usb_free(grown);
    fv_usb_free(NULL);
    assert_null(fv_usb_calloc(SIZE_MAX / 2, 3));
    int large = 0;
    while (large < 40 && (block[large] = fv_usb_malloc(30000))) large++;
    assert_true(large > 0 && large < 40 && fv_usb_memory_counts().refused >= 4);
    while (large > 0) fv_usb_free(block[--large]);
    assert_non_null(fv_usb_malloc(30000));
}

/* Text, compressed, in pieces of 62 bytes, as a headset gives it. */
static int factory(const char *text, struct fv_imu_calibration *calibration)
{
    static struct fv_factory_pieces pieces;
    static uint8_t packed[8192];
    uint8_t report[FV_FACTORY_PIECE_MAX] = {FV_FACTORY_PIECE};
    uLongf bytes = sizeof packed;
    int more = 1;
    pieces.bytes = 0;
    assert_int_equal(compress(packed, &bytes, (const Bytef *)text, (uLong)strlen(text)), Z_OK);
    for (uLongf at = 0; more > 0; at += report[1]) {
        report[1] = (uint8_t)(bytes - at < 62 ? bytes - at : 62);
        memcpy(report + 2, packed + at, report[1]);
        more = fv_factory_piece(&pieces, report, sizeof report, &error);
        assert_int_equal(more, report[1] > 0);
    }
    assert_int_equal(pieces.bytes, bytes);
    return fv_factory_read(pieces.packed, pieces.bytes, calibration, &error);
}

static void factories(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "", "[1]", "{}", "{\"acc_bias\": [0, 0], \"gyro_bias\": [0, 0, 0]}",
        "{\"acc_bias\": [0, 0, \"1\"], \"gyro_bias\": [0, 0, 0]}", "{\"acc_bias\": [0, 0, 99], \"gyro_bias\": [0, 0, 0]}",
        "{\"acc_bias\": [0, 0, 0], \"gyro_bias\": [0, 0, 0], \"acc_scale\": [1, 1, 0]}", "{\"acc_bias\": [NaN]}"};
    const uint8_t wrong[] = {FV_FACTORY_PIECE, 3, 1, 2}, other[] = {FV_FACTORY_BEGIN, 0};
    static struct fv_factory_pieces full = {.bytes = FV_FACTORY_PACKED_MAX - 1};
    struct fv_imu_calibration c = fv_imu_uncalibrated;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) assert_int_equal(factory(bad[i], &c), -1);
    assert_memory_equal(&c, &fv_imu_uncalibrated, sizeof c);
    assert_int_equal(factory("{\"acc_bias\": [0.1, -0.2, 0.3], \"acc_scale\": [1.001, 0.999, 1], \"gyro_bias\": [0.01, 0, "
                             "-0.02], \"gyro_scale\": [1, 1, 1.5], \"device\": {\"imu\": 1}}", &c), 0);
    assert_true(c.acc_bias[1] == -0.2 && c.acc_scale[0] == 1.001 && c.rate_bias[2] == -0.02 && c.rate_scale[2] == 1.5);
    assert_int_equal(factory("{\"imu\": {\"acc_bias\": [1, 2, 3], \"gyro_bias\": [0, 0, 0.5]}, \"acc_bias\": [9, 9, 9]}", &c),
                     0);
    assert_true(c.acc_bias[2] == 3 && c.acc_scale[2] == 1 && c.rate_bias[2] == 0.5 && c.rate_scale[0] == 1);
    assert_int_equal(fv_factory_piece(&full, wrong, sizeof wrong, &error), -1);
    assert_int_equal(fv_factory_piece(&full, other, sizeof other, &error), -1);
    assert_int_equal(fv_factory_piece(&full, wrong, 1, &error), -1);
    assert_int_equal(fv_factory_piece(&full, (const uint8_t[]){FV_FACTORY_PIECE, 2, 1, 2}, 4, &error), -1);
    assert_int_equal(fv_factory_read(wrong, sizeof wrong, &c, &error), -1);
    assert_int_equal(fv_factory_read(wrong, 0, &c, &error), -1);
}

struct letter {
    uint64_t word[40];
};
static struct fv_mailbox box;
static atomic_bool over;

static void *write_letters(void *context)
{
    (void)context;
    for (uint64_t n = 1; !atomic_load(&over); n++) {
        struct letter l;
        for (int i = 0; i < 40; i++) l.word[i] = n * 1000 + (uint64_t)i;
        fv_mailbox_put(&box, &l, sizeof l);
    }
    return NULL;
}

/* No letter is ever half of one and half of another, and none is older than the one before. */
static void letters(void **state)
{
    (void)state;
    pthread_t writer;
    struct letter l = {.word = {7}};
    assert_false(fv_mailbox_get(&box, &l, sizeof l));
    assert_int_equal(l.word[0], 7);
    assert_int_equal(fv_thread_start(&writer, "writer", FV_CAN_WAIT, write_letters, NULL, &error), 0);
    uint64_t last = 0;
    for (int i = 0; i < 200000; i++) {
        if (!fv_mailbox_get(&box, &l, sizeof l)) continue;
        assert_true(l.word[0] % 1000 == 0 && l.word[0] >= last);
        for (int k = 1; k < 40; k++) assert_int_equal(l.word[k], l.word[0] + (uint64_t)k);
        last = l.word[0];
    }
    atomic_store(&over, true);
    pthread_join(writer, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(heads), cmocka_unit_test(layouts), cmocka_unit_test(finds),
        cmocka_unit_test(rules), cmocka_unit_test(memory),  cmocka_unit_test(factories), cmocka_unit_test(letters),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
