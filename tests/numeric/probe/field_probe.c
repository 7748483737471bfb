/* field_probe: see field_probe.h; compiled once for each instruction set. */
#include "tests/numeric/probe/field_probe.h"

#include "rt/trace/field_eval.h"

#define field_probe FV_ISA_NAME(fv_field_probe)

fv_field_probe field_probe;

void field_probe(const struct fv_fields *f, int first, int last, int n, const float *const at[3], float *out)
{
    for (int i = 0; i < n; i += FV_WIDTH) {
        vf least = vf_of(1e30f);
        vf3 p = {vf_load(at[0] + i), vf_load(at[1] + i), vf_load(at[2] + i)};
        for (int k = first; k <= last; k++)
            least = vf_min(field_part(f->code + f->part[k].first, f->part[k].count, p), least);
        vf_store(out + i, least);
    }
}
