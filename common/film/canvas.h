/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The merged films of a job: one film a group, sums on an integer grid, so that adding is order-free (docs/design.md,
 * rules 1). Round r's batches go into the open film of r; when all have come the round is closed and its sums move into
 * the prefix. The published image is the prefix of complete rounds. Two rounds may be open: the first incomplete one
 * and the next. Memory: 8 bytes x 3 channels x pixels x groups x 3, in mapped files below `folder` (unlinked at once)
 * or, with folder NULL, in anonymous memory; pages that no batch touched cost nothing. For chains also what
 * canvas_moments.h keeps: 24 bytes a tile and sequence, 0.5 % of the films with 1,024 chains in 16 groups. One thread
 * at a time.
 */
#ifndef COMMON_FILM_CANVAS_H
#define COMMON_FILM_CANVAS_H

#include "common/film/batch.h"
#include "common/film/tally.h"

struct canvas;

struct bootstrap_result { /* of all groups, from the weights in index order: see bootstrap_merge */
	double b[PLAN_MAX_GROUPS];
	double b_pooled;
	double beyond_share; /* of the energy, in paths too long for the chains' state */
	bool black; /* no sample carried light, so chains have nowhere to begin: the job ends with a black image.
		       Samples go on: the few of the bootstrap prove nothing about the many */
};

/* The grid: quantum 2^exponent. For chains fixed (values are of order 1 per mutation); for samples from b. */
int canvas_grid_exponent(const struct plan *p, double b_pooled, double brightest);

int canvas_new(struct canvas **c, const struct plan *p, int grid_exponent, const char *folder, struct error *e);
void canvas_free(struct canvas *c);
size_t canvas_bytes(const struct plan *p);     /* of its films */
bool canvas_is_mapped(const struct canvas *c); /* to a file */

/* Bootstrap batches add only their independent sums. Counters and sums of render batches are those of their round.
 * -EEXIST: merged already; -EAGAIN: round not open, or an earlier batch is taken back; -ERANGE: a sum left the grid (an
 * error of the job). */
int canvas_add(struct canvas *c, const struct batch *b, struct error *e);
/* Of a (group, part) the last render batch that was added, as it was then: its sums are taken out, exactly, and it may
 * be added again, with another content; until then no round is closed. COUNT_LONGEST_STUCK stays what it was. */
void canvas_take_back(struct canvas *c, const struct batch *b);
uint64_t canvas_missing(const struct canvas *c); /* batches of complete rounds that are taken back */
/* Before anything is done with a render batch: no pixel of it takes an eighth of the film's range. -EBADMSG: of chains,
 * which cannot be so long in one pixel; -ERANGE: of samples, which may be as bright as they like, but not here. */
int canvas_admits(const struct canvas *c, const struct batch *b, struct error *e);
/* The tail index of the independent samples (common/estimate/tail.h), from the bootstrap. */
void canvas_set_tail(struct canvas *c, double index);
/* The plan ends after so many rounds now, not fewer than are open. */
void canvas_set_rounds(struct canvas *c, uint64_t rounds);
/* Room on the disk for the tiles of a render batch, so that adding it does not fail for want of it. -ENOSPC and what
 * else a disk says. */
int canvas_reserve(struct canvas *c, const struct batch *b, struct error *e);
bool canvas_has(const struct canvas *c, const struct lease_key *k); /* merged already */
uint64_t canvas_rounds(const struct canvas *c);			    /* complete rounds */
uint64_t canvas_merged(const struct canvas *c);			    /* render leases merged, open rounds too */

/* Of the prefix of complete rounds, with open_rounds of all that has come. */
void canvas_counts(const struct canvas *c, bool open_rounds, struct canvas_counts *out);

#endif
