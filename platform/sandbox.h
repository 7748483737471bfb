/* sandbox: what the program gives up once it runs: rights (capabilities), and all system calls but those that frames,
 * devices and the report at the end make.
 *
 * Each thread keeps to its own list (platform/sandbox_filter.c), by the kernel's seccomp: workers compute and open
 * nothing; threads of devices may open what is there, since cameras and sensors come and go, and make no file; the first
 * thread may make files for the report, where the kernel has Landlock (5.13) beneath the folder of the output only, and
 * neither opens what lies elsewhere than there and under /dev, /sys and /proc. None may open a socket, start a program or a
 * thread, type for a terminal, or get memory that can be executed. No right comes back (no_new_privs).
 *
 * A call that is not on its list ends the program with code 3 and one line that names the call and the thread.
 * Not in builds with sanitizers, which make calls of their own. */
#ifndef FV_PLATFORM_SANDBOX_H
#define FV_PLATFORM_SANDBOX_H

#include "platform/threads.h"

enum fv_sandbox_class {
    FV_SANDBOX_FIRST,  /* the thread that runs the loop, presents, records and reports; it is worker 0 */
    FV_SANDBOX_DEVICE, /* fv_thread_start */
    FV_SANDBOX_WORKER,
    FV_SANDBOX_CLASSES
};

enum { FV_SANDBOX_EXIT = 3 };

/* Whether threads of devices that are started from now on keep to their list from their beginning. Off before. */
void fv_sandbox_ask(bool on);

/* Whether all threads keep the right to give the text console back (CAP_SYS_TTY_CONFIG): a display took it, and the
 * kernel lets nobody else do so whose terminal it is not. To be said before threads of devices are started. */
void fv_sandbox_keep_console(bool on);

/* For fv_thread_start: the calling thread, where it was asked for. What the system refuses is told by fv_sandbox_seal. */
void fv_sandbox_enter_device(void);

/* The first thread and the workers, once all is open: nothing else is to be opened but in `out`, the folder that is written
 * into. Returns 0, and into `said` what was given up; -1: why not, and then frames run as they are. */
int fv_sandbox_seal(struct fv_workers *workers, const char *out, struct fv_error *said);

#endif
