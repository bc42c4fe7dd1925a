/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Judges whether the chains of an image agree, from statistics in the batches other than pixels (docs/design.md, rules
 * 1 and 2). Flagged are tiles whose potential scale reduction (Gelman and Rubin 1992) shows that chains have not mixed,
 * classes of paths whose energy in the chains differs from the bootstrap's or between groups, and chains that accept
 * nothing. Images of samples (path, bdpt) always agree. tests/scenes/bulb/README.md tells how often each criterion
 * fires on good scenes and on a bad one. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_CONVERGENCE_H
#define COMMON_ESTIMATE_CONVERGENCE_H

#include "common/estimate/image.h"

enum convergence_verdict {
	CHAINS_AGREE,
	CHAINS_TOO_SHORT, /* something is flagged, but the chains are too short to be judged */
	CHAINS_DISAGREE,  /* exit code 5 */
};

/* With fewer mutations per chain, chains are never said to disagree: their starting states have too much weight. */
enum { CONVERGENCE_MUTATIONS_MIN = 10000 };

enum { CONVERGENCE_TEXT_MAX = 512 };
struct convergence {
	enum convergence_verdict verdict;
	uint32_t tiles, flagged_tiles;	/* number of tiles; of tiles in which chains have not mixed and whose mean is
					   therefore uncertain */
	double flagged_energy_share;	/* share of the image's energy in flagged tiles */
	double median_r_hat, max_r_hat; /* over tiles with light; NAN: none */
	uint32_t worst_x, worst_y;	/* the tile of max_r_hat, in pixels of the full film */
	uint32_t flagged_classes;	/* one bit per path class: chains and bootstrap differ */
	/* one bit per path class: groups of chains differ, as if few had found the class */
	uint32_t inconsistent_classes;
	double stuck_share;		 /* share of chain epochs without an accepted mutation */
	char text[CONVERGENCE_TEXT_MAX]; /* one line: what disagrees, where, by how much. Empty: CHAINS_AGREE */
};

/* Judges the chains of an image that canvas_image_init has made. */
void convergence_judge(const struct plan *p, const struct canvas_image *img, struct convergence *a);
const char *convergence_name(enum convergence_verdict v); /* "agree", "too short", "disagree" */

/* Appends a->text to the note on the image (strategy_print_note). */
void convergence_append_note(const struct convergence *a, char *note, size_t size);

/* Prints one row per class that has energy: its share of b in %, in the bootstrap and in the chains, with standard
 * errors, t, and whether the class is flagged or its groups differ. Lines end with '\n'; empty if no class has energy.
 * CONVERGENCE_TABLE_MAX bytes are enough. */
enum { CONVERGENCE_TABLE_MAX = 4096 };
void convergence_print_table(const struct path_class_energy classes[PATH_CLASSES], double b,
			     const struct convergence *a, char *text, size_t size);

/* Returns P(|T| > |t|) for Student's t with that number of degrees of freedom (at least 1). */
double convergence_student_tail(double t, uint32_t degrees);

#endif
