/* Decisions of a recording: what is written reads back; every file that cannot be followed is named with its
 * line. */
#include "cli/decisions.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

static const char *const stages[] = {"select", "support", "reproject", "sample"};
static const struct fv_decisions_of of_three = {
    .stage = stages, .stages = 4, .levels = 9, .tiles = 100, .frames = 3};

#define FIRST "# foveola decisions 1\n"
#define NAMES FIRST "t_ns,level,select,support,reproject,sample\n"
#define LATE FIRST "t_ns,level,late_ns,select,support,reproject,sample\n"
#define OTHER FIRST "t_ns,level,sample_all\n"

static int parse(const char *text, size_t size, const struct fv_decisions_of *of, struct fv_decision *out,
                 struct fv_error *error)
{
    char *copy = malloc(size + 1); /* so that the sanitizer sees every step over the end */
    memcpy(copy, text, size);
    copy[size] = 0;
    error->text[0] = 0;
    int checked = fv_decisions_parse("d.csv", copy, size, of, NULL, error);
    int result = fv_decisions_parse("d.csv", copy, size, of, out, error);
    free(copy);
    assert_int_equal(checked, result);
    return result;
}

static void good_files_are_followed(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        struct fv_decision row[3];
    } cases[] = {
        {NAMES "0,0,-1,-1,-1,-1\n1,8,-1,0,100,7\n1000000000000000,3,-1,-1,-1,99\n",
         {{0, 0, {-1, -1, -1, -1}, 0}, {1, 8, {-1, 0, 100, 7}, 0}, {1000000000000000, 3, {-1, -1, -1, 99}, 0}}},
        {FIRST
         "t_ns,level,select,support,reproject,sample\r\n0,0,-1,-1,-1,-1\r\n7,1,-1,-1,-1,-1\r\n8,0,-1,-1,-1,5",
         {{0, 0, {-1, -1, -1, -1}, 0}, {7, 1, {-1, -1, -1, -1}, 0}, {8, 0, {-1, -1, -1, 5}, 0}}},
        /* Nothing but times: any method follows them. */
        {LATE "0,0,0,-1,-1,-1,-1\n1,8,7,-1,0,100,7\n8,3,1000000000000000,-1,-1,-1,99",
         {{0, 0, {-1, -1, -1, -1}, 0}, {1, 8, {-1, 0, 100, 7}, 7}, {8, 3, {-1, -1, -1, 99}, 1000000000000000}}},
        {FIRST "t_ns,level,late_ns,sample_all\n5,0,0,-1\n6,0,8,-1\n9,0,0,-1\n",
         {{5, 0, {-1, -1, -1, -1}, 0}, {6, 0, {-1, -1, -1, -1}, 8}, {9, 0, {-1, -1, -1, -1}, 0}}},
        {OTHER "5,0,-1\n6,0,-1\n9,0,-1\n",
         {{5, 0, {-1, -1, -1, -1}, 0}, {6, 0, {-1, -1, -1, -1}, 0}, {9, 0, {-1, -1, -1, -1}, 0}}},
        {FIRST
         "t_ns,level,a,b,c,d,e,f,g,h,i,j,k,l,m,n,o,p\n5,0,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1\n"
         "6,0,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1\n7,0,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,-1,"
         "-1,-1\n",
         {{5, 0, {-1, -1, -1, -1}, 0}, {6, 0, {-1, -1, -1, -1}, 0}, {7, 0, {-1, -1, -1, -1}, 0}}},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_decision row[3];
        struct fv_error error;
        if (parse(cases[i].text, strlen(cases[i].text), &of_three, row, &error)) fail_msg("%s", error.text);
        for (int n = 0; n < 3; n++) {
            assert_true(row[n].t_ns == cases[i].row[n].t_ns && row[n].level == cases[i].row[n].level);
            assert_int_equal(row[n].late_ns, cases[i].row[n].late_ns);
            for (int k = 0; k < FV_STAGES_MAX; k++)
                assert_int_equal(row[n].done[k], k < 4 ? cases[i].row[n].done[k] : -1);
        }
    }
}

static const char *const good = "1,0,-1,-1,-1,-1\n2,0,-1,-1,-1,-1\n3,0,-1,-1,-1,-1\n";

