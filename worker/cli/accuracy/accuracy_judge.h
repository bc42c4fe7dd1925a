/* SPDX-License-Identifier: Apache-2.0 */
/* Computes figures from the renders: errors, times, biases, with their intervals. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_JUDGE_H
#define WORKER_CLI_ACCURACY_ACCURACY_JUDGE_H

#include "worker/cli/accuracy/accuracy_run.h"
#include "worker/cli/accuracy/accuracy_stats.h"
#include "worker/cli/image/picture.h"

enum { ACCURACY_CELLS = 17 };

/* Share of the pixels, those with the largest errors, that is left out: a single one can make up most of the error. */
#define ACCURACY_TRIM 0.005

/* The figures of one setting. Errors are relative errors as in docs/design.md, rules 4; at 95 %. */
struct accuracy_figures {
	uint64_t mutations, rounds;
	double cpu_seconds;
	struct interval cost;		       /* microseconds of CPU time per mutation */
	double acceptance, failed_walks, rays; /* failed_walks: share of all walks, NAN: none */
	struct interval equal_mutations, equal_time;
	struct interval bias_mean;  /* relative to the reference */
	struct interval bias_block; /* of the worst block, at 95 % for all blocks together */
	unsigned block;		    /* which: across + down * blocks_across */
	double bias_seen, bias_bound;
	size_t beaten_by; /* itself: it is on the front; the reference takes no part */
};

struct accuracy_judgement {
	unsigned across, down; /* blocks */
	uint64_t at_mutations; /* at equal numbers of mutations */
	double at_cpu_seconds; /* at equal time */
	bool file;	       /* the reference is a file's image */
	bool thin; /* too little was rendered to trust the figures: errors of groups that missed the rare light look
		      small */
	struct accuracy_figures figures[ACCURACY_SETTINGS];
	uint32_t width, height;
	float *rgb; /* planes of the report's image: R, G, B */
};

/* reference: an image of the settings' size to measure bias against; NULL: the careful setting. */
int accuracy_judge(const struct accuracy_run *r, const struct picture *reference, struct accuracy_judgement *out,
		   struct error *e);
void accuracy_judgement_fini(struct accuracy_judgement *j);

#endif
