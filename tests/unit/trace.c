/* trace: trace.json is valid JSON of whole events, whatever was recorded, as Perfetto reads them. */
#include "platform/trace.h"
#include "tests/support/program.h"

#include <jansson.h>
#include <math.h>

static struct fv_error error;

static json_t *write_and_read(const struct fv_trace *trace, const struct fv_counters *counters)
{
    char path[128];
    json_error_t where;
    snprintf(path, sizeof path, "%s/trace.json", program_folder());
    assert_int_equal(fv_trace_write(trace, counters, path, &error), 0);
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &where);
    if (!root) fail_msg("trace.json:%d: %s", where.line, where.text);
    return root;
}

static const char *text_at(json_t *event, const char *key)
{
    json_t *value = json_object_get(event, key);
    assert_true(json_is_string(value));
    return json_string_value(value);
}

static double number_at(json_t *event, const char *key)
{
    json_t *value = json_object_get(event, key);
    if (!json_is_number(value)) fail_msg("%s is no number in %s", key, json_dumps(event, 0));
    return json_number_value(value);
}

/* Events by kind; each has all that its kind needs. */
struct counts {
    int names, spans, samples;
};
static struct counts check_events(json_t *root)
{
    struct counts counts = {0, 0, 0};
    size_t i;
    json_t *event;
    assert_string_equal(text_at(root, "displayTimeUnit"), "ms");
    json_array_foreach(json_object_get(root, "traceEvents"), i, event)
    {
        const char *phase = text_at(event, "ph");
        assert_true(number_at(event, "pid") == 1);
        text_at(event, "name");
        json_t *arguments = json_object_get(event, "args");
        assert_true(json_is_object(arguments));
        if (phase[0] == 'M') {
            counts.names++;
            continue;
        }
        assert_true(number_at(event, "tid") >= 0 && number_at(event, "ts") >= 0);
        if (phase[0] == 'X') {
            assert_true(number_at(event, "dur") >= 0);
            number_at(arguments, "frame");
            counts.spans++;
        } else {
            assert_string_equal(phase, "C");
            number_at(arguments, "value");
            counts.samples++;
        }
    }
    return counts;
}

static void an_empty_trace_is_valid(void **unused)
{
    (void)unused;
    struct counts counts = {0, 0, 0};
    for (int workers = 1; workers <= 3; workers++) {
        json_t *root = write_and_read(fv_trace_create(workers), NULL);
        counts = check_events(root);
        assert_int_equal(counts.names, 1 + 2 * workers);
        assert_int_equal(counts.spans + counts.samples, 0);
        json_decref(root);
    }
}

/* Also where the first worker has none. */
static void spans_of_any_worker_are_valid(void **unused)
{
    (void)unused;
    for (int had = 1; had < 8; had++) {
        struct fv_trace *trace = fv_trace_create(3);
        int spans = 0;
        for (int w = 0; w < 3; w++)
            for (int i = 0; i < 5 * (had >> w & 1); i++, spans++) fv_trace_add(trace, w, "pass", i, i, i + 1);
        json_t *root = write_and_read(trace, NULL);
        assert_int_equal(check_events(root).spans, spans);
        json_decref(root);
    }
}

static void names_and_times_are_kept(void **unused)
{
    (void)unused;
    static const struct {
        const char *name, *read;
        int64_t start_ns, end_ns, frame;
        double ts, dur;
    } rows[] = {
        {"sample", "sample", 0, 0, 0, 0, 0},
        {"a\"b\\c\n\x01", "a\"b\\c\n\x01", 1, 1000, -1, 0.001, 0.999},
        {"\xff\xc3\xa9", "\xEF\xBF\xBD\xc3\xa9", 1999, 12345678, 7, 1.999, 12343.679},
        {NULL, "", 86400 * (int64_t)1000000000, 86400 * (int64_t)1000000000 + 1, INT64_MAX, 86400e6, 0.001},
        {"ends before it begins", "ends before it begins", 500, 400, 1, 0.5, 0},
        {"before the clock", "before the clock", -500, 400, 1, 0, 0.9},
    };
    enum { ROWS = sizeof rows / sizeof rows[0] };
    struct fv_trace *trace = fv_trace_create(1);
    for (int i = 0; i < ROWS; i++)
        fv_trace_add(trace, 0, rows[i].name, rows[i].frame, rows[i].start_ns, rows[i].end_ns);
    fv_trace_add(NULL, 0, "nowhere", 0, 0, 1);
    json_t *root = write_and_read(trace, NULL), *events = json_object_get(root, "traceEvents");
    assert_int_equal(check_events(root).spans, ROWS);
    for (int i = 0; i < ROWS; i++) {
        json_t *event = json_array_get(events, (size_t)i + 3);
        assert_string_equal(text_at(event, "name"), rows[i].read);
        assert_true(fabs(number_at(event, "ts") - rows[i].ts) < 1e-4);
        assert_true(fabs(number_at(event, "dur") - rows[i].dur) < 1e-9);
        assert_true(json_integer_value(json_object_get(json_object_get(event, "args"), "frame")) ==
                    rows[i].frame);
    }
    assert_string_equal(text_at(json_object_get(json_array_get(events, 0), "args"), "name"), "foveola");
    assert_string_equal(text_at(json_object_get(json_array_get(events, 1), "args"), "name"), "worker 0");
    json_decref(root);
}

