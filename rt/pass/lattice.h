/* lattice: what varies slowly over a tile, by eccentricity: taken at every 8th pixel, and interpolated. */
#ifndef FV_PASS_LATTICE_H
#define FV_PASS_LATTICE_H

#include "rt/pass/pass.h"

enum { FV_LATTICE_STEP = 8, FV_LATTICE = FV_TILE / FV_LATTICE_STEP + 1 };

typedef float fv_lattice[FV_LATTICE][FV_LATTICE];

/* Degrees. */
static inline void fv_lattice_eccentricity(const struct fv_frame *frame, const struct fv_tile *tile, fv_lattice e)
{
    for (int y = 0; y < FV_LATTICE; y++)
        for (int x = 0; x < FV_LATTICE; x++) {
            float px = (float)(tile->x0 + x * FV_LATTICE_STEP), py = (float)(tile->y0 + y * FV_LATTICE_STEP);
            e[y][x] = fv_eccentricity_deg(&frame->view[tile->eye], px, py);
        }
}

/* tau_fov at these eccentricities, as the level has it, times a factor. */
static inline void fv_lattice_tolerance(const struct fv_frame *frame, const fv_lattice e, float factor, fv_lattice tolerance)
{
    const struct fv_parameters *p = &frame->parameters;
    for (int y = 0; y < FV_LATTICE; y++)
        for (int x = 0; x < FV_LATTICE; x++)
            tolerance[y][x] = factor * p->tolerance * (p->even ? 1 : fv_tolerance_at(&frame->selective.tolerance, e[y][x]));
}

/* n values at (x, y), (x + 1, y), ...: pixels from the tile's first corner; beyond its last one by the last slope. */
static inline void fv_lattice_row(const fv_lattice lattice, float x, float y, int n, float *row)
{
    int cell = y < FV_TILE - FV_LATTICE_STEP ? (int)(y / FV_LATTICE_STEP) : FV_LATTICE - 2;
    float down = y / FV_LATTICE_STEP - (float)cell, side[FV_LATTICE];
    for (int i = 0; i < FV_LATTICE; i++) side[i] = lattice[cell][i] + down * (lattice[cell + 1][i] - lattice[cell][i]);
    for (int i = 0; i < n; i++) {
        float right = (x + (float)i) / FV_LATTICE_STEP;
        int at = right < FV_LATTICE - 2 ? (int)right : FV_LATTICE - 2;
        row[i] = side[at] + (right - (float)at) * (side[at + 1] - side[at]);
    }
}

#endif
