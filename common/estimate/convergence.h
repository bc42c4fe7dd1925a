/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whether the chains of an image agree, from what its batches say besides pixels (docs/design.md, rules 1 and 2): tiles
 * whose potential scale reduction (Gelman and Rubin 1992) says that chains have not mixed, classes of paths whose
 * energy in the chains differs from the bootstrap's or from group to group, chains that stand still. Pure; any thread;
 * allocates nothing. Samples (path, bdpt) always agree. Energies are in units of b's. How often each criterion fires on
 * scenes that are fine, and on one that is not: tests/scenes/bulb/README.md.
 */
#ifndef COMMON_ESTIMATE_CONVERGENCE_H
#define COMMON_ESTIMATE_CONVERGENCE_H

#include "common/estimate/image.h"

enum convergence_verdict {
	CHAINS_AGREE,
	CHAINS_TOO_SHORT, /* something is flagged, but chains made too few mutations to blame them for it */
	CHAINS_DISAGREE,  /* exit code 5 */
};

/* Below so many mutations each, chains are not said to disagree: their beginnings weigh too much. */
enum { CONVERGENCE_MUTATIONS = 10000 };

enum { CONVERGENCE_TEXT = 512 };
struct convergence {
	enum convergence_verdict verdict;
	uint32_t tiles,
		tiles_flagged; /* flagged: chains have not mixed there, and the tile's mean is uncertain by that */
	double energy_flagged; /* share of the image's energy in flagged tiles */
	double r_hat_median, r_hat_worst; /* over tiles that have light; NAN: none */
	uint32_t worst_x, worst_y;	  /* the tile of r_hat_worst, in pixels of the full film */
	uint32_t classes_flagged;	  /* bit a path class: chains and bootstrap differ */
	uint32_t classes_apart;	     /* bit a path class: groups of chains differ, as if few of them had found it */
	double stuck_share;	     /* of chain epochs without an accepted mutation */
	char text[CONVERGENCE_TEXT]; /* in words, one line: what disagrees, where, by how much. Empty: CHAINS_AGREE */
};

void convergence_judge(const struct plan *p, const struct canvas_image *img, struct convergence *out);
const char *convergence_name(enum convergence_verdict v); /* "agree", "too short", "disagree" */

/* Appends its text to the note on the image (strategy_note). */
void convergence_add_note(const struct convergence *a, char *note, size_t size);

/* One row a class that has energy: bootstrap's and chains' share of b in %, the standard errors, t, and whether it is
 * flagged or its groups are apart. Lines end with '\n'; empty where no class has any. CONVERGENCE_TABLE bytes are
 * enough. */
enum { CONVERGENCE_TABLE = 4096 };
void convergence_table(const struct path_class_energy classes[PATH_CLASSES], double b, const struct convergence *a,
		       char *text, size_t size);

/* P(|T| > |t|) of Student's t with so many degrees of freedom (at least 1). */
double convergence_student_tail(double t, uint32_t degrees);

#endif
