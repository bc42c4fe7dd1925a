/*
 * Whether the chains of an image agree, from what its batches say besides pixels (contract sections 1 and 2): tiles whose
 * potential scale reduction says that chains have not mixed, classes of paths whose energy in the chains differs from the
 * bootstrap's, chains that stand still. Pure; any thread; allocates nothing. Samples (path, bdpt) always agree.
 */
#ifndef COMMON_FILM_AGREEMENT_H
#define COMMON_FILM_AGREEMENT_H

#include "common/film/canvas.h"

enum agreement_verdict {
	CHAINS_AGREE,
	CHAINS_TOO_SHORT, /* too few mutations a chain to say */
	CHAINS_DISAGREE,  /* exit code 5 */
};

struct agreement {
	enum agreement_verdict verdict;
	uint32_t tiles, tiles_flagged; /* flagged: chains have not mixed there, and the tile's mean is uncertain by that */
	double energy_flagged;         /* share of the image's energy in flagged tiles */
	double r_hat_median, r_hat_worst; /* over tiles that have light; NAN: none */
	uint32_t worst_x, worst_y;     /* the tile of r_hat_worst, in pixels of the full film */
	uint32_t classes_flagged;      /* bit a path class */
	double stuck_share;            /* of chain epochs without an accepted mutation */
	char text[512];                /* in words, one line: what disagrees, where, by how much. Empty: CHAINS_AGREE */
};

void agreement_judge(const struct plan *p, const struct canvas_image *img, struct agreement *out);
const char *agreement_name(enum agreement_verdict v); /* "agree", "too short", "disagree" */

#endif
