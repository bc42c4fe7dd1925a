/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The merged films of a job: one film per group, sums on an integer grid, so the order of additions does not matter
 * (docs/design.md, rules 1). Batches of round r are added to the open film of r; when the round is complete, its sums
 * move into the prefix. The published image is the prefix of complete rounds. Two rounds may be open: the first
 * incomplete one and the next. Memory: 8 bytes x 3 channels x pixels x groups x 3, in mapped files in `folder`
 * (unlinked at once) or, with folder NULL, in anonymous memory; untouched pages cost nothing. Chains also need the
 * memory of canvas_moments.h: 24 bytes per tile and sequence, 0.5 % of the films with 1,024 chains in 16 groups. One
 * thread at a time.
 */
#ifndef COMMON_FILM_CANVAS_H
#define COMMON_FILM_CANVAS_H

#include "common/film/batch.h"
#include "common/film/tally.h"

struct canvas;

struct bootstrap_result { /* over all groups, from the weights in index order: see bootstrap_merge */
	double b[PLAN_MAX_GROUPS];
	double b_pooled;
	double beyond_share; /* share of the energy in paths too long for the chains' state */
	bool black; /* no sample carried light. Chains cannot start: the job ends with a black image. Samples continue,
		       since a small bootstrap proves nothing about many samples */
};

/* The grid: quantum 2^exponent. Fixed for chains (values are of order 1 per mutation); derived from b for samples. */
int canvas_grid_exponent(const struct plan *p, double b_pooled, double brightest);

int canvas_new(struct canvas **c, const struct plan *p, int grid_exponent, const char *folder, struct error *e);
void canvas_free(struct canvas *c);
size_t canvas_bytes(const struct plan *p); /* of its films */
/* Whether there is room for films in memory: what canvas_new without a folder says after a bootstrap. */
int canvas_probe(const struct plan *p, struct error *e);
bool canvas_is_mapped(const struct canvas *c); /* to a file */
/* Bytes of that file for which the disk has not given room yet. */
uint64_t canvas_unreserved(const struct canvas *c);

/* Bootstrap batches add only their independent sums. Counters and sums of render batches belong to their round.
 * -EEXIST: merged before; -EAGAIN: the round is not open, or an earlier batch is taken back; -ERANGE: a sum left the
 * grid (the job fails). */
int canvas_add(struct canvas *c, const struct batch *b, struct error *e);
/* Takes back the last render batch that was added for a (group, part), exactly as it was added. It may be added
 * again with another content; until then no round is closed. COUNT_LONGEST_STUCK keeps its value. */
void canvas_take_back(struct canvas *c, const struct batch *b);
uint64_t canvas_missing(const struct canvas *c); /* batches of complete rounds that are taken back */
/* Checks a render batch first: no pixel may take more than an eighth of the film's range. -EBADMSG for chains, which
 * cannot stay in one pixel for so long; -ERANGE for samples, whose brightness has no bound but exceeds the grid. */
int canvas_admits(const struct canvas *c, const struct batch *b, struct error *e);
/* Sets the tail index of the independent samples (common/estimate/tail.h), from the bootstrap. */
void canvas_set_tail(struct canvas *c, double index);
/* The plan now ends after this many rounds, not fewer than are open. */
void canvas_set_rounds(struct canvas *c, uint64_t rounds);
/* Reserves disk space for the tiles of a render batch, so that adding it cannot fail for lack of it. -ENOSPC and
 * other errors of the disk. */
int canvas_reserve(struct canvas *c, const struct batch *b, struct error *e);
bool canvas_has(const struct canvas *c, const struct lease_key *k); /* merged before */
uint64_t canvas_rounds(const struct canvas *c);			    /* complete rounds */

/* The counts of the prefix of complete rounds; with open_rounds, of everything received. */
void canvas_counts(const struct canvas *c, bool open_rounds, struct canvas_counts *out);

#endif
