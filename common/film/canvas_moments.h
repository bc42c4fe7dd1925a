/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a canvas keeps besides pixels to say whether chains agree: by sequence and tile the cumulated first moments, by
 * lease and tile the second ones, by group and path class the chains' time and the bootstrap's energy (struct batch).
 * As films are: integers on a grid or exact sums, open rounds apart from the prefix, so that the order of batches does
 * not matter. Memory: 24 bytes a sequence and tile, 24 a lease and tile; pages that no batch touched cost nothing. One
 * thread at a time.
 */
#ifndef COMMON_FILM_CANVAS_MOMENTS_H
#define COMMON_FILM_CANVAS_MOMENTS_H

#include "common/base/checked_file.h"
#include "common/film/batch.h"

struct moments;

int moments_new(struct moments **m, const struct plan *p, struct error *e);
void moments_free(struct moments *m);

/* -ERANGE: after so many rounds a sum could leave the grid. To be asked before moments_add, which cannot fail. */
int moments_fit(const struct moments *m, const struct lease_key *k, struct error *e);
/* closed: to the prefix. */
void moments_add(struct moments *m, const struct batch *b, bool closed);
void moments_take_back(struct moments *m, const struct batch *b, bool closed); /* of a render lease, as it was added */
void moments_close_round(struct moments *m, uint64_t round);

int moments_save(const struct moments *m, struct checked_file *out, struct error *e);
int moments_load(struct moments *m, struct checked_file *in, struct error *e); /* into new ones of the same plan */

#endif
