/* faults: see faults.h. */
#define _GNU_SOURCE
#include "platform/faults.h"

#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

#ifdef FV_HEAP

static void (*_Atomic at_fault)(void);

/* The kernel has set the signal back to its default by now: a fault that is returned to happens again, and abort raises
 * its signal once more. What was sent would not come again. */
static void on_fault(int number, siginfo_t *info, void *context)
{
    (void)context;
    void (*function)(void) = atomic_exchange(&at_fault, NULL);
    if (function) function();
    bool again = number == SIGABRT ? info->si_pid == getpid() : number != SIGQUIT && info->si_code > 0;
    if (!again) _exit(128 + number);
}

void fv_faults_call(void (*function)(void))
{
    static const int signals[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT};
    static bool heeded;
    struct sigaction action = {.sa_sigaction = on_fault, .sa_flags = SA_SIGINFO | SA_RESETHAND};
    atomic_store(&at_fault, function);
    for (size_t i = 0; function && !heeded && i < sizeof signals / sizeof signals[0]; i++) sigaction(signals[i], &action, NULL);
    heeded |= function != NULL;
}

#else

void fv_faults_call(void (*function)(void))
{
    (void)function;
}

#endif
