/* spool: rows through a ring and a thread into files, whatever the disk does: what is put never waits, what does not fit
 * is counted; and recordings of whole runs on disks that are full, closed or too slow. */
#include "platform/spool.h"

#include "cli/record.h"
#include "platform/threads.h"

#include "tests/support/program.h"

#include <errno.h>
#include <semaphore.h>

enum { SLOTS = 64 };

/* A disk: what was written, when it fails, what it waits for. */
static struct disk {
    int64_t last, rows, fail_at; /* fail_at: this row cannot be written; 0: all can */
    sem_t *gate;
} disk;

static int write_row(void *context, const void *row)
{
    struct disk *d = context;
    int64_t value;
    memcpy(&value, row, sizeof value);
    if (d->gate) sem_wait(d->gate);
    if (d->fail_at && value >= d->fail_at) return ENOSPC;
    assert_true(value > d->last);
    d->last = value;
    d->rows++;
    return 0;
}

static struct fv_spool spool, other;
static int64_t ring[SLOTS], other_ring[SLOTS];
static struct fv_error error;

static int fresh(void **state)
{
    (void)state;
    disk = (struct disk){0};
    fv_spool_begin(&spool, "test", ring, SLOTS, sizeof ring[0], write_row, &disk, NULL);
    return 0;
}

static void expect(const struct fv_spool *s, int64_t rows, int64_t dropped)
{
    struct fv_spool_counts c = fv_spool_counts(s);
    if (c.rows != rows || c.dropped != dropped)
        fail_msg("%lld rows, %lld dropped", (long long)c.rows, (long long)c.dropped);
}

static void rows_come_out_in_order_and_what_does_not_fit_is_counted(void **state)
{
    (void)state;
    int64_t value = 0;
    assert_false(fv_spool_drain(&spool));
    /* Across the place where the counters of rows begin anew. */
    atomic_store(&spool.put, UINT32_MAX - SLOTS / 2);
    atomic_store(&spool.taken, UINT32_MAX - SLOTS / 2);
    for (int round = 0; round < 5; round++) {
        for (int i = 0; i < SLOTS + round; i++) value++, fv_spool_put(&spool, &value);
        assert_true(fv_spool_drain(&spool));
        assert_false(fv_spool_drain(&spool));
        assert_int_equal(disk.last, value - round); /* the newest ones found no room */
    }
    expect(&spool, 5 * SLOTS, 0 + 1 + 2 + 3 + 4);
    struct fv_spool closed = {0};
    fv_spool_put(&closed, &value); /* is not begun: nothing */
    expect(&closed, 0, 0);
}

static void a_failure_ends_it_and_those_that_share_it(void **state)
{
    (void)state;
    static atomic_int failed;
    atomic_store(&failed, 0);
    struct disk second = {0};
    fv_spool_begin(&spool, "test", ring, SLOTS, sizeof ring[0], write_row, &disk, &failed);
    fv_spool_begin(&other, "other", other_ring, SLOTS, sizeof ring[0], write_row, &second, &failed);
    disk.fail_at = 8;
    for (int64_t i = 1; i <= 20; i++) fv_spool_put(&spool, &i), fv_spool_put(&other, &i);
    fv_spool_drain(&spool);
    fv_spool_drain(&other);
    expect(&spool, 7, 13);
    expect(&other, 0, 20);
    disk.fail_at = 0; /* for good, all the same */
    for (int64_t i = 21; i <= 30; i++) fv_spool_put(&spool, &i), fv_spool_put(&other, &i);
    assert_false(fv_spool_drain(&spool));
    expect(&spool, 7, 23);
    expect(&other, 0, 30);
}

/* The writer waits for a disk that does not answer: who puts goes on, and once the disk answers nothing that found room
 * is missing. */
static void a_disk_that_hangs_holds_nobody_up(void **state)
{
    (void)state;
    static struct fv_spooler spooler;
    sem_t gate;
    spooler = (struct fv_spooler){0};
    sem_init(&gate, 0, 0);
    disk.gate = &gate;
    fv_spooler_add(&spooler, &spool);
    if (fv_spooler_start(&spooler, &error)) fail_msg("%s", error.text);
    for (int64_t i = 1; i <= 10 * SLOTS; i++) fv_spool_put(&spool, &i);
    expect(&spool, 0, 9 * SLOTS);
    for (int i = 0; i < SLOTS; i++) sem_post(&gate);
    fv_spooler_stop(&spooler);
    expect(&spool, SLOTS, 9 * SLOTS);
    assert_true(disk.rows == SLOTS && disk.last == SLOTS);
}

static void rows_of_two_threads_side_by_side(void **state)
{
    (void)state;
    enum { ROWS = 200000 };
    static struct fv_spooler spooler;
    static struct disk second;
    spooler = (struct fv_spooler){0};
    second = (struct disk){0};
    fv_spool_begin(&other, "other", other_ring, SLOTS, sizeof ring[0], write_row, &second, NULL);
    fv_spooler_add(&spooler, &spool);
    fv_spooler_add(&spooler, &other);
    if (fv_spooler_start(&spooler, &error)) fail_msg("%s", error.text);
    for (int64_t i = 1; i <= ROWS; i++) {
        fv_spool_put(&spool, &i);
        fv_spool_put(&other, &i);
        if (i % 4096 == 0) usleep(100);
    }
    fv_spooler_stop(&spooler);
    struct fv_spool_counts a = fv_spool_counts(&spool), b = fv_spool_counts(&other), all = fv_spooler_counts(&spooler);
    assert_true(a.rows == disk.rows && b.rows == second.rows && a.rows > 0 && b.rows > 0);
    assert_true(a.rows + a.dropped == ROWS && b.rows + b.dropped == ROWS);
    assert_true(all.rows == a.rows + b.rows && all.dropped == a.dropped + b.dropped);
}

