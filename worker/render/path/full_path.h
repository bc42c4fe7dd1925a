/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A whole path from an emitter to the camera: the state of chains in path space.
 *
 * v[0] is x_0 on the emitter (or the direction towards it, at infinity), v[edges] is x_k on the camera's aperture. Of
 * struct path_vertex a whole path uses kind, mode (inner vertices: how they scatter), delta, emitter, bsdf, x, to_prev
 * (the unit direction towards v[i + 1]: the camera's side) and as caches pdf and pdf_rev (density of the vertex as
 * generated from the camera's side and from the light's side).
 *
 * i_j is the unit direction from v[j] to v[j - 1], o_j the one to v[j + 1]. The contribution is measured as in path.h:
 * per area, per solid angle at infinity, delta distributions dropped (they are the same for all paths that share the
 * modes). One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_FULL_PATH_H
#define WORKER_RENDER_PATH_FULL_PATH_H

#include "worker/render/path/connect.h"

enum {
	FULL_PATH_MAX_EDGES = PATH_MAX_EDGES,
	FULL_PATH_MAX_VERTICES = FULL_PATH_MAX_EDGES + 1,
};

struct vertex_set {
	uint64_t word[FULL_PATH_MAX_VERTICES / 64 + 1];
};

static inline bool vertex_set_has(const struct vertex_set *s, unsigned j)
{
	return s->word[j / 64] >> (j % 64) & 1;
}

static inline void vertex_set_add(struct vertex_set *s, unsigned j)
{
	s->word[j / 64] |= (uint64_t)1 << (j % 64);
}

struct full_path_edge {	  /* v[e] - v[e + 1] */
	vec3 w;		  /* unit, from v[e] to v[e + 1] */
	double distance2; /* 1 where v[0] lies at infinity */
	spectrum left;	  /* where media scatter: the share of light that it lets through */
};

struct full_path {
	unsigned edges; /* k; 0: no path */
	struct wavelengths wl;
	double wavelength; /* the number in [0,1) that wl was made of */
	double film[2];
	struct path_vertex v[FULL_PATH_MAX_VERTICES];
	struct full_path_edge edge[FULL_PATH_MAX_EDGES];
	/* Caches, by vertex: read them through full_path_f and full_path_fh. */
	struct vertex_set known_f, known_fh;
	spectrum f[FULL_PATH_MAX_VERTICES], fh[FULL_PATH_MAX_VERTICES];
};

/* A product that neither over- nor underflows: v 2^exponent. */
struct product {
	spectrum v;
	int exponent;
};
#define PRODUCT_ONE ((struct product){{{1, 1, 1, 1}}, 0})
void product_mul(struct product *p, spectrum f);
/* log(X + Y + Z) of what the film gets of it; -INFINITY for black. */
double product_log_intensity(const struct path_context *c, const struct full_path *x, const struct product *p);

/* At which it happens, all of it: struct prim_ref. */
static inline double full_path_time(const struct full_path *x)
{
	return x->v[0].x.prim.time;
}

/* Edge e from the positions of its ends, and to_prev of v[e]. false: the ends coincide. */
bool full_path_join(struct full_path *x, unsigned e);

/* Whether an inner vertex scatters with another shading normal than that of v[j].x: path_facing. Half vectors are those
 * of v[j].x, and do not describe such a vertex. */
bool full_path_turned(const struct full_path *x, unsigned j);
/* |n . i_j| at an inner vertex, n the shading normal with which it scatters. */
double full_path_cosine_to_light(const struct full_path *x, unsigned j);

/* What kind of scattering the directions o_j, i_j mean: BSDF_REFLECT or BSDF_TRANSMIT by the sides of both normals; 0:
 * the two normals disagree about a side, nothing scatters. */
unsigned full_path_mode(const struct full_path *x, unsigned j);

/* n_o / n_i at v[j]: index on the camera's side over that on the light's; 1 where it reflects. */
double full_path_eta(const struct full_path *x, unsigned j);