static void bad_files_are_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *message;
    } cases[] = {
        {"", "d.csv:1: not decisions of a version that is known; must be '# foveola decisions 1'"},
        {"# foveola decisions 2\n", "d.csv:1: not decisions"},
        {"# foveola decisions 10\n", "d.csv:1: not decisions"},
        {"# foveola head 1\n", "d.csv:1: not decisions"},
        {"\x89PNG\r\n\x1a\n", "d.csv:1: not decisions"},
        {FIRST, "d.csv:2: column names are missing; must be t_ns,level and 1 to 18 stages"},
        {FIRST "\n", "d.csv:2: column names"},
        {FIRST "t_ns,level\n", "d.csv:2: column names"},
        {FIRST "level,t_ns,select\n", "d.csv:2: column names"},
        {FIRST "t_ns,level,a,b,c,d,e,f,g,h,i,j,k,l,m,n,o,p,q,r,s\n", "d.csv:2: column names"},
        {FIRST ",,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,\n", "d.csv:2: column names"},
        {NAMES, "d.csv:2: fewer rows than the 3 frames that were recorded"},
        {NAMES "1,0,-1,-1,-1,-1\n2,0,-1,-1,-1,-1\n", "d.csv:4: fewer rows"},
        {NAMES "1,0,-1,-1,-1,-1\n2,0,-1,-1,-1,-1\n3,0,-1,-1,-1,-1\n4,0,-1,-1,-1,-1\n", "d.csv:6: more rows"},
        {NAMES "1,0,-1,-1,-1,-1\n2,0,-1,-1,-1,-1\n3,0,-1,-1,-1,-1\n\n", "d.csv:6: more rows"},
        {FIRST "t_ns,level,late_ns\n", "d.csv:2: fewer rows"}, /* a stage of that name */
        {FIRST "t_ns,level,late_ns,\n1,0,-1\n", "d.csv:3: late_ns is neither 0 nor a time"},
        {LATE "1,0,-1,-1,-1,-1\n", "d.csv:3: late_ns is neither 0 nor a time"},
        {LATE "5,0,5,-1,-1,-1,-1\n", "d.csv:3: late_ns is neither 0 nor a time"},
        {LATE "5,0,1000000000000001,-1,-1,-1,-1\n", "d.csv:3: late_ns is neither 0 nor a time"},
        {LATE "5,0,9,-1,-1,-1,-1\n9,0,0,-1,-1,-1,-1\n", "d.csv:4: t_ns is no time"},
        {NAMES "\n", "d.csv:3: t_ns is no time"},
        {NAMES "soon,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES "-1,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES "1.5,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES " 1,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES "1000000000000001,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES "99999999999999999999,0,-1,-1,-1,-1\n", "d.csv:3: t_ns is no time"},
        {NAMES "5,0,-1,-1,-1,-1\n5,0,-1,-1,-1,-1\n", "d.csv:4: t_ns is no time in ns behind the one before"},
        {NAMES "5,0,-1,-1,-1,-1\n4,0,-1,-1,-1,-1\n", "d.csv:4: t_ns is no time"},
        {NAMES "5", "d.csv:3: t_ns is no time"},
        {NAMES "5,", "d.csv:3: the level"},
        {NAMES "5,-1,-1,-1,-1,-1\n", "d.csv:3: the level is not a number from 0 on"},
        {NAMES "5,9,-1,-1,-1,-1\n", "d.csv:3: level 9; must be 0 to 8"},
        {NAMES "5,2147483647,-1,-1,-1,-1\n", "d.csv:3: level 2147483647; must be 0 to 8"},
        {NAMES "5,2147483648,-1,-1,-1,-1\n", "d.csv:3: the level"},
        {NAMES "5,0,-1,-1,-1\n6,0,-1,-1,-1,-1\n",
         "d.csv:3: not 4 numbers of tiles, -1 for all, behind the level"},
        {NAMES "5,0,-1,-1,-1,-1,-1\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,-1,\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,-1,-2\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,-1,-1 \n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,-1,--1\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,-1,-\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,nan,-1\n", "d.csv:3: not 4 numbers of tiles"},
        {NAMES "5,0,-1,-1,101,-1\n", "d.csv:3: 101 tiles done of 100: not of pictures of this size"},
        {OTHER "5,1,-1\n", "d.csv:3: level and tiles of a method with other stages"},
        {OTHER "5,0,-1\n6,0,50\n", "d.csv:4: level and tiles of a method with other stages"},
        {FIRST "t_ns,level,select,support,reproject,sampled\n1,1,-1,-1,-1,-1\n",
         "d.csv:3: level and tiles of a"},
        {FIRST "t_ns,level,support,select,reproject,sample\n1,1,-1,-1,-1,-1\n",
         "d.csv:3: level and tiles of a"},
        {FIRST "t_ns,level,select,support,reproject,sample,present\n1,0,-1,-1,-1,-1,3\n",
         "d.csv:3: level and tiles"},
    };
    char text[4096];
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_decision row[3];
        struct fv_error error;
        if (parse(cases[i].text, strlen(cases[i].text), &of_three, row, &error) == 0)
            fail_msg("accepted: %s", cases[i].text);
        if (strncmp(error.text, cases[i].message, strlen(cases[i].message)) != 0 || strchr(error.text, '\n'))
            fail_msg("'%s' instead of '%s'", error.text, cases[i].message);
    }
    /* A zero byte anywhere is no number, name or line end. */
    int size = snprintf(text, sizeof text, "%s%s", NAMES, good);
    for (int at = 0; at < size - 1; at++) {
        struct fv_decision row[3];
        struct fv_error error;
        snprintf(text, sizeof text, "%s%s", NAMES, good);
        text[at] = 0;
        /* Names that are not this method's are taken where nothing was decided. */
        bool name = at >= (int)strlen(FIRST "t_ns,level,") && at < (int)strlen(NAMES) - 1 && NAMES[at] != ',';
        assert_int_equal(parse(text, (size_t)size, &of_three, row, &error), name ? 0 : -1);
    }
}

