/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths as vertices with explicit densities (Veach 1997, ch. 8 and 10).
 *
 * The integrand over area measure: L_e prod G prod F W_e, all G with geometric normals, and at each inner vertex
 * F = f_radiance(to camera, to light) |ns . to light| / |ng . to light|: what a path tracer that starts at the camera
 * realises with shading normals, whichever way the path was sampled. In a medium F = sigma_s times the phase function,
 * and G has no cosine there; every edge counts what media let through (media.h).
 * Directions on different sides of the shading and the geometric normal are refused (as Mitsuba's strictNormals); which
 * shading normal that is, the camera's side of the path may decide (path_facing).
 */
#ifndef WORKER_RENDER_PATH_PATH_H
#define WORKER_RENDER_PATH_PATH_H

#include "worker/render/path/sampler.h"
#include "worker/render/path/vertex.h"

/* The usual value of path_context.roulette: mirrors do not keep a path for ever. */
#define PATH_ROULETTE 0.95

enum { PATH_MAX_SPLATS = PATH_MAX_EDGES + 2 };

/* What one evaluation brings to the film: f / p over the whole window, as CIE XYZ. */
struct splat {
	double x, y, xyz[3];
};

/* Where splats go: the first member of a film or of a map. */
struct splat_target {
	void (*splat)(struct splat_target *to, const struct splat *s, double weight);
};

struct path_sample {
	uint32_t count;
	double intensity; /* I: sum of X + Y + Z */
	uint32_t classes; /* bit a path class: it carries light, the others of of_class are 0; 0 where nobody asks */
	double of_class[PATH_CLASSES]; /* its part of the intensity */
	struct splat splats[PATH_MAX_SPLATS];
};

/* What an integrator does with one point of the space of random numbers: struct integrator.evaluate. */
typedef void path_tracer(struct path_context *c, struct sampler *s, struct path_sample *out);

struct film_window film_window_of(const struct plan *p);

/* For independent samples of the plan's film, with roulette and without path classes. Counts into counters. */
void path_context_for_samples(struct path_context *c, const struct world *w, const struct plan *p, uint64_t *counters);

/* Camera sub-path: vertex 0 is the pinhole or a point of the aperture, whose density is 1 in every technique. Returns
 * the number of vertices; an escaped path may end in VERTEX_INFINITE. film: the film point that was drawn. */
unsigned path_walk_camera(struct path_context *c, struct sampler *s, unsigned max_vertices, double film[2]);
/* Light sub-path: vertex 0 lies on an emitter. 0: no emitter, or it could not be sampled. */
unsigned path_walk_light(struct path_context *c, struct sampler *s, unsigned max_vertices);

/* Goes on from a sub-path of n >= 2 vertices, the last of them not at infinity. Returns the number of vertices. */
unsigned path_walk_on(struct path_context *c, struct sampler *s, enum sampler_side side, unsigned n,
		      unsigned max_vertices);

/* Density with which `next` is generated from `at` having come from `prev` (unused for camera and emitters). */
double path_pdf(const struct path_context *c, const struct path_vertex *prev, const struct path_vertex *at,
		const struct path_vertex *next, enum transport transport);

/* The point of a surface vertex with the shading frame in which it scatters towards the camera. Where relief bends the
 * normal away from the camera, that is the one turned round (relief.turns), made in *turned: otherwise such places were
 * black. Surfaces with specular lobes keep theirs: their paths are found by the normal, before the side is known. */
const struct surface_point *path_facing_bent(const struct path_vertex *v, vec3 to_camera, struct surface_point *turned);
static inline const struct surface_point *path_facing(const struct path_vertex *v, vec3 to_camera,
						      struct surface_point *turned)
{
	const struct geom_shape *s = v->x.shape;
	return s && s->relief && s->relief->turns ? path_facing_bent(v, to_camera, turned) : &v->x;
}

/* Both normals see w from the same side. */
static inline bool path_same_side(const struct surface_point *x, vec3 w)
{
	return vec3_dot(x->ng, w) * vec3_dot(x->sh.n, w) > 0;
}

/* The index on the camera's side of v over that on the light's; 1 where its mode does not refract. */
static inline double path_eta(const struct path_vertex *v, const struct wavelengths *wl, vec3 to_camera)
{
	if (!(v->mode & BSDF_TRANSMIT) || (v->mode & BSDF_STRAIGHT))
		return 1;
	double eta = bsdf_eta(v->bsdf, wl);
	return vec3_dot(v->x.sh.n, to_camera) > 0 ? 1 / eta : eta;
}

/* F of the head comment at a surface vertex for unit directions towards camera and light. */
spectrum path_scatter(const struct path_context *c, const struct path_vertex *v, vec3 to_camera, vec3 to_light);

/* The probability with which a path that comes from wo chooses the specular lobe `mode`; p->transport: whose path. */
double path_delta_chance(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode);

/* The weight of the specular lobe by which v's path, which comes from v->to_prev on the camera's side, leaves it; zero
 * also if no sub-path chooses that lobe: densities are divided by the probability of doing so. */
spectrum path_delta_share(const struct path_context *c, const struct path_vertex *v);

/* Delta distributions are written in the direction towards the light, projected on the geometric normal: 1 in that
 * measure is the cosine per solid angle. Towards the camera 1 per solid angle there is worth the ratio of the two solid
 * angles, the squared indices and the cosines about which light is bent, those with the shading normal. eta_camera: the
 * index on the camera's side over that on the light's. */
void path_delta_per_solid(const struct surface_point *x, vec3 light, vec3 camera, double eta_camera, double *to_light,
			  double *to_camera);

/* I = X + Y + Z of what the film gets of l. */
double path_intensity(const struct path_context *c, spectrum l);

/* Adds L (f / p) at a film point; NaN, infinite (beyond a float in sum) and negative ones are counted and left
 * out, as black ones are: false. */
bool path_splat(struct path_context *c, struct path_sample *out, double x, double y, spectrum l);
/* false: L is zero, or was counted as invalid. */
bool path_accept(const struct path_context *c, spectrum l);

#endif