/* Frame f has the numbers f, f / 2 and one that is none in odd frames; from frame `context` on there is
 * no record. */
static bool read_counters(const void *context, int64_t frame, double value[FV_COUNTERS_MAX])
{
    if (frame >= *(const int64_t *)context) return false;
    value[0] = (double)frame;
    value[1] = 0.5 * (double)frame;
    value[2] = frame % 2 ? (frame % 4 == 1 ? (double)NAN : (double)INFINITY) : 1;
    return true;
}

/* A ring that went round keeps the newest spans, each whole; every frame of which there is one is counted
 * once, where its first span left begins. */
static void counters_follow_the_frames_kept(void **unused)
{
    (void)unused;
    enum { STAGES = 5, FRAMES = FV_TRACE_SPANS / STAGES + 100 };
    static const int64_t limits[] = {FRAMES, FRAMES - 10, 0};
    const char *stages[STAGES] = {"select", "support", "reproject", "sample", "present"};
    struct fv_trace *trace = fv_trace_create(2);
    for (int64_t f = 0; f < FRAMES; f++)
        for (int k = 0; k < STAGES; k++)
            for (int w = 0; w < 2; w++)
                fv_trace_add(trace, w, stages[k], f, (f * 10 + k) * 1000, (f * 10 + k + 1) * 1000);
    int64_t added = (int64_t)STAGES * FRAMES, first_frame = (added - FV_TRACE_SPANS) / STAGES;
    for (int l = 0; l < 3; l++) {
        const struct fv_counters counters = {3, {"level", "a\"b", "odd"}, read_counters, &limits[l]};
        json_t *root = write_and_read(trace, &counters), *event;
        struct counts counts = check_events(root);
        int64_t counted = limits[l] > first_frame ? limits[l] - first_frame : 0, expected = first_frame;
        int evens = 0;
        for (int64_t f = first_frame; f < limits[l]; f++) evens += f % 2 == 0;
        assert_int_equal(counts.spans, 2 * FV_TRACE_SPANS);
        assert_int_equal(counts.samples, 2 * counted + evens);
        size_t i;
        json_array_foreach(json_object_get(root, "traceEvents"), i, event)
        {
            if (text_at(event, "ph")[0] != 'C' || strcmp(text_at(event, "name"), "level") != 0) continue;
            assert_true(number_at(json_object_get(event, "args"), "value") == (double)expected);
            double late = number_at(event, "ts") - 10.0 * (double)expected;
            assert_true(expected == first_frame ? late >= 0 && late < STAGES : late == 0);
            expected++;
        }
        assert_int_equal(expected, first_frame + counted);
        json_decref(root);
    }
}

/* A run: each frame has each stage once on the first worker, and one sample of each counter. */
static void a_run_traces_its_frames(void **unused)
{
    (void)unused;
    enum { FRAMES = 6, NAMES = 9 };
    static const char *const names[NAMES] = {"select",  "support", "reproject", "sample",   "present",
                                             "control", "level",   "sampled %", "cut tiles"};
    int seen[NAMES][FRAMES] = {{0}}, counted = 0;
    char path[128];
    struct program_result r =
        program("run --frames %d --set scene.name=cornell --set display.headset=small --out run", FRAMES);
    assert_int_equal(r.code, 0);
    snprintf(path, sizeof path, "%s/run/trace.json", program_folder());
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, NULL), *event;
    assert_non_null(root);
    check_events(root);
    size_t i;
    json_array_foreach(json_object_get(root, "traceEvents"), i, event)
    {
        json_t *frame = json_object_get(json_object_get(event, "args"), "frame");
        bool counter = text_at(event, "ph")[0] == 'C';
        if ((!frame && !counter) || number_at(event, "tid") != 0) continue;
        for (int k = 0; k < NAMES; k++) {
            if (strcmp(text_at(event, "name"), names[k]) != 0) continue;
            int64_t n = counter ? counted++ / 3 : json_integer_value(frame);
            assert_in_range(n, 0, FRAMES - 1);
            seen[k][n]++;
        }
    }
    for (int k = 0; k < NAMES; k++)
        for (int n = 0; n < FRAMES; n++)
            if (seen[k][n] != 1) fail_msg("%s is there %d times in frame %d", names[k], seen[k][n], n);
    json_decref(root);
}

static void a_full_disk_is_an_error(void **unused)
{
    (void)unused;
    char path[128];
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: no /dev/full here\n");
        return;
    }
    snprintf(path, sizeof path, "%s/full.part", program_folder());
    assert_int_equal(symlink("/dev/full", path), 0);
    snprintf(path, sizeof path, "%s/full", program_folder());
    assert_int_equal(fv_trace_write(fv_trace_create(1), NULL, path, &error), -1);
    assert_non_null(strstr(error.text, "No space left"));
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_trace_is_valid),  cmocka_unit_test(spans_of_any_worker_are_valid),
        cmocka_unit_test(names_and_times_are_kept), cmocka_unit_test(counters_follow_the_frames_kept),
        cmocka_unit_test(a_run_traces_its_frames),  cmocka_unit_test(a_full_disk_is_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
