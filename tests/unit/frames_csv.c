/* frames_csv: a row for every frame, numbers in full, whole rows on a disk that fills, and what a row costs.
 */
#include "cli/frames_csv.h"
#include "platform/clock.h"
#include "platform/files.h"
#include "platform/heap.h"
#include "tests/support/markup_check.h"
#include "tests/support/sample_session.h"

#include <errno.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

static char folder[64];
static struct fv_error error;
static struct fv_session session;
static struct fv_frame_record records[SAMPLE_RECORDS];

static const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    fv_path_join(path, folder, name);
    return path;
}

/* As a run writes it, row by row. */
static int write_csv(const char *name)
{
    if (fv_frames_csv_open(&session, path_of(name), &error)) return -1;
    for (int64_t i = 0; i < session.frames; i++) fv_frames_csv_row(&session, &records[i]);
    return fv_frames_csv_close(&error);
}

/* The caller frees the text. */
static void read_text(const char *name, char **text)
{
    size_t size;
    if (fv_file_read(path_of(name), 1 << 26, text, &size, &error)) fail_msg("%s", error.text);
    assert_int_equal(strlen(*text), size);
}

static void a_row_a_frame(void **unused)
{
    (void)unused;
    static const char header[] =
        "frame,t_ns,frame_ms,cpu_ms,control_ms,idle_ms,predicted_ms,budget_ms,latch_ms,stage_select_ms,"
        "stage_a_b__c_ms,stage__ms,stage_sample_ms,stage_present_ms,level,periods,r0_deg,r1_deg,p_min,"
        "rays_primary,rays_shadow,rays_secondary,rays_march_steps,rays_march_limited,sampled_fraction,gaze_left_x_px,"
        "gaze_left_y_px,gaze_right_x_px,gaze_right_y_px,gaze_latency_ms,missed,cut,cut_tiles,late_stages\n";
    static const char first[] =
        "41,9007199254740993,,1.5,0.0123,-0,-0.5,1e-10,1e+30,0.1,,0,123456.79,0.33333334,-2,3,16777216,180,0."
        "05,"
        "9223372036854775807,1,2,-9223372036854775808,0,0,0,0,0,0,0,1,0,2147483647,4294967295\n";
    sample_session(&session, records, 500);
    session.stage[1] = "a,b\"\nc";
    session.stage[2] = NULL;
    records[0] = (struct fv_frame_record){.frame = 41,
                                          .t_ns = 9007199254740993,
                                          .frame_ms = NAN,
                                          .cpu_ms = 1.5f,
                                          .control_ms = 0.0123f,
                                          .idle_ms = -0.0f,
                                          .predicted_ms = -0.5f,
                                          .budget_ms = 1e-10f,
                                          .latch_ms = 1e30f,
                                          .stage_ms = {0.1f, INFINITY, 0, 123456.79f, 1 / 3.0f},
                                          .level = -2,
                                          .periods = 3,
                                          .r0_deg = 16777216,
                                          .r1_deg = 180,
                                          .p_min = 0.05f,
                                          .rays = {INT64_MAX, 1, 2, INT64_MIN},
                                          .cut_tiles = INT32_MAX,
                                          .late_stages = UINT32_MAX,
                                          .missed = true};
    assert_int_equal(write_csv("frames.csv"), 0);
    char *text;
    read_text("frames.csv", &text);
    assert_memory_equal(text, header, sizeof header - 1);
    if (strncmp(text + sizeof header - 1, first, sizeof first - 1) != 0)
        fail_msg("%.300s", text + sizeof header - 1);
    assert_int_equal(markup_count(text, "\n"), 501);
    assert_int_equal(markup_count(text, ","), 501 * 33);
    free(text);
}

/* More frames than records are kept: rows do not come from the session's records. */
static void rows_go_on_beyond_the_records(void **unused)
{
    (void)unused;
    static const int64_t capacities[] = {0, 1, 300};
    for (int i = 0; i < 3; i++) {
        sample_session(&session, records, 2000);
        session.capacity = capacities[i];
        assert_int_equal(write_csv("frames.csv"), 0);
        char *text;
        read_text("frames.csv", &text);
        assert_int_equal(markup_count(text, "\n"), 2001);
        assert_non_null(strstr(text, "\n1999,"));
        free(text);
    }
}

