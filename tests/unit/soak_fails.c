/* soak_fails: the soak (tests/soak) finds what it is there to find: with a fault of its own built in it fails, and says
 * by which seed, when and what. */
#include "tests/support/program.h"

/* hours, seed: in which the fault that it needs is dealt out. */
static void finds(const char *sabotage, const char *said)
{
    static char output[1 << 16];
    char command[512], path[128];
    snprintf(path, sizeof path, "%s/soak.txt", program_folder());
    snprintf(command, sizeof command, "cd %s && TMPDIR=. %s 0.05 1 %s >%s 2>&1", program_folder(), FV_SOAK, sabotage, path);
    int status = system(command);
    program_slurp(path, output, sizeof output);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 1) fail_msg("%s: exit code %d: %s", sabotage, status, output);
    if (!strstr(output, said)) fail_msg("%s: '%s' is not said: %s", sabotage, said, output);
    assert_non_null(strstr(output, "soak: seed 1, long, at "));
}

static void descriptor(void **state)
{
    (void)state;
    finds("descriptor", "descriptors are open, ");
}

static void memory(void **state)
{
    (void)state;
#ifdef FV_HEAP
    finds("memory", "kB of memory are resident, ");
#endif
}

static void counter(void **state)
{
    (void)state;
    finds("counter", "camera: frames flagged: ");
}

static void kept(void **state)
{
    (void)state;
    finds("keep", "camera: unplugged: not back 4 s after it was put right");
}

static void slow(void **state)
{
    (void)state;
    finds("slow", " ns a ray, ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(descriptor), cmocka_unit_test(memory), cmocka_unit_test(counter),
                                       cmocka_unit_test(kept), cmocka_unit_test(slow)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
