/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A whole path from an emitter to the camera: the state of chains in path space.
 *
 * v[0] is x_0 on the emitter (or the direction towards it, at infinity), v[edges] is x_k on the camera's aperture. A
 * whole path uses these members of struct path_vertex: kind, mode (inner vertices: how they scatter), is_delta,
 * emitter, bsdf, x, to_prev (the unit direction towards v[i + 1], on the camera's side) and, as caches, pdf and pdf_rev
 * (the densities of the vertex as generated from the camera's side and from the light's side).
 *
 * i_j is the unit direction from v[j] to v[j - 1], o_j the one to v[j + 1]. The contribution is measured as in path.h:
 * per area, per solid angle at infinity, without the delta distributions, which are the same for all paths with the
 * same modes. One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_FULL_PATH_H
#define WORKER_RENDER_PATH_FULL_PATH_H

#include "worker/render/path/connect.h"

enum {
	FULL_PATH_EDGES_MAX = PATH_EDGES_MAX,
	FULL_PATH_VERTICES_MAX = FULL_PATH_EDGES_MAX + 1,
};

struct vertex_set {
	uint64_t word[FULL_PATH_VERTICES_MAX / 64 + 1];
};

static inline bool vertex_set_has(const struct vertex_set *s, unsigned j)
{
	return s->word[j / 64] >> (j % 64) & 1;
}

static inline void vertex_set_add(struct vertex_set *s, unsigned j)
{
	s->word[j / 64] |= (uint64_t)1 << (j % 64);
}

/* The edge between v[e] and v[e + 1]. */
struct full_path_edge {
	vec3 w;			/* unit, from v[e] to v[e + 1] */
	double distance2;	/* 1 where v[0] lies at infinity */
	spectrum transmittance; /* transmittance of the edge, where media scatter */
};

struct full_path {
	unsigned edges; /* k; 0: no path */
	struct wavelengths wl;
	double wavelength_u; /* the number in [0,1) from which wl was computed */
	double film[2];
	struct path_vertex v[FULL_PATH_VERTICES_MAX];
	struct full_path_edge edge[FULL_PATH_EDGES_MAX];
	/* Caches for each vertex: read them through full_path_eval_f and full_path_eval_fh. */
	struct vertex_set cached_f, cached_fh;
	spectrum f[FULL_PATH_VERTICES_MAX], fh[FULL_PATH_VERTICES_MAX];
};

/* A product that neither over- nor underflows: its value is v 2^exponent. */
struct scaled_product {
	spectrum v;
	int exponent;
};
#define PRODUCT_ONE ((struct scaled_product){{{1, 1, 1, 1}}, 0})
void scaled_product_mul(struct scaled_product *p, spectrum f);
/* Returns log(X + Y + Z) of the film's response to the product; -INFINITY for black. */
double scaled_product_log_intensity(const struct path_context *c, const struct full_path *x,
				    const struct scaled_product *p);

/* The time of the whole path: see struct prim_ref. */
static inline double full_path_time(const struct full_path *x)
{
	return x->v[0].x.prim.time;
}

/* Computes edge e from the positions of its ends, and to_prev of v[e]. Returns false if the ends coincide. */
bool full_path_compute_edge(struct full_path *x, unsigned e);

/* Whether an inner vertex scatters with another shading normal than that of v[j].x (see path_point_facing_camera). Half
 * vectors refer to the normal of v[j].x and cannot describe such a vertex. */
bool full_path_is_turned(const struct full_path *x, unsigned j);
/* Returns |n . i_j| at an inner vertex, where n is the shading normal with which it scatters. */
double full_path_cosine_to_light(const struct full_path *x, unsigned j);

/* Returns BSDF_REFLECT or BSDF_TRANSMIT, depending on the sides of o_j and i_j; 0 if the shading and the geometric
 * normal disagree about a side, in which case nothing scatters. */
unsigned full_path_mode(const struct full_path *x, unsigned j);

/* Returns n_o / n_i at v[j], the refractive index on the camera's side divided by that on the light's
 * side; 1 if v[j] reflects. */
double full_path_eta(const struct full_path *x, unsigned j);

/* Returns the scattering factor of v[j]. For v[0] this is L_e towards v[1]; for inner vertices f_radiance(o, i) without
 * cosine, or the weight of the lobe if specular. Computed on first use. */
spectrum full_path_eval_f(const struct path_context *c, struct full_path *x, unsigned j);
/* Like full_path_eval_f for inner vertices, but in half vector space: f |n.i| |d i / d h_par| (bsdf_eval_halfvec), or
 * the weight of the lobe if specular; 0 where full_path_is_turned. */
spectrum full_path_eval_fh(const struct path_context *c, struct full_path *x, unsigned j);
/* Invalidates the caches of the vertices first..last, which are about to change, and of their neighbours. */
void full_path_invalidate(struct full_path *x, unsigned first, unsigned last);
/* Returns the weight of the exactly specular lobe of v[j]'s mode as seen along o_j (see bsdf_eval_delta). Sets its
 * direction in the shading frame and the probability with which it is chosen. */
spectrum full_path_specular_weight(const struct full_path *x, unsigned j, vec3 *wi, double *probability);
/* Returns the distance between i_j and the unit direction into which the exactly specular lobe of v[j]'s mode sends
 * o_j; INFINITY if there is no such lobe. */
double full_path_specular_error(const struct full_path *x, unsigned j);
void full_path_set_wavelength(const struct path_context *c, struct full_path *x, double u);

/* Copies the vertices first..last with their edges and caches, and the members that belong to the path as a whole. */
void full_path_copy(struct full_path *to, const struct full_path *from, unsigned first, unsigned last);

/* Whether nothing lies between v[e] and v[e + 1]. Where media scatter, it also computes the transmittance of
 * edge e, for which the medium of v[e + 1] must be set; a VERTEX_MEDIUM outside of a scattering medium is
 * not visible. Counts rays. */
bool full_path_edge_is_visible(struct path_context *c, struct full_path *x, unsigned e);
/* Calls full_path_edge_is_visible for all edges, at x's wavelengths; only where media scatter. */
bool full_path_edges_are_visible(struct path_context *c, struct full_path *x);

/* Sets x->film to the projection of v[edges - 1] as seen from v[edges]. Returns false if it lies outside
 * the window that is sampled. */
bool full_path_project(const struct path_context *c, struct full_path *x);

/* Returns the largest number of light vertices of any technique that can make x; less than `edges` where the scene
 * states media that do not fit together (path/media.h). */
unsigned full_path_max_light_vertices(const struct path_context *c, const struct full_path *x);
/* Returns the number of vertices, starting at v[s], that the joint of technique s passes (transparent.h). */
unsigned full_path_passed_count(const struct path_context *c, const struct full_path *x, unsigned s);
/* Returns the number of passed or refracting vertices in the joint of technique s > 0, which must be able to make x. */
unsigned full_path_joint_vertex_count(const struct path_context *c, const struct full_path *x, unsigned s);
/* Whether technique s > 0 can make x by a joint that is not refracted, as far as specular vertices are concerned. */
bool full_path_can_join(const struct path_context *c, const struct full_path *x, unsigned s);
/* Whether any technique can make x. Where media do not fit together, some paths cannot be made at all. */
bool full_path_can_be_made(const struct path_context *c, const struct full_path *x);

/* Computes everything that follows from the vertices: edges, modes (those of specular vertices are given), film point,
 * scattering. Returns false if two neighbours coincide, the path leaves the window, the directions contradict a mode,
 * or the path is black. Casts no ray, unless media scatter; then it also returns false if an edge is occluded. */
bool full_path_finish(struct path_context *c, struct full_path *x);

/* Builds the path that technique s makes of the sub-paths in c, with all caches filled: s vertices of c->light,
 * `passed` vertices of the joint, and the rest from c->camera. Casts the connecting rays. Returns false if there is no
 * such path or it is black. */
bool full_path_from_subpaths(struct path_context *c, unsigned s, unsigned passed, unsigned edges, struct full_path *x);

/* Multiplies p by the transmittance of the media along the path. */
void full_path_attenuate_by_media(const struct world *w, const struct full_path *x, struct scaled_product *p);
static inline void full_path_attenuate(const struct world *w, const struct full_path *x, struct scaled_product *p)
{
	if (EFFECT_IS_ON(w, media))
		full_path_attenuate_by_media(w, x, p);
}

/* Sets xyz to the path's colour in CIE XYZ, scaled so that X + Y + Z = 1. */
void full_path_colour(const struct path_context *c, struct full_path *x, double xyz[3]);

#endif
