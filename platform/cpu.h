/* cpu: which instruction set to run. Kernels are compiled once for each and chosen here. */
#ifndef FV_PLATFORM_CPU_H
#define FV_PLATFORM_CPU_H

#include <stddef.h>

enum fv_isa {
    FV_ISA_BASE,   /* x86-64 with SSE4.2, or NEON: 4 lanes */
    FV_ISA_AVX2,   /* AVX2, FMA, F16C: 8 lanes */
    FV_ISA_AVX512, /* AVX-512 F, DQ, BW, VL, CD: 16 lanes */
    FV_ISA_COUNT
};

/* The widest set that this CPU and its kernel support. */
enum fv_isa fv_cpu_isa(void);

/* "neon" or "sse4.2", "avx2", "avx512". */
const char *fv_cpu_isa_name(enum fv_isa isa);

/* The CPU's name, "unknown" where the kernel gives none. Static string. */
const char *fv_cpu_name(void);

/* The same from the text of /proc/cpuinfo, cut to `size` bytes: what it says, or, as on ARM it says numbers, the kinds
 * of cores in the order in which they come: "Cortex-A55, Cortex-A76". */
void fv_cpu_name_in(const char *cpuinfo, char *name, size_t size);

#endif
