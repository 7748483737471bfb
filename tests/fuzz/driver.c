/* driver: runs a fuzz target without libFuzzer: every file of its corpus, then inputs made from them by
 * truncation, flipped bits, copied and inserted pieces, from a fixed seed. The short form that ctest runs;
 * with -DFV_FUZZER=ON under clang the same targets are linked with libFuzzer for long runs. */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { FILES_MAX = 256, INPUT_MAX = 1 << 16, ROUNDS = 3000 };

static uint8_t *corpus[FILES_MAX];
static size_t sizes[FILES_MAX];

static uint32_t next(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static int read_corpus(const char *folder)
{
    int n = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; d && n < FILES_MAX && (e = readdir(d));) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        FILE *f = e->d_name[0] == '.' ? NULL : fopen(path, "rb");
        if (!f) continue;
        corpus[n] = malloc(INPUT_MAX);
        sizes[n] = fread(corpus[n], 1, INPUT_MAX, f);
        fclose(f);
        n++;
    }
    if (d) closedir(d);
    return n;
}

static size_t mutate(uint8_t *out, int files, uint32_t *state)
{
    int pick = (int)(next(state) % (uint32_t)files);
    size_t size = sizes[pick];
    memcpy(out, corpus[pick], size);
    for (uint32_t k = next(state) % 8; k > 0 && size > 0; k--) {
        size_t at = next(state) % size, from = next(state) % size, length = 1 + next(state) % 16;
        switch (next(state) % 5) {
        case 0: out[at] ^= (uint8_t)(1u << next(state) % 8); break;
        case 1: out[at] = (uint8_t)next(state); break;
        case 2: size = at; break;
        case 3:
            if (at + length <= size && from + length <= size) memmove(out + at, out + from, length);
            break;
        default:
            if (size + length <= INPUT_MAX) {
                memmove(out + at + length, out + at, size - at);
                size += length;
            }
        }
    }
    return size;
}

int main(int count, char **text)
{
    uint32_t state = 1;
    int files = count > 1 ? read_corpus(text[1]) : 0;
    if (files == 0) {
        fprintf(stderr, "no corpus in %s\n", count > 1 ? text[1] : "(none named)");
        return 1;
    }
    for (int i = 0; i < files; i++) LLVMFuzzerTestOneInput(corpus[i], sizes[i]);
    uint8_t *input = malloc(INPUT_MAX);
    for (int i = 0; i < ROUNDS; i++) {
        size_t size = mutate(input, files, &state);
        uint8_t *exact = malloc(size ? size : 1); /* its own block, so that the sanitizer sees its end */
        memcpy(exact, input, size);
        LLVMFuzzerTestOneInput(exact, size);
        free(exact);
    }
    free(input);
    printf("%d files, %d mutated inputs\n", files, ROUNDS);
    return 0;
}
