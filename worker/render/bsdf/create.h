/* SPDX-License-Identifier: Apache-2.0 */
/* Helpers for the creation of BSDFs. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_CREATE_H
#define WORKER_RENDER_BSDF_CREATE_H

#include "worker/render/bsdf/bsdf.h"

/* Replaces b's operations by `ops` and its data by a copy of the former b; the other properties of b stay. -ENOMEM. */
int bsdf_wrap(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n, const struct bsdf_build *build,
	      struct error *e);

/* Reads a reflectance into t and sets b's colour and texture flags. `fallback` is the value if the parameter is absent.
 * Returns 0 or a negative error code. */
int bsdf_read_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		      const struct bsdf_build *build, struct error *e);

/* Like bsdf_read_texture(), for a number from 0 to 1 (texture_build.is_number). */
int bsdf_read_number(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		     const struct bsdf_build *build, struct error *e);

/* Like bsdf_read_texture(), for a quantity that may exceed 1, such as an exponent or an absorption. is_number: it is no
 * spectrum (texture_build.is_number). The caller checks its range. */
int bsdf_read_quantity(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		       bool is_number, const struct bsdf_build *build, struct error *e);

/*
 * Points at which textures are evaluated to find their range: a grid over (u,v), combined with points of the mesh's
 * triangles in turn. A mesh attribute has its extremes at the corners of triangles; a texture that depends on the
 * distance to the edges has them there and at the point equally far from all three. With up to BSDF_PROBES_MAX such
 * points the range is exact; beyond that, points are skipped evenly.
 */
enum { BSDF_PROBES_MAX = 3 << 18 };
struct bsdf_probes {
	uint32_t count;
	const struct attribute_table *mesh; /* NULL: no mesh */
	uint64_t mesh_point_count;	    /* points of the mesh to be probed; 0: no texture depends on the mesh */
};
struct bsdf_probes bsdf_probes_make(const struct bsdf_build *build);
struct bsdf_point bsdf_probe_point(const struct bsdf_probes *p, uint32_t i);
/* The smallest and the largest value of a texture at these points. A value is the mean over the lanes, which differ
 * only for colours that are not images. */
struct bsdf_range {
	double min, max;
};
struct bsdf_range bsdf_probe_range(const struct texture *t, const struct bsdf_build *build);

/* Completes `sample` for a lobe that is neither specular nor refracted, in direction wi. Returns false if the density
 * of wi is 0. */
bool bsdf_sample_smooth(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi, struct bsdf_sample *out);
/* Completes `sample` for the specular lobe `mode`. Returns false if there is no such lobe for wo. */
bool bsdf_sample_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode,
		       struct bsdf_sample *out);

/* Makes b a BSDF with specular lobes only, with the operations `ops`; b's data must begin with the data that these
 * expect. */
void bsdf_make_specular(struct bsdf *b, const struct bsdf_ops *ops);

/* Records that b has a part with a colour of this kind. */
void bsdf_add_color_kind(struct bsdf *b, enum color_kind kind);

/* Mitsuba 0.6 can be told to keep reflectances that add up to more than 1. Returns -ERANGE if `sum`, their sum, exceeds
 * 1 and the node requests that, otherwise 0. For BSDFs without this parameter it has no effect (scene.c). */
#define BSDF_ENERGY_PARAM                                                 \
	{                                                                 \
		.name = "ensure_energy_conservation", .types = VALUE_BOOL \
	}
int bsdf_check_energy(const struct scene_node *n, double sum, struct error *e);

#endif
