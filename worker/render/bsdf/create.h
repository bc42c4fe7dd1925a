/* SPDX-License-Identifier: Apache-2.0 */
/* Helpers for the creation of BSDFs. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_CREATE_H
#define WORKER_RENDER_BSDF_CREATE_H

#include "worker/render/bsdf/bsdf.h"

/* Wraps b in `ops`, whose data is a BSDF; all properties of b stay. */
int bsdf_wrap(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n, const struct bsdf_build *build,
	      struct error *e);

/* Reads a reflectance and sets b's colour and texture flags. */
int bsdf_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		 const struct bsdf_build *build, struct error *e);

/* Likewise a number from 0 to 1 (texture_build). */
int bsdf_number(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		const struct bsdf_build *build, struct error *e);

/* Likewise a quantity that may exceed 1: an index of refraction, an exponent, an absorption. number: it is no spectrum
 * (texture_build). The caller checks its range. */
int bsdf_quantity(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		  bool number, const struct bsdf_build *build, struct error *e);

/*
 * Points at which textures are evaluated to find their range: a grid over (u,v), and points of the mesh's triangles in
 * turn. An attribute has its extremes at corners, and what depends on the distance to the edges has them there and
 * where all three are equally far, so up to BSDF_PROBES_MAX such points the range is exact; beyond that, points are
 * skipped evenly.
 */
enum { BSDF_PROBES_MAX = 3 << 18 };
struct bsdf_probes {
	uint32_t count;
	const struct attribute_table *mesh; /* NULL: there is none */
	uint64_t points;		    /* of the mesh; 0: no texture depends on it */
};
struct bsdf_probes bsdf_probes_of(const struct bsdf_build *build);
struct bsdf_point bsdf_probe(const struct bsdf_probes *p, uint32_t i);
/* The smallest and the largest number of a texture there, means over the lanes: only colours that are no images differ
 * in them. */
struct bsdf_range {
	double least, most;
};
struct bsdf_range bsdf_probe_range(const struct texture *t, const struct bsdf_build *build);

/* Ends of `sample` where nothing is refracted. The lobes that are not specular send light to wi; false: the density
 * there is 0. */
bool bsdf_sample_smooth(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi, struct bsdf_sample *out);
/* The specular lobe `mode` is chosen; false: there is none from wo. */
bool bsdf_sample_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode,
		       struct bsdf_sample *out);

/* Marks b, whose data begins like that of `ops`, as having specular lobes only. */
void bsdf_make_smooth(struct bsdf *b, const struct bsdf_ops *ops);

/* Marks b as having a part of this colour. */
void bsdf_add_shape(struct bsdf *b, enum color_shape shape);

/* 0.6 allows keeping reflectances that add up to more than 1. `sum` is their sum; -ERANGE if it exceeds 1 and the
 * node requests that. For other BSDFs the parameter has no effect (scene.c). */
#define BSDF_ENERGY_PARAM                                                 \
	{                                                                 \
		.name = "ensure_energy_conservation", .types = VALUE_BOOL \
	}
int bsdf_check_energy(const struct scene_node *n, double sum, struct error *e);

#endif