/* v[0]: L_e towards v[1]. Inner vertices: f_radiance(o, i) without cosine, or the weight of the lobe where specular.
 * Computed when asked for the first time. */
spectrum full_path_f(const struct path_context *c, struct full_path *x, unsigned j);
/* Inner vertices: f |n.i| |d i / d h_par| (bsdf_eval_halfvec), or the weight of the lobe where specular; 0 where
 * full_path_turned. */
spectrum full_path_fh(const struct path_context *c, struct full_path *x, unsigned j);
/* The vertices first..last are about to change: what was known of them and of their neighbours no longer holds. */
void full_path_forget(struct full_path *x, unsigned first, unsigned last);
/* The exactly specular lobe of v[j]'s mode seen along o_j, as bsdf_eval_delta has it: its weight, its direction in the
 * shading frame, the probability with which it is chosen. */
spectrum full_path_specular(const struct full_path *x, unsigned j, vec3 *wi, double *chance);
/* By how far i_j is from where the exactly specular lobe of v[j]'s mode sends o_j; INFINITY: there is no such lobe. */
double full_path_specular_miss(const struct full_path *x, unsigned j);
void full_path_set_wavelength(const struct path_context *c, struct full_path *x, double u);

/* Vertices first..last with their edges and caches, and what belongs to the path as a whole. */
void full_path_copy(struct full_path *to, const struct full_path *from, unsigned first, unsigned last);

/* Whether nothing lies between v[e] and v[e + 1]. Where media scatter, it also computes the transmittance of edge e,
 * for which the medium of v[e + 1] must be set; an event outside of a scattering medium is not visible. Counts rays. */
bool full_path_visible(struct path_context *c, struct full_path *x, unsigned e);
/* full_path_visible for all edges, at x's wavelengths; only where media scatter. */
bool full_path_see_media(struct path_context *c, struct full_path *x);

/* Where v[edges - 1] lies on the film as seen from v[edges]; false: outside the window that is sampled. */
bool full_path_project(const struct path_context *c, struct full_path *x);

/* The technique with the most light vertices: fewer than all where media do not fit together (path/media.h). */
unsigned full_path_most_light(const struct path_context *c, const struct full_path *x);
/* How many vertices, from v[s] on, the joint of technique s passes (transparent.h). */
unsigned full_path_passed(const struct path_context *c, const struct full_path *x, unsigned s);
/* How many vertices the joint of technique s > 0, which can make x, has of its own: passed ones, or refracted ones. */
unsigned full_path_joint_vertices(const struct path_context *c, const struct full_path *x, unsigned s);
/* Whether technique s > 0 can make it, as far as specular vertices go and nothing is refracted. */
bool full_path_joins(const struct path_context *c, const struct full_path *x, unsigned s);
/* Whether any technique makes it: where media do not fit together, there are paths that none does. */
bool full_path_is_made(const struct path_context *c, const struct full_path *x);

/* Everything that follows from the vertices: edges, modes (those of specular vertices are given), film point,
 * scattering. false: ends coincide, it leaves the window, directions are not of a mode, or it is black. Casts no ray,
 * unless media scatter: then it is also false where an edge is occluded. */
bool full_path_finish(struct path_context *c, struct full_path *x);

/* The path that technique s makes of the sub-paths in c, with everything cached: s vertices of c->light, `passed` that
 * the joint passes, the others of c->camera. Casts the connecting rays. false: there is none, or it is black. */
bool full_path_from_subpaths(struct path_context *c, unsigned s, unsigned passed, unsigned edges, struct full_path *x);

/* Multiplies p by the transmittance of the media along the path. */
void full_path_attenuate_by_media(const struct world *w, const struct full_path *x, struct product *p);
static inline void full_path_attenuate(const struct world *w, const struct full_path *x, struct product *p)
{
	if (EFFECT_IS_ON(w, media))
		full_path_attenuate_by_media(w, x, p);
}

/* CIE XYZ of the path's colour, scaled so that X + Y + Z = 1. */
void full_path_colour(const struct path_context *c, struct full_path *x, double xyz[3]);

#endif
