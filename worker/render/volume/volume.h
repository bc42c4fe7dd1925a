/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A colour that depends on the place: one for all places (`constvolume`, or a value), or that of a grid (`gridvolume`).
 * A grid of three channels holds R, G and B. Its spectrum is linear in them, so that sums and integrals of spectra are
 * those of the channels: each channel's colour is the reflectance that its primary has elsewhere, and at each
 * wavelength they are scaled to add up to 1, so that grey is the same at all. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_VOLUME_VOLUME_H
#define WORKER_RENDER_VOLUME_VOLUME_H

#include "worker/render/texture/color.h"
#include "worker/render/volume/grid.h"

struct volume {
	struct color color;
	const struct grid *grid; /* its numbers times the colour; NULL: the same everywhere */
	double least, largest;	 /* bounds of all its numbers */
	struct color primary[GRID_CHANNELS_MAX];
};

extern const struct plugin_decl volume_decls[]; /* ends with a NULL type */

struct grid_cache; /* grid_file.h */

struct volume_build {
	const struct asset_source *assets;
	struct arena *arena;
	struct grid_cache *cache;
	bool dialect_3; /* otherwise 0.6's way to place a grid */
	vec3 center;	/* a scene point p is at scale (p - center) in the rescaled world */
	double scale;
};

/* Property `name` of node n: a colour or a nested volume; `fallback` if absent. in_cube: without a grid it is limited
 * to the unit cube, at the place of the nested volume. */
int volume_from_node(struct volume *v, const struct scene_node *n, const char *name, double fallback,
		     enum color_role role, bool in_cube, const struct volume_build *build, struct error *e);

/* Gives v the bounds of another volume, beyond which it counts 0: the box of its grid, in which v goes on as at its own
 * border. Where the other one has no grid and is the same everywhere, the whole scene. n: what is to blame. -ENOTSUP: v
 * repeats itself. */
int volume_cover(struct volume *v, const struct volume *other, const struct scene_node *n,
		 const struct volume_build *build, struct error *e);

/* The grid of a node's file, with its place. */
struct grid_file;
int volume_grid(struct grid *g, const struct scene_node *n, const struct grid_file *f, const struct volume_build *build,
		struct error *e);

/* Lets the numbers of v count by the area of two grids (struct grid.area) that outlive it. n: what is to blame.
 * -ENOTSUP: v has no grid, or one with other points; a box of one number takes over theirs. */
int volume_by_area(struct volume *v, const struct grid area[2], const struct scene_node *n,
		   const struct volume_build *build, struct error *e);

static inline bool volume_varies(const struct volume *v)
{
	return v->grid;
}

double volume_least(const struct volume *v); /* lower bound over places and wavelengths; 0 where not known */
double volume_max(const struct volume *v);   /* upper bound over places and wavelengths */
bool volume_is_coloured(const struct volume *v);

/* Spectra by which the channels are weighted, without the colour; of one channel: 1. Returns the number of channels. */
int volume_weights(const struct volume *v, const struct wavelengths *w, spectrum weight[GRID_CHANNELS_MAX]);
/* The colour at p. `bounded`: 0 outside of the grid's box. */
spectrum volume_at(const struct volume *v, vec3 p, bool bounded, const struct wavelengths *w);

#endif
