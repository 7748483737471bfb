/* cpu: instruction sets by the compiler's run-time tests, the name from /proc/cpuinfo. On x86-64 that says it in words. */
#include "platform/cpu.h"

#include <fcntl.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
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

/* Numbers of cores: Linux, arch/arm64/include/asm/cputype.h. */
static const struct {
    unsigned implementer, part;
    const char *name;
} cores[] = {
    {0x41, 0xd03, "Cortex-A53"},  {0x41, 0xd04, "Cortex-A35"},  {0x41, 0xd05, "Cortex-A55"},  {0x41, 0xd07, "Cortex-A57"},
    {0x41, 0xd08, "Cortex-A72"},  {0x41, 0xd09, "Cortex-A73"},  {0x41, 0xd0a, "Cortex-A75"},  {0x41, 0xd0b, "Cortex-A76"},
    {0x41, 0xd0c, "Neoverse-N1"}, {0x41, 0xd0d, "Cortex-A77"},  {0x41, 0xd40, "Neoverse-V1"}, {0x41, 0xd41, "Cortex-A78"},
    {0x41, 0xd42, "Cortex-A78AE"}, {0x41, 0xd44, "Cortex-X1"},  {0x41, 0xd46, "Cortex-A510"}, {0x41, 0xd47, "Cortex-A710"},
    {0x41, 0xd48, "Cortex-X2"},   {0x41, 0xd49, "Neoverse-N2"}, {0x41, 0xd4d, "Cortex-A715"}, {0x41, 0xd4e, "Cortex-X3"},
    {0x41, 0xd80, "Cortex-A520"}, {0x41, 0xd81, "Cortex-A720"}, {0x41, 0xd82, "Cortex-X4"},
};

/* Adds a core's name where it is not there yet. */
static void add_core(char *name, size_t size, unsigned implementer, unsigned part)
{
    char core[32];
    snprintf(core, sizeof core, "core %02x:%03x", implementer, part);
    for (size_t i = 0; i < sizeof cores / sizeof cores[0]; i++)
        if (cores[i].implementer == implementer && cores[i].part == part) snprintf(core, sizeof core, "%s", cores[i].name);
    size_t length = strlen(core), used = strlen(name);
    for (const char *at = name; (at = strstr(at, core)) != NULL; at += length)
        if (at[length] == 0 || at[length] == ',') return;
    snprintf(name + used, size - used, "%s%s", used ? ", " : "", core);
}

/* The value of a line "KEY : VALUE", NULL where it is another. */
static const char *value_of(const char *line, const char *key)
{
    size_t length = strlen(key);
    if (strncmp(line, key, length) != 0) return NULL;
    line += length + strspn(line + length, " \t");
    return *line == ':' ? line + 1 + strspn(line + 1, " \t") : NULL;
}

void fv_cpu_name_in(const char *cpuinfo, char *name, size_t size)
{
    unsigned long implementer = 0;
    name[0] = 0;
    for (const char *line = cpuinfo; *line; line += strcspn(line, "\n"), line += *line == '\n') {
        const char *value;
        if ((value = value_of(line, "model name")) != NULL) {
            snprintf(name, size, "%.*s", (int)strcspn(value, "\n"), value);
            return;
        }
        if ((value = value_of(line, "CPU implementer")) != NULL) implementer = strtoul(value, NULL, 0);
        if ((value = value_of(line, "CPU part")) != NULL)
            add_core(name, size, (unsigned)implementer, (unsigned)strtoul(value, NULL, 0));
    }
    if (!name[0]) snprintf(name, size, "unknown");
}

const char *fv_cpu_name(void)
{
    static char text[1 << 14], name[256];
    if (name[0]) return name;
    int fd = open("/proc/cpuinfo", O_RDONLY | O_CLOEXEC);
    size_t used = 0;
    ssize_t n;
    while (fd >= 0 && (n = read(fd, text + used, sizeof text - 1 - used)) > 0) used += (size_t)n;
    if (fd >= 0) close(fd);
    text[used] = 0;
    fv_cpu_name_in(text, name, sizeof name);
    return name;
}
