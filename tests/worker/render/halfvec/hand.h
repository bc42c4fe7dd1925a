/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Full paths built by hand for tests of their derivatives: every vertex lies on a shape of its own (one triangle or a
 * sphere), with an artificial material that has an index of refraction and a roughness. A struct hand holds one path,
 * on the caller's stack or static.
 */
#ifndef TESTS_WORKER_HALFVEC_HAND_H
#define TESTS_WORKER_HALFVEC_HAND_H

#include "tests/support/dice.h"
#include "worker/render/halfvec/constraint.h"

#include <assert.h>
#include <string.h>

enum hand_uv { HAND_UV_NONE, HAND_UV, HAND_UV_DEGENERATE, HAND_TANGENTS };

struct hand {
	struct world w;
	struct full_path x;
	struct geom_shape shape[FULL_PATH_VERTICES_MAX];
	struct bsdf bsdf[FULL_PATH_VERTICES_MAX];
	float position[FULL_PATH_VERTICES_MAX][3][3], normal[FULL_PATH_VERTICES_MAX][3][3],
		uv[FULL_PATH_VERTICES_MAX][3][2], tangent[FULL_PATH_VERTICES_MAX][1][3][3];
	uint32_t index[FULL_PATH_VERTICES_MAX][1][3];
};

static inline void hand_begin(struct hand *h, unsigned edges)
{
	memset(h, 0, sizeof *h);
	h->x.edges = edges;
	h->w.accuracy = accuracy_settings_default;
	h->w.shapes = h->shape;
	h->w.shape_count = FULL_PATH_VERTICES_MAX;
	h->w.camera = (struct camera){.axes = {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
				      .width = 640,
				      .height = 480,
				      .pixels_per_slope = 700,
				      .far_clip = INFINITY};
	for (unsigned j = 0; j < FULL_PATH_VERTICES_MAX; j++) {
		h->bsdf[j] = (struct bsdf){.eta = 1, .min_alpha = 0.1, .mean_alpha = 0.1, .has_smooth = true};
		h->x.v[j].bsdf = &h->bsdf[j];
		h->x.v[j].emitter = -1;
		h->x.v[j].mode = BSDF_REFLECT;
	}
}

static inline vec3 hand_random_tangent(struct dice *d, vec3 n)
{
	vec3 r = dice_direction(d);
	return vec3_normalize(vec3_madd(r, -vec3_dot(r, n), n));
}

/* How to build a triangle. */
struct hand_triangle {
	double size, aspect; /* distance of the corners from p; aspect 1e-4: a sliver */
	bool is_flat;	     /* without vertex normals */
	double bend;	     /* approximate |d normal| per length */
	enum hand_uv uv;
};

/* A triangle around p, facing ng, with a shading normal at p of n up to the rounding to float. */
static inline void hand_triangle(struct hand *h, unsigned j, vec3 p, vec3 ng, vec3 n, const struct hand_triangle *t,
				 struct dice *d)
{
	struct geom_shape *s = &h->shape[j];
	vec3 a = hand_random_tangent(d, ng), b = vec3_cross(ng, a), ga = vec3_scale(t->bend, dice_direction(d)),
	     gb = vec3_scale(t->bend, dice_direction(d));
	double w[3] = {dice_between(d, 0.1, 1), dice_between(d, 0.1, 1), dice_between(d, 0.1, 1)}, off[3][2],
	       mean[2] = {0, 0};
	double sum = w[0] + w[1] + w[2], start = dice_between(d, 0, 6), gain = dice_between(d, 0.5, 2);
	for (int m = 0; m < 3; m++) {
		double phi = start + m * 2.094 + dice_between(d, -0.4, 0.4);
		off[m][0] = t->size * cos(phi);
		off[m][1] = t->size * t->aspect * sin(phi);
		mean[0] += w[m] / sum * off[m][0];
		mean[1] += w[m] / sum * off[m][1];
	}
	for (int m = 0; m < 3; m++) {
		double x = off[m][0] - mean[0], y = off[m][1] - mean[1];
		vec3 q = vec3_madd(vec3_madd(p, x, a), y, b);
		vec3 k = vec3_scale(gain, vec3_madd(vec3_madd(n, x, ga), y, gb));
		memcpy(h->position[j][m], (float[3]){(float)q.x, (float)q.y, (float)q.z}, sizeof(float[3]));
		memcpy(h->normal[j][m], (float[3]){(float)k.x, (float)k.y, (float)k.z}, sizeof(float[3]));
		bool varied = t->uv == HAND_UV || t->uv == HAND_TANGENTS;
		h->uv[j][m][0] = varied ? (float)dice_uniform(d) : 0.5f;
		h->uv[j][m][1] = varied ? (float)dice_uniform(d) : 0.5f;
		h->index[j][0][m] = (uint32_t)m;
	}
	*s = (struct geom_shape){
		.vertex_count = 3, .triangle_count = 1, .position = h->position[j], .index = h->index[j]};
	s->normal = t->is_flat ? NULL : h->normal[j];
	s->uv = t->uv == HAND_UV_NONE ? NULL : h->uv[j];
	if (t->uv == HAND_TANGENTS) { /* tangents that turn by up to a radian between corners */
		vec3 along = hand_random_tangent(d, n);
		for (int m = 0; m < 3; m++) {
			vec3 q = vec3_normalize(vec3_madd(along, 0.5, dice_direction(d)));
			memcpy(h->tangent[j][0][m], (float[3]){(float)q.x, (float)q.y, (float)q.z}, sizeof(float[3]));
		}
		s->tangent = h->tangent[j];
	}
	surface_on_triangle(s, (struct prim_ref){j, 0, 0}, w[1] / sum, w[2] / sum, &h->x.v[j].x);
	h->x.v[j].kind = VERTEX_SURFACE;
}

/* A sphere through p with the normal n there; sign -1: the normal points inwards. The pole lies at the angle `polar`
 * from n. */
static inline void hand_place_sphere(struct hand *h, unsigned j, vec3 p, vec3 n, double radius, double sign,
				     double polar, struct dice *d)
{
	struct geom_shape *s = &h->shape[j];
	vec3 w = vec3_scale(sign, n), side = hand_random_tangent(d, w);
	*s = (struct geom_shape){
		.is_sphere = true, .center = vec3_madd(p, -radius, w), .radius = radius, .normal_sign = sign};
	s->sphere_axes = frame_around(vec3_normalize(vec3_madd(vec3_scale(cos(polar), w), sin(polar), side)));
	surface_on_sphere(s, (struct prim_ref){j, 0, 0}, w, &h->x.v[j].x);
	h->x.v[j].kind = VERTEX_SURFACE;
}

static inline void hand_place_camera(struct hand *h, unsigned j, vec3 p)
{
	h->x.v[j].kind = VERTEX_CAMERA;
	h->x.v[j].x = (struct surface_point){.p = p, .prim = PRIM_NONE};
	h->w.camera.position = p;
}

static inline void hand_place_infinite(struct hand *h, vec3 direction)
{
	h->x.v[0].kind = VERTEX_INFINITE;
	h->x.v[0].x = (struct surface_point){.p = direction, .prim = PRIM_NONE};
}

/* An emitter at p with the normal ng; ng = 0: a point light. */
static inline void hand_place_emitter(struct hand *h, vec3 p, vec3 ng)
{
	h->x.v[0].kind = VERTEX_EMITTER;
	h->x.v[0].x = (struct surface_point){.p = p, .ng = ng, .sh = {.n = ng}, .prim = PRIM_NONE};
}

static inline void hand_compute_edges(struct hand *h)
{
	for (unsigned e = 0; e < h->x.edges; e++) {
		bool apart = full_path_compute_edge(&h->x, e);
		assert(apart);
		(void)apart;
	}
}

/* Sets how vertex j scatters: eta is n_o / n_i, or 0 for reflection. The edges must be joined already. */
static inline void hand_set_scattering(struct hand *h, unsigned j, double eta)
{
	bool above = vec3_dot(h->x.v[j].x.sh.n, h->x.edge[j].w) > 0;
	h->x.v[j].mode = eta == 0 ? BSDF_REFLECT : BSDF_TRANSMIT;
	h->bsdf[j].eta = eta == 0 ? 1.5 : above ? 1 / eta : eta;
}

/* Makes a random chain of `edges` edges on spheres, or, if `bent`, on triangles with n != ng. Returns false if an
 * edge came too close to grazing. */
static inline bool hand_make_chain(struct hand *h, unsigned edges, double bent, struct dice *d)
{
	static const double etas[] = {1.5, 1 / 1.5, 1.33, 1.2};
	vec3 p[FULL_PATH_VERTICES_MAX];
	double eta[FULL_PATH_VERTICES_MAX] = {0};
	hand_begin(h, edges);
	for (unsigned j = 0; j <= edges; j++)
		p[j] = (vec3){dice_between(d, -1, 1), dice_between(d, -1, 1), dice_between(d, -1, 1)};
	for (unsigned j = 0; j <= edges; j++) {
		vec3 ng = dice_direction(d), n = ng;
		if (j > 0 && j < edges) {
			eta[j] = dice_uniform(d) < 0.5 ? 0 : etas[dice_below(d, 4)];
			vec3 i = vec3_normalize(vec3_sub(p[j - 1], p[j])), o = vec3_normalize(vec3_sub(p[j + 1], p[j]));
			vec3 sum = vec3_madd(i, eta[j] == 0 ? 1 : eta[j], o);
			if (vec3_length(sum) < 0.2)
				return false;
			n = ng = vec3_normalize(
				vec3_madd(vec3_normalize(sum), 0.3 * dice_uniform(d), dice_direction(d)));
			ng = vec3_normalize(vec3_madd(n, bent, dice_direction(d)));
			if (fmin(fabs(vec3_dot(ng, i)), fabs(vec3_dot(ng, o))) < 0.05)
				return false;
		}
		const struct hand_triangle t = {.size = 0.3, .aspect = 1, .bend = 2, .uv = HAND_UV};
		if (bent > 0)
			hand_triangle(h, j, p[j], ng, n, &t, d);
		else
			hand_place_sphere(h, j, p[j], n, dice_between(d, 0.2, 2), dice_uniform(d) < 0.3 ? -1 : 1,
					  dice_between(d, 0.3, 2.8), d);
	}
	hand_compute_edges(h);
	for (unsigned j = 1; j < edges; j++)
		hand_set_scattering(h, j, eta[j]);
	return true;
}

#endif
