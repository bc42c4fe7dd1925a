/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whether the chains of an image agree, judged by what batches contain besides pixels (docs/design.md, rules 1 and 2):
 * tiles whose potential scale reduction (Gelman and Rubin 1992) shows that chains have not mixed, classes of paths
 * whose energy in the chains differs from the bootstrap's or between groups, and chains that stand still. Pure; any
 * thread; allocates nothing. Samples (path, bdpt) always agree. Energies are in units of b. How often each criterion
 * fires on good scenes and on a bad one: tests/scenes/bulb/README.md.
 */
#ifndef COMMON_ESTIMATE_CONVERGENCE_H
#define COMMON_ESTIMATE_CONVERGENCE_H

#include "common/estimate/image.h"

enum convergence_verdict {
	CHAINS_AGREE,
	CHAINS_TOO_SHORT, /* something is flagged, but the chains are too short to be judged */
	CHAINS_DISAGREE,  /* exit code 5 */
};

/* With fewer mutations each, chains are never said to disagree: their starting states weigh too much. */
enum { CONVERGENCE_MUTATIONS = 10000 };

enum { CONVERGENCE_TEXT = 512 };
struct convergence {
	enum convergence_verdict verdict;
	uint32_t tiles, tiles_flagged; /* flagged: chains have not mixed there, and the tile's mean is uncertain because
					  of it */
	double energy_flagged;	       /* share of the image's energy in flagged tiles */
	double r_hat_median, r_hat_worst; /* over tiles with light; NAN: none */
	uint32_t worst_x, worst_y;	  /* the tile of r_hat_worst, in pixels of the full film */
	uint32_t classes_flagged;	  /* one bit per path class: chains and bootstrap differ */
	uint32_t classes_apart; /* one bit per path class: groups of chains differ, as if few of them had found it */
	double stuck_share;	/* share of chain epochs without an accepted mutation */
	char text[CONVERGENCE_TEXT]; /* one line: what disagrees, where, by how much. Empty: CHAINS_AGREE */
};

void convergence_judge(const struct plan *p, const struct canvas_image *img, struct convergence *out);
const char *convergence_name(enum convergence_verdict v); /* "agree", "too short", "disagree" */

/* Appends its text to the note on the image (strategy_note). */
void convergence_add_note(const struct convergence *a, char *note, size_t size);

/* One row per class that has energy: the bootstrap's and the chains' share of b in %, standard errors, t, and
 * whether it is flagged or its groups differ. Lines end with '\n'; empty if no class has energy. CONVERGENCE_TABLE
 * bytes are enough. */
enum { CONVERGENCE_TABLE = 4096 };
void convergence_table(const struct path_class_energy classes[PATH_CLASSES], double b, const struct convergence *a,
		       char *text, size_t size);

/* P(|T| > |t|) of Student's t with that number of degrees of freedom (at least 1). */
double convergence_student_tail(double t, uint32_t degrees);

#endif
