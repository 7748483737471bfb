/* lens: from the display's pixels to directions, through the lens between display and eye.
 *
 * Without distortion a pixel's direction is linear in its coordinates: a pinhole's picture. A radial lens bends it
 * about its optical centre. With r the distance from there, in units that make r the tangent of the angle near the
 * axis, the tangent seen is
 *
 *     t(r) = r (1 + k1 r^2 + k2 r^4 + k3 r^6),
 *
 * the even polynomial of Brown (1966) in the direction that Oculus's SDK documents for the Rift: from the display
 * to the angle. It is the same all around the axis, so that a lens is two maps between pictures:
 *
 *   straight  a display's pixel -> where a pinhole of the same axis, centre and density there would show it
 *   bent      its inverse
 *
 * and all that knows a pinhole's picture (view.h) goes on with straight coordinates. Up to `most`, t grows, no slower
 * than FV_LENS_SLOPE times as fast as at the axis. Beyond it nothing is traced, and the lens counts as even, of the
 * scale t(most) / most: both maps hold everywhere, so that no degenerate case is left to those who call. */
#ifndef FV_FOVEA_LENS_H
#define FV_FOVEA_LENS_H

#include <stdbool.h>

enum { FV_LENS_TERMS = 3, FV_LENS_STEPS = 256 };

#define FV_LENS_SLOPE 0.05

/* Directions farther from the axis are none: tan 88 degrees. */
#define FV_LENS_TANGENT_MAX 28.6

/* A channel's tangents against green's: t (c0 + c1 r^2). */
struct fv_lens_channel {
    double c0, c1;
};

/* Radial distortion of one eye's picture. All zero: none. Set by fv_bend_set alone. */
struct fv_bend {
    bool on;
    bool masks;                 /* some pixels of the picture show nothing */
    bool fringes;               /* red or blue differs from green */
    float centre[2], step[2];   /* px; r of a pixel along x and y */
    float k[FV_LENS_TERMS];
    float shown, most;          /* r: up to which the eye sees something; and is traced: for red and blue, and their neighbours */
    float least, widest;        /* how much the picture is stretched at least anywhere, and at most */
    float widest_angle;         /* of a pixel's angle, against that at the axis, at most */
    struct fv_lens_channel channel[2]; /* red, blue */
};

struct fv_lens_settings {
    double centre_px[2], unit_px;  /* optical centre; pixels of r = 1 */
    double k[FV_LENS_TERMS];
    double visible_deg;            /* angle from the axis beyond which the eye sees nothing */
    struct fv_lens_channel channel[2];
    int width, height;             /* px */
};

/* Any finite settings with a unit above 0. */
void fv_bend_set(struct fv_bend *bend, const struct fv_lens_settings *settings);

/* t(r) / r at r^2, which counts as at most most^2. */
static inline float fv_bend_scale(const struct fv_bend *b, float square)
{
    float end = b->most * b->most, q = square < end ? square : end;
    return 1 + q * (b->k[0] + q * (b->k[1] + q * b->k[2]));
}

/* r^2 of a display's pixel. */
static inline float fv_bend_square(const struct fv_bend *b, float x, float y)
{
    float u = (x - b->centre[0]) * b->step[0], v = (y - b->centre[1]) * b->step[1];
    return u * u + v * v;
}

/* Display to pinhole. Finite pixels. */
static inline void fv_bend_straight(const struct fv_bend *b, float x, float y, float to[2])
{
    float scale = fv_bend_scale(b, fv_bend_square(b, x, y));
    to[0] = b->centre[0] + (x - b->centre[0]) * scale;
    to[1] = b->centre[1] + (y - b->centre[1]) * scale;
}

/* Pinhole to display, to rounding. Finite pixels. */
void fv_bend_bent(const struct fv_bend *bend, const double from[2], double to[2]);

/* The r at which tangent t >= 0 is seen; beyond `most`, as said above. */
double fv_bend_radius(const struct fv_bend *bend, double t);

/* The affine map that touches `straight` at (x, y): straight is about a[i][0] x + a[i][1] y + a[i][2]. */
void fv_bend_tangent(const struct fv_bend *bend, double x, double y, double a[2][3]);

/* Where a channel (0 red, 1 blue) of a pixel at radius r is found in green's picture: at r times this. */
double fv_bend_fringe(const struct fv_bend *bend, int channel, double r);

/* Columns of row y that show something: [from, to), within [0, width]. */
void fv_bend_row(const struct fv_bend *bend, int y, int width, int *from, int *to);

/* Of a rectangle of pixels, whether none is traced, whose centres lie farther out than `most` and `margin` pixels. */
bool fv_bend_beyond(const struct fv_bend *bend, float x0, float y0, float x1, float y1, float margin);

#endif
