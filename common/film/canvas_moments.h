/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The moments that a canvas keeps to judge whether chains agree: first moments by sequence and tile, second moments by
 * lease and tile, and by group and path class the chains' time and the bootstrap's energy (struct batch). Like films
 * they are integers on a grid or exact sums, with open rounds separate from the prefix, so the order of batches does
 * not matter. Memory: 24 bytes per sequence and tile, 24 per lease and tile; untouched pages cost nothing. One thread
 * at a time.
 *
 * File format, numbers little endian: the sequences per lease S, leases per round L, tiles T and classes C, 4 bytes
 * each, then runs of numbers (G: groups). A run begins with one byte: 0 if all its numbers are 0, and then they are
 * left out; otherwise the numbers follow, 8 bytes each.
 *
 * runs    numbers  contents
 * 3 L S   T        first moments: prefix, open rounds of even and odd number; lease; sequence
 * 3 L     T        second moments; none if there are no sequences
 * 3 G C   36       time: prefix, open rounds; group; class. An exact sum's words, least significant first
 * G C     36       the bootstrap's energy: group; class
 */
#ifndef COMMON_FILM_CANVAS_MOMENTS_H
#define COMMON_FILM_CANVAS_MOMENTS_H

#include "common/base/checked_file.h"
#include "common/film/batch.h"

struct moments;

int moments_new(struct moments **out, const struct plan *p, struct error *e);
void moments_free(struct moments *m);

/* Returns -ERANGE if a sum could leave the grid after the lease's epoch. Call it before moments_add, which cannot fail.
 */
int moments_check_range(const struct moments *m, const struct lease_key *k, struct error *e);
/* Adds a batch. closed: the round of its lease is complete, so it is added to the prefix. */
void moments_add(struct moments *m, const struct batch *b, bool closed);
/* Subtracts a render batch; b must be as it was added. */
void moments_subtract(struct moments *m, const struct batch *b, bool closed);
/* Moves the sums of an open round into the prefix. */
void moments_close_round(struct moments *m, uint64_t round);

int moments_save(const struct moments *m, struct checked_file *out, struct error *e);
/* Loads into new moments of the same plan; -EBADMSG if the file belongs to another plan. */
int moments_load(struct moments *m, struct checked_file *in, struct error *e);

#endif
