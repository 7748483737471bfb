/* world: see world.h. */
#define _GNU_SOURCE
#include "tests/soak/world.h"

#include "platform/clock.h"
#include "platform/threads.h"

#include <errno.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ACTORS = 6 };
static const int64_t read_cost_ns = 2000; /* of a look at the clock by the main thread, which is what its work takes */

static struct actor {
    const char *name;
    bool live;
    int64_t wake_ns, held_ns; /* held_ns: not before then */
    int64_t cpu_ns;
    sem_t turn;
    void *(*function)(void *context);
    void *context;
} actor[ACTORS];
static int actors, running;
static int64_t time_ns, fate_ns;
static int64_t (*fate_of)(int64_t now_ns);

void world_begin(void)
{
    actor[0] = (struct actor){.name = "main", .live = true};
    sem_init(&actor[0].turn, 0, 0);
    actors = 1;
    time_ns = 1000000000000;
    fate_ns = INT64_MAX;
}

void world_fate(int64_t (*fate)(int64_t now_ns), int64_t first_ns)
{
    fate_of = fate;
    fate_ns = first_ns;
}

int64_t world_now_ns(void)
{
    return time_ns;
}

static int64_t due_ns(const struct actor *a)
{
    return a->wake_ns > a->held_ns ? a->wake_ns : a->held_ns;
}

static int first_of_all(void)
{
    int first = -1;
    for (int i = 0; i < actors; i++)
        if (actor[i].live && (first < 0 || due_ns(&actor[i]) < due_ns(&actor[first]))) first = i;
    return first;
}

static void await_turn(struct actor *a)
{
    while (sem_wait(&a->turn) != 0 && errno == EINTR) {
    }
}

/* Lets whoever is next go on; returns who that is. */
static int go_on(void)
{
    int next = first_of_all();
    while (fate_of && fate_ns <= due_ns(&actor[next])) {
        if (fate_ns > time_ns) time_ns = fate_ns;
        fate_ns = fate_of(time_ns);
        next = first_of_all();
    }
    if (due_ns(&actor[next]) > time_ns) time_ns = due_ns(&actor[next]);
    return next;
}

void world_wait_ns(int64_t until_ns)
{
    int self = running;
    actor[self].wake_ns = until_ns;
    int next = go_on();
    if (next == self) return;
    running = next;
    sem_post(&actor[next].turn);
    await_turn(&actor[self]);
}

void world_hold_ns(const char *name, int64_t for_ns)
{
    for (int i = 0; i < actors; i++)
        if (strcmp(actor[i].name, name) == 0) actor[i].held_ns = time_ns + for_ns;
}

void world_stand_still_ns(int64_t for_ns)
{
    time_ns += for_ns;
}

static int64_t clock_now_ns(void *context)
{
    (void)context;
    if (running == 0) time_ns += read_cost_ns, actor[0].cpu_ns += read_cost_ns;
    return time_ns;
}

int64_t fv_clock_thread_ns(void)
{
    return actor[running].cpu_ns;
}

static int64_t clock_thread_ns(void *context)
{
    (void)context;
    return fv_clock_thread_ns();
}

static void clock_sleep_until_ns(void *context, int64_t t_ns)
{
    (void)context;
    world_wait_ns(t_ns);
}

const struct fv_clock fv_clock_monotonic = {clock_now_ns, clock_thread_ns, clock_sleep_until_ns, NULL};

/* In the place of the system's and the house's own, by the linker. */
int __wrap_nanosleep(const struct timespec *for_so_long, struct timespec *left);
int __wrap_pause(void);
int __real_pause(void);
int __real_fv_thread_start(pthread_t *thread, const char *name, enum fv_urgency urgency, void *(*function)(void *),
                           void *context, struct fv_error *error);
int __wrap_fv_thread_start(pthread_t *thread, const char *name, enum fv_urgency urgency, void *(*function)(void *),
                           void *context, struct fv_error *error);

int __wrap_nanosleep(const struct timespec *for_so_long, struct timespec *left)
{
    (void)left;
    world_wait_ns(time_ns + (int64_t)for_so_long->tv_sec * 1000000000 + for_so_long->tv_nsec);
    return 0;
}

/* A thread that is done sleeps for good. */
int __wrap_pause(void)
{
    actor[running].live = false;
    int next = go_on();
    running = next;
    sem_post(&actor[next].turn);
    for (;;) __real_pause();
}

static void *enter(void *context)
{
    struct actor *a = context;
    await_turn(a);
    return a->function(a->context);
}

int __wrap_fv_thread_start(pthread_t *thread, const char *name, enum fv_urgency urgency, void *(*function)(void *),
                           void *context, struct fv_error *error)
{
    struct actor *a = &actor[actors];
    if (actors == ACTORS) abort();
    *a = (struct actor){.name = name, .live = true, .wake_ns = time_ns, .function = function, .context = context};
    sem_init(&a->turn, 0, 0);
    int failed = __real_fv_thread_start(thread, name, urgency, enter, a, error);
    actors += !failed;
    return failed;
}