static void written_reads_back_with(bool late)
{
    enum { FRAMES = 5000 };
    static struct fv_writer w;
    static struct fv_decision written[FRAMES];
    const struct fv_decision *read;
    struct fv_error error;
    char path[256];
    uint64_t random = 4;
    int64_t t_ns = -1;
    snprintf(path, sizeof path, "%s/decisions.csv", program_folder());
    assert_int_equal(fv_writer_open(&w, path, &error), 0);
    fv_decisions_begin(&w, stages, 4, late);
    for (int n = 0; n < FRAMES; n++) {
        memset(written[n].done, -1, sizeof written[n].done);
        t_ns += 1 + (int64_t)(random_bits(&random) % 100000000000);
        written[n].t_ns = t_ns;
        written[n].late_ns = late && n % 3 == 0 ? t_ns + 1 + (int64_t)(random_bits(&random) % 1000) : 0;
        if (written[n].late_ns) t_ns = written[n].late_ns;
        written[n].level = (int32_t)(random_bits(&random) % 9);
        for (int k = 0; k < 4; k++) written[n].done[k] = (int32_t)(random_bits(&random) % 102) - 1;
        fv_decisions_write(&w, &written[n], 4, late);
    }
    assert_int_equal(fv_writer_close(&w, &error), 0);
    struct fv_decisions_of of = of_three;
    of.frames = FRAMES;
    if (fv_decisions_read(&read, path, &of, &error)) fail_msg("%s", error.text);
    for (int n = 0; n < FRAMES; n++) {
        assert_true(read[n].t_ns == written[n].t_ns && read[n].level == written[n].level);
        assert_int_equal(read[n].late_ns, written[n].late_ns);
        assert_memory_equal(read[n].done, written[n].done, sizeof read[n].done);
    }
    of.frames = INT64_MAX; /* nothing is taken for frames that are not there */
    assert_int_equal(fv_decisions_read(&read, path, &of, &error), -1);
    assert_non_null(strstr(error.text, "fewer rows"));
    assert_int_equal(fv_decisions_read(&read, "/nowhere/decisions.csv", &of, &error), -1);
    assert_non_null(strstr(error.text, "/nowhere/decisions.csv"));
}

static void written_reads_back(void **state)
{
    (void)state;
    written_reads_back_with(false);
    written_reads_back_with(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_files_are_followed),
        cmocka_unit_test(bad_files_are_named),
        cmocka_unit_test(written_reads_back),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
