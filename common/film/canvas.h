/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The merged films of a job: per group, sums on an integer grid, so that the order of additions does not matter
 * (docs/design.md, rules 1). Batches of round r are added to the open film of round r; when the round is complete, its
 * sums move into the prefix. The published image is made from the prefix, the sums of all complete rounds. Two rounds
 * may be open: the first incomplete one and the next.
 *
 * Memory: 8 bytes x 3 channels x pixels x groups x 3 films (prefix and two open rounds), in a mapped file in `folder`,
 * which has no name, or with folder NULL in anonymous memory; untouched pages cost nothing. Chains also need the memory
 * of canvas_moments.h: 24 bytes per tile and sequence, 0.5 % of the films with 1,024 chains in 16 groups. One thread at
 * a time.
 */
#ifndef COMMON_FILM_CANVAS_H
#define COMMON_FILM_CANVAS_H

#include "common/film/batch.h"
#include "common/film/tally.h"

struct canvas;

/* The result of the bootstrap of all groups, computed from the weights in index order. */
struct bootstrap_result {
	double b[PLAN_GROUPS_MAX]; /* by group */
	double b_pooled;
	double overlong_share; /* share of the energy in paths too long for the chains' state */
	bool is_black;	       /* no sample carried light. Chains cannot start: the job ends with a black image. Samples
			       continue,	 since a small bootstrap proves nothing about many samples */
};

/* Returns the exponent of the grid, whose quantum is 2^exponent: fixed for chains (values are of order 1 per mutation);
 * for samples derived from b or, if b is 0 or not finite, from the brightest sample. */
int canvas_grid_exponent(const struct plan *p, double b_pooled, double brightest);

/* Creates an empty canvas. Returns 0, -ENOMEM, or an error of creating or mapping the file in `folder`. */
int canvas_new(struct canvas **out, const struct plan *p, int grid_exponent, const char *folder, struct error *e);
void canvas_free(struct canvas *c);
size_t canvas_bytes(const struct plan *p); /* size of the films */
/* Returns -ENOMEM if canvas_new would not get the memory for the films, without a folder; otherwise 0. Call it before a
 * bootstrap whose result would be lost if canvas_new failed after it. */
int canvas_probe(const struct plan *p, struct error *e);
bool canvas_is_mapped(const struct canvas *c); /* the films are in a mapped file, not in memory */
/* Returns the bytes of the mapped file for which no disk space is reserved yet; 0 if there is no file. */
uint64_t canvas_unreserved_bytes(const struct canvas *c);

/* Merges a batch that has passed batch_check. A bootstrap batch adds only its sums of independent samples and path
 * classes; a render batch adds its pixels, counters and sums to its round. Returns -EEXIST if the lease is merged
 * already, -EAGAIN if its round is not open or an earlier batch of its (group, part) has been taken back, -ENOSPC or
 * another error of the disk, or -ERANGE if a sum would leave the grid (the job fails). */
int canvas_add(struct canvas *c, const struct batch *b, struct error *e);
/* Takes back the last render batch that was added for its (group, part); b must be as it was added. A batch of the same
 * lease may be added later with other contents; until then no round is closed. COUNT_LONGEST_STUCK, a maximum, keeps
 * its value. */
void canvas_subtract(struct canvas *c, const struct batch *b);
/* Returns the number of batches of complete rounds that have been taken back and not been added again. */
uint64_t canvas_missing_count(const struct canvas *c);
/* Checks, before canvas_add, that no pixel of a render batch takes more than an eighth of the film's range. Returns
 * -EBADMSG for chains, which cannot stay in one pixel for so long, and -ERANGE for samples: a sample may be that
 * bright, but then the grid is too fine. */
int canvas_check_range(const struct canvas *c, const struct batch *b, struct error *e);
/* Sets the tail index of the independent samples (common/estimate/tail.h), from the bootstrap. */
void canvas_set_tail_index(struct canvas *c, double index);
/* Changes the number of rounds after which the plan ends; at least the number of complete ones. */
void canvas_set_rounds(struct canvas *c, uint64_t rounds);
/* Reserves disk space for the tiles of a render batch, so that adding it cannot fail for lack of space. Returns 0,
 * -ENOSPC or another error of the disk. */
int canvas_reserve(struct canvas *c, const struct batch *b, struct error *e);
bool canvas_has_lease(const struct canvas *c, const struct lease_key *k); /* the lease is merged */
uint64_t canvas_complete_rounds(const struct canvas *c);		  /* number of complete rounds */

/* Returns the counts of the prefix of complete rounds; with open_rounds, of everything merged. */
void canvas_sum_counts(const struct canvas *c, bool open_rounds, struct canvas_counts *out);

#endif
