/* glint: the LEDs' reflections in the cornea, near the pupil: their middle as one point that stays put where
 * a lid hides some of them.
 *
 * Spots are small and brighter than all around them. The LEDs stand still against each other, so their
 * reflections nearly do too: once all of them have been seen, each is known by its place about their middle,
 * and a part of them that fits these places tells the middle as well. Bounded, nothing is allocated. */
#ifndef FV_SENSORS_GLINT_H
#define FV_SENSORS_GLINT_H

#include "sensors/eye/pupil.h"

enum { FV_GLINTS_MAX = 16 /* spots looked at */, FV_GLINT_LEDS_MAX = 12 };

struct fv_glint {
    double x, y;     /* pixels, as the pupil's */
    double contrast; /* levels of grey above what is around */
};

/* The spots near a pupil that is found, those of most contrast first, faint ones beside it left out; returns
 * their number. A spot's middle is its centre of brightness. Looked for within 2.2 widths of the pupil, at
 * least 0.12 and at most 0.25 of the frame's longer side; of at most about 0.02 of that side in width. */
int fv_glint_spots(const struct fv_eye_frame *frame, const struct fv_pupil *pupil,
                   struct fv_glint spot[FV_GLINTS_MAX]);

/* The caller's; all 0 at the start but for leds: how many reflections there are, 1 to FV_GLINT_LEDS_MAX. */
struct fv_glint_ring {
    int leds;
    bool known;                         /* all of them have been seen at once */
    int misses;                         /* frames in a row that do not fit */
    double place[FV_GLINT_LEDS_MAX][2]; /* about their middle, pixels */
};

/* The middle of all reflections; false where too few are seen to tell: more than half of them must be, of one
 * or two all. Before all were seen at once, none is. A ring that does
 * not fit for long is learnt anew. */
bool fv_glint_middle(struct fv_glint_ring *ring, const struct fv_glint *spot, int spots, double middle[2]);

#endif
