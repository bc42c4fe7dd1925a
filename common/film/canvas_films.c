/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_films.h"

#include "common/base/disk.h"

#include <string.h>

/* Touching a page of a sparse file for which the disk has no room raises SIGBUS. Reserving the space first turns this
 * into an error. */
int canvas_reserve_tile(struct canvas *c, size_t film, size_t tile, struct error *e)
{
	uint8_t *flags = canvas_tile_flags(c, film, tile);
	if (!(*flags & TILE_RESERVED) && c->fd >= 0) {
		off_t offset = (off_t)((film * canvas_tile_count(c) + tile) * SLOT_VALUES * sizeof *c->sums);
		int code = disk_posix_fallocate(c->fd, offset, SLOT_VALUES * sizeof *c->sums);
		if (code)
			return error_set(e, code, "no room on the disk for the films: %s", strerror(code));
	}
	*flags |= TILE_RESERVED;
	return 0;
}
