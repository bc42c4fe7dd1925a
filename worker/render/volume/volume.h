/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A colour that may vary in space: a constant (`constvolume`, or a value), or a grid (`gridvolume`). A grid of three
 * channels holds R, G and B. Its spectrum is linear in the channels, so that sums and integrals of spectra follow from
 * those of the channels: each channel's spectrum is the upsampled reflectance of its primary, and at each wavelength
 * the three are scaled to add up to 1, so that grey is constant over wavelengths. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_VOLUME_VOLUME_H
#define WORKER_RENDER_VOLUME_VOLUME_H

#include "worker/render/texture/color.h"
#include "worker/render/volume/grid.h"

struct volume {
	struct color color;
	const struct grid *grid;     /* its values are factors of the colour; NULL: the same colour everywhere */
	double min_value, max_value; /* bounds of the grid's values */
	struct color primary[GRID_CHANNELS_MAX]; /* spectra of the channels, before scaling */
};

extern const struct plugin_decl volume_decls[]; /* ends with a NULL type */

struct grid_cache; /* grid_file.h */

struct volume_build {
	const struct asset_source *assets;
	struct arena *arena;
	struct grid_cache *cache;
	bool is_dialect_3; /* a scene of 3.x; otherwise grids are placed as in 0.6 */
	vec3 world_center; /* a scene point p is at world_scale (p - world_center) in the rescaled world */
	double world_scale;
};

/* Reads the property `name` of node n: a colour or a nested volume, `fallback` if absent. in_cube: a volume without a
 * grid is limited to the unit cube, transformed by the to_world of the nested volume. Returns 0 or a negative error
 * code. */
int volume_from_node(struct volume *v, const struct scene_node *n, const char *name, double fallback,
		     enum color_role role, bool in_cube, const struct volume_build *build, struct error *e);

/* Gives v the bounds of another volume, outside which it is 0: the box of the other's grid, or the whole scene if that
 * has no grid. Within these bounds v continues beyond its own grid with the values at its border. n: the node that
 * errors name. -ENOTSUP if the grid of v repeats. */
int volume_adopt_bounds(struct volume *v, const struct volume *other, const struct scene_node *n,
			const struct volume_build *build, struct error *e);

/* Makes the grid of a file that was read for node n, and places it in the world. Returns 0 or a negative error code. */
struct grid_file;
int volume_make_grid(struct grid *g, const struct scene_node *n, const struct grid_file *f,
		     const struct volume_build *build, struct error *e);

/* Multiplies the values of v along rays by the area of two grids (struct grid.area_matrix), which must outlive v. n:
 * the node that errors name. -ENOTSUP if v has no grid, or one with other points; a constant in a cube adopts the
 * points of `area`. */
int volume_scale_by_area(struct volume *v, const struct grid area[2], const struct scene_node *n,
			 const struct volume_build *build, struct error *e);

static inline bool volume_varies(const struct volume *v)
{
	return v->grid;
}

double volume_min(const struct volume *v); /* lower bound over positions and wavelengths; 0 if not known */
double volume_max(const struct volume *v); /* upper bound over positions and wavelengths */
bool volume_is_colored(const struct volume *v);

/* Computes the spectra that weight the channels, without v's colour; 1 for a single channel. Returns the number of
 * channels. */
int volume_channel_weights(const struct volume *v, const struct wavelengths *w, spectrum weight[GRID_CHANNELS_MAX]);
/* Returns the colour at p. bounded: 0 outside the grid's box. */
spectrum volume_eval(const struct volume *v, vec3 p, bool bounded, const struct wavelengths *w);

#endif