/* Every float comes back as itself. */
static void numbers_read_back(void **unused)
{
    (void)unused;
    uint64_t random = 11;
    sample_session(&session, records, 4000);
    for (int i = 0; i < 4000; i++) {
        double size = i % 2 ? random_decade(&random, 1e-38, 3e38) : random_decade(&random, 1e-5, 1e7);
        records[i].frame_ms = (float)(i % 3 ? size : -size);
    }
    assert_int_equal(write_csv("frames.csv"), 0);
    char *text;
    read_text("frames.csv", &text);
    const char *at = strchr(text, '\n') + 1;
    for (int i = 0; i < 4000; i++) {
        const char *number = strchr(strchr(at, ',') + 1, ',') + 1;
        assert_true((float)strtod(number, NULL) == records[i].frame_ms);
        assert_true(strcspn(number, ",") <= 16);
        at = strchr(at, '\n') + 1;
    }
    free(text);
}

/* The file may grow to a limit and no farther: it ends with the last whole row that fitted. */
static void a_full_disk_keeps_whole_rows(void **unused)
{
    (void)unused;
    static const rlim_t limits[] = {100, FV_WRITER_BYTES - 4000, FV_WRITER_BYTES, 200000, 1000000};
    struct rlimit usual, limited;
    sample_session(&session, records, SAMPLE_RECORDS);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &usual);
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        limited = usual;
        limited.rlim_cur = limits[i];
        setrlimit(RLIMIT_FSIZE, &limited);
        unlink(path_of("full.csv"));
        int result = write_csv("full.csv");
        setrlimit(RLIMIT_FSIZE, &usual);
        assert_int_equal(result, -1);
        assert_non_null(strstr(error.text, strerror(EFBIG)));
        assert_false(fv_file_exists(path_of("full.csv.part")));
        bool kept = limits[i] >= FV_WRITER_BYTES;
        assert_true(fv_file_exists(path_of("full.csv")) == kept);
        if (!kept) continue;
        char *text;
        read_text("full.csv", &text);
        size_t size = strlen(text);
        int rows = markup_count(text, "\n");
        assert_true(size <= limits[i] && size + FV_WRITER_BYTES >= limits[i]);
        assert_int_equal(text[size - 1], '\n');
        assert_int_equal(markup_count(text, ","), rows * 33);
        free(text);
    }
    assert_int_equal(fv_frames_csv_open(&session, "/nowhere/frames.csv", &error), -1);
}

/* What was not opened is neither written nor an error. */
static void closed_is_quiet(void **unused)
{
    (void)unused;
    fv_frames_csv_row(&session, &records[0]);
    assert_int_equal(fv_frames_csv_close(&error), 0);
}

static void rows_allocate_nothing_and_are_cheap(void **unused)
{
    (void)unused;
    sample_session(&session, records, SAMPLE_RECORDS);
    int64_t before = fv_heap_calls() + fv_heap_system_calls();
    int64_t start_ns = fv_clock_thread_ns();
    assert_int_equal(write_csv("frames.csv"), 0);
    double us = (double)(fv_clock_thread_ns() - start_ns) * 1e-3 / SAMPLE_RECORDS;
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before);
    print_message("%.2f us of CPU time a row\n", us);
#ifdef FV_HEAP
    assert_true(us < 20);
#endif
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_row_a_frame),     cmocka_unit_test(rows_go_on_beyond_the_records),
        cmocka_unit_test(numbers_read_back), cmocka_unit_test(a_full_disk_keeps_whole_rows),
        cmocka_unit_test(closed_is_quiet),   cmocka_unit_test(rows_allocate_nothing_and_are_cheap),
    };
    char command[128];
    snprintf(folder, sizeof folder, "/tmp/foveola-frames-XXXXXX");
    if (!mkdtemp(folder)) return 1;
    fv_heap_seal(false);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    snprintf(command, sizeof command, "rm -r %s", folder);
    return failed || system(command) != 0;
}
