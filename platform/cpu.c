/* cpu: instruction sets by the compiler's run-time tests, the name from /proc/cpuinfo. */
#include "platform/cpu.h"

#include <fcntl.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

enum fv_isa fv_cpu_isa(void)
{
#ifdef __x86_64__
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512cd"))
        return FV_ISA_AVX512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return FV_ISA_AVX2;
#endif
    return FV_ISA_BASE;
}

const char *fv_cpu_isa_name(enum fv_isa isa)
{
#ifdef __x86_64__
    static const char *const names[FV_ISA_COUNT] = {"sse4.2", "avx2", "avx512"};
#else
    static const char *const names[FV_ISA_COUNT] = {"neon", "avx2", "avx512"};
#endif
    return names[isa];
}

const char *fv_cpu_name(void)
{
    static char text[4096];
    int fd = open("/proc/cpuinfo", O_RDONLY | O_CLOEXEC);
    if (fd < 0) return "unknown";
    ssize_t n = read(fd, text, sizeof text - 1);
    close(fd);
    text[n > 0 ? n : 0] = 0;
    char *name = strstr(text, "model name");
    if (!name || !(name = strchr(name, ':'))) return "unknown";
    name += strspn(name, ": \t");
    name[strcspn(name, "\n")] = 0;
    return name;
}
