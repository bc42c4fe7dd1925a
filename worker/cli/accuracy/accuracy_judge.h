/* SPDX-License-Identifier: Apache-2.0 */
/* Computes figures from the renders: errors, times and biases with their intervals. One thread. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_JUDGE_H
#define WORKER_CLI_ACCURACY_ACCURACY_JUDGE_H

#include "worker/cli/accuracy/accuracy_run.h"
#include "worker/cli/accuracy/accuracy_stats.h"
#include "worker/cli/image/picture.h"

enum { ACCURACY_CELLS_MAX = 17 }; /* room for the blocks of an image, and its mean */

/* Share of the pixels, those with the largest errors, that is left out: a single one can make up most of the error. */
#define ACCURACY_TRIM 0.005

/* The figures of one setting. Errors are relative errors as in docs/design.md, rules 4; intervals are at 95 %. */
struct accuracy_figures {
	uint64_t mutations, rounds;
	double cpu_seconds;
	struct interval mutation_us; /* microseconds of CPU time per mutation */
	double acceptance_rate;	     /* share of accepted mutations */
	double failed_walk_share;    /* share of all walks; NAN: there were none */
	double rays_per_mutation;
	struct interval error_at_equal_mutations; /* error after as many mutations as the default's */
	struct interval error_at_equal_time;	  /* error after as much CPU time as the default's */
	struct interval bias_mean;		  /* of the image's mean, relative to the reference */
	/* Of the block that differs most significantly; 95 % for all blocks together. */
	struct interval bias_worst_block;
	unsigned worst_block_index; /* its index: column + row * blocks_across */
	double bias_lower_joint;    /* lower bound of the bias, all settings and blocks tested together; 0: none */
	double bias_upper;	    /* upper bound of the bias of the mean or of any block */
	size_t dominating_index;    /* index of a better setting (stats_front); its own: it is on the front, or the
				     * reference
				     */
};

struct accuracy_judgement {
	unsigned blocks_across, blocks_down; /* numbers of blocks */
	uint64_t default_mutations;	     /* the number of mutations for error_at_equal_mutations */
	double default_cpu_seconds;	     /* the CPU time for error_at_equal_time */
	bool has_reference_file;	     /* the reference is the image of a file */
	bool is_unreliable; /* too little was rendered to trust the figures: groups that all missed rare light look
			       exact */
	struct accuracy_figures figures[ACCURACY_SETTINGS_MAX];
	uint32_t width, height;
	float *rgb; /* planes of the report's image: R, G, B */
};

/* Computes all figures. reference: an image, of the size of the renders, against which the bias is measured; NULL: the
 * setting ACCURACY_REFERENCE. Free the judgement with accuracy_judgement_fini. */
int accuracy_judge(const struct accuracy_run *r, const struct picture *reference, struct accuracy_judgement *out,
		   struct error *e);
void accuracy_judgement_fini(struct accuracy_judgement *j);

#endif