/* A shell command in the fresh folder; its exit code. */
static int shell(const char *command)
{
    char text[1024];
    snprintf(text, sizeof text, "cd %s && %s", program_folder(), command);
    int status = system(text);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* More rows are latched than the writer gets rid of: what is left is a tape, and replay says why it is no more. */
static void a_recording_with_rows_missing_is_not_replayed(void **state)
{
    (void)state;
    static struct fv_config config;
    static struct fv_spooler spooler; /* never started: a disk that hangs */
    static const char *const stage[] = {"sample"};
    char out[FV_PATH_MAX];
    if (fv_config_load(&config, &(struct fv_config_request){0}, &error)) fail_msg("%s", error.text);
    snprintf(out, sizeof out, "%s/slow", program_folder());
    if (fv_record_open(&config, stage, 1, false, out, &spooler, &error)) fail_msg("%s", error.text);
    struct fv_pose head = {.rotation = {1, 0, 0, 0}};
    struct fv_gaze gaze = {.direction = {{0, 0, -1}, {0, 0, -1}}};
    for (int64_t i = 0; i < FV_RECORD_ROWS + 7; i++) {
        struct fv_decision decision = {.t_ns = i};
        fv_record_latch(i, &head, &gaze);
        if (i % 2) fv_record_decision(&decision);
    }
    for (int i = 0; i < spooler.spools; i++) fv_spool_drain(spooler.spool[i]);
    assert_int_equal(fv_record_close(FV_RECORD_ROWS + 7, out, &error), -1);
    if (!strstr(error.text, "7 rows were dropped")) fail_msg("%s", error.text);
    assert_int_equal(shell("test $(wc -l <slow/tape/head.csv) = 4098 && test $(wc -l <slow/tape/gaze.csv) = 4098"), 0);
    struct program_result r = program("replay slow --out again");
    if (r.code != 2 || !strstr(r.errors, "slow/tape/frames: 7 rows were dropped while it was recorded: no replay of it can"))
        fail_msg("exit %d: %s", r.code, r.errors);
}

#define TINY "--set scene.name=cornell --set display.headset=small --set display.width=16 --set display.height=16 " \
             "--set display.sink=none --set threads.workers=1 --set threads.sealed_heap=fatal "

static int64_t report_number(const char *name, const char *key)
{
    static char json[1 << 18];
    char path[256];
    snprintf(path, sizeof path, "%s/%s/report.json", program_folder(), name);
    program_slurp(path, json, sizeof json);
    const char *at = strstr(json, key);
    if (!at) fail_msg("no %s in %s", key, path);
    return strtoll(at + strlen(key), NULL, 10);
}

/* Disks that are full, or pipes that are closed, when a file's first buffer is written. */
static void a_disk_that_fails_ends_the_recording_not_the_run(void **state)
{
    (void)state;
    static const struct {
        const char *name, *prepare, *why;
    } cases[] = {
        {"full", "ln -s /dev/full full/tape/head.csv.part", "foveola: tape: No space left on device: recording ends here"},
        {"decided", "ln -s /dev/full decided/tape/decisions.csv.part", "foveola: tape: No space left on device: recording"},
        {"pipe", "mkfifo p && ln -s ../../p pipe/tape/gaze.csv.part && { sh -c 'exec 3<p; sleep 0.2' & }",
         "foveola: tape: Broken pipe: recording ends here"},
    };
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: no /dev/full here\n");
        skip();
    }
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char command[512];
        snprintf(command, sizeof command, "mkdir -p %s/tape && %s", cases[i].name, cases[i].prepare);
        assert_int_equal(shell(command), 0);
        struct program_result r = program("run " TINY "--frames 3000 --out %s", cases[i].name);
        const char *line = strstr(r.errors, cases[i].why);
        if (r.code != 1 || !line || strstr(strchr(line, '\n'), "recording ends here")) fail_msg("exit %d: %s", r.code, r.errors);
        assert_non_null(strstr(r.errors, "the recording is not whole"));
        assert_int_equal(report_number(cases[i].name, "\"frames\":"), 3000);
        assert_true(report_number(cases[i].name, "\"tape\":{\"rows\":") < 6000);
        assert_int_equal(report_number(cases[i].name, "\"heap_calls\":"), 0);
        snprintf(command, sizeof command, "test $(wc -l <%s/frames.csv) = 3001 && test ! -e %s/tape/frames", cases[i].name,
                 cases[i].name);
        if (shell(command)) fail_msg("%s", command);
        r = program("replay %s --out again", cases[i].name);
        if (r.code != 2 || !strstr(r.errors, "was cut off")) fail_msg("exit %d: %s", r.code, r.errors);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(rows_come_out_in_order_and_what_does_not_fit_is_counted, fresh),
        cmocka_unit_test_setup(a_failure_ends_it_and_those_that_share_it, fresh),
        cmocka_unit_test_setup(a_disk_that_hangs_holds_nobody_up, fresh),
        cmocka_unit_test_setup(rows_of_two_threads_side_by_side, fresh),
        cmocka_unit_test(a_recording_with_rows_missing_is_not_replayed),
        cmocka_unit_test(a_disk_that_fails_ends_the_recording_not_the_run),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
