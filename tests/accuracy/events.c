/* events: the online classification of gaze against two human coders, sample by sample: Cohen's kappa of
 * saccades (Cohen 1960), by kind of stimulus, beside that of the coders with each other. */
#include "sensors/eye/gaze_events.h"

#include "tests/support/program.h"

#include <dirent.h>
#include <math.h>

#define RECORDINGS FV_SOURCE_DIR "/../shared/data/gaze/andersson2017"
enum { SAMPLES = 1 << 16, CODERS = 2 };
/* The coders' numbers: 1 fixation, 2 saccade, 3 swing after one, 4 pursuit, 5 blink, 6 undefined. */
enum { CODED_SACCADE = 2, CODED_PURSUIT = 4, CODED_BLINK = 5 };
static const double must_reach = 0.7;

/* How often two agree that it is, and is not; and disagree. */
struct agreement {
    double both, first, second, neither;
};

static double kappa(const struct agreement *a)
{
    double n = a->both + a->first + a->second + a->neither, same = (a->both + a->neither) / n;
    double yes = (a->both + a->first) * (a->both + a->second),
           no = (a->neither + a->first) * (a->neither + a->second);
    double chance = (yes + no) / (n * n);
    return chance < 1 ? (same - chance) / (1 - chance) : 1;
}

static void count(struct agreement *a, bool one, bool other)
{
    *(one ? other ? &a->both : &a->first : other ? &a->second : &a->neither) += 1;
}

struct kind {
    const char *prefix;
    int recordings;
    struct agreement saccade[CODERS], pursuit[CODERS], blink[CODERS], humans;
};

static void add_recording(struct kind *kind, const char *path)
{
    static int coded[SAMPLES][CODERS];
    struct fv_gaze_events events = {0};
    double width, height, rate, screen[4], deg_per_px = 0, t, x, y;
    char line[256];
    int n = 0, told = 0;
    FILE *f = fopen(path, "r");
    if (!f || !fgets(line, sizeof line, f)) fail_msg("%s: cannot be read", path);
    if (sscanf(line, "# fs=%lf screen_px=%lfx%lf screen_m=%lfx%lf view_m=%lf deg_per_px=%lf", &rate, &width,
               &height, &screen[0], &screen[1], &screen[2], &deg_per_px) != 7)
        fail_msg("%s: %s", path, line);
    while (n < SAMPLES && fgets(line, sizeof line, f)) {
        int64_t told_ns;
        if (sscanf(line, "%lf,%lf,%lf,%d,%d", &t, &x, &y, &coded[n][0], &coded[n][1]) != 5) continue;
        bool valid = !(x == 0 && y == 0) && isfinite(x + y);
        enum fv_gaze_event event =
            fv_gaze_events_add(&events, llround(n * 1e9 / rate), (x - 0.5 * width) * deg_per_px,
                               -(y - 0.5 * height) * deg_per_px, valid, &told_ns);
        n++;
        if (event == FV_EVENT_NONE) continue;
        told = (int)llround((double)told_ns * rate * 1e-9);
        for (int c = 0; c < CODERS; c++) {
            count(&kind->saccade[c], event == FV_EVENT_SACCADE, coded[told][c] == CODED_SACCADE);
            count(&kind->pursuit[c], event == FV_EVENT_PURSUIT, coded[told][c] == CODED_PURSUIT);
            count(&kind->blink[c], event == FV_EVENT_BLINK, coded[told][c] == CODED_BLINK);
        }
        count(&kind->humans, coded[told][0] == CODED_SACCADE, coded[told][1] == CODED_SACCADE);
    }
    fclose(f);
    kind->recordings++;
}

static void recordings(void **state)
{
    (void)state;
    static struct kind kinds[] = {{.prefix = "dots"}, {.prefix = "img"}, {.prefix = "video"}};
    DIR *folder = opendir(RECORDINGS);
    if (!folder) {
        print_message("no recordings in %s: skipped\n", RECORDINGS);
        skip();
    }
    for (struct dirent *entry = readdir(folder); entry; entry = readdir(folder))
        for (unsigned i = 0; i < 3; i++) {
            char path[512];
            if (strncmp(entry->d_name, kinds[i].prefix, strlen(kinds[i].prefix)) != 0) continue;
            snprintf(path, sizeof path, RECORDINGS "/%s", entry->d_name);
            add_recording(&kinds[i], path);
        }
    closedir(folder);
    print_message("\nkappa with the coders   saccade         humans   pursuit         blink\n");
    for (unsigned i = 0; i < 3; i++) {
        struct kind *k = &kinds[i];
        print_message("%-8s %2d recordings  %.3f  %.3f   %.3f    %.3f  %.3f    %.3f  %.3f\n", k->prefix,
                      k->recordings, kappa(&k->saccade[0]), kappa(&k->saccade[1]), kappa(&k->humans),
                      kappa(&k->pursuit[0]), kappa(&k->pursuit[1]), kappa(&k->blink[0]), kappa(&k->blink[1]));
    }
    for (unsigned i = 0; i < 3; i++)
        for (int c = 0; c < CODERS; c++)
            if (!(kappa(&kinds[i].saccade[c]) >= must_reach))
                fail_msg("%s, coder %d: %.3f", kinds[i].prefix, c, kappa(&kinds[i].saccade[c]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(recordings)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
