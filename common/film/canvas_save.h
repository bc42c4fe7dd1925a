/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Saves a canvas to a file and loads it, open rounds included: a loaded canvas gives the same bits as the saved one
 * when the same batches are added to both. Untouched tiles take no space. One thread at a time.
 *
 * Version 2, all numbers little endian (common/base/checked_file.h). G: groups, P: parts. Films are numbered as by
 * canvas_film_index(), tiles row by row.
 *
 * offset  bytes      contents
 * 0       4          version
 * 4       4          T, bytes of a tally: 39168
 * 8       8          G, P
 * 16      8          tiles across, tiles down
 * 24      4          kind of plan
 * 28      4          values in a tile: 64 x 64 x 3
 * 32      8          quantum, a double
 * 40      8          complete rounds
 * 48      8          merged leases of the two open rounds, 4 bytes each
 * 56      3 G P      whether a lease is merged: bootstrap, open rounds of even and odd number; group; part
 *         24 G       by film, the bound of its sums
 *         4 T        tallies: of the prefix, of both open rounds, of the bootstrap
 *         8          tail index of the bootstrap, a double
 *                    moments (canvas_moments.h)
 *         98312 each the tiles that were touched: film and tile, 4 bytes each, then the sums, 8 bytes each
 *         8          the end of the tiles: all bits set
 *
 * A tally is a list of 8-byte numbers: the counters, the counters of each strategy, then for each of 64 groups the
 * samples, the independent samples, and two exact sums of 36 words each, least significant first. Counters are in the
 * order of the enums in batch.h; adding one to an enum changes the format and needs a new version.
 */
#ifndef COMMON_FILM_CANVAS_SAVE_H
#define COMMON_FILM_CANVAS_SAVE_H

#include "common/base/checked_file.h"
#include "common/film/canvas.h"

/* Saves a canvas from which no batch of a complete round is taken back (canvas_missing_count() is 0). */
int canvas_save(const struct canvas *c, struct checked_file *out, struct error *e);
/* Loads into a new canvas of the same plan and grid. Returns -EBADMSG if the file is of another plan or grid or
 * damaged, -EPROTO if it is of another version. The canvas is unusable after an error. */
int canvas_load(struct canvas *c, struct checked_file *in, struct error *e);

#endif
