/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths as vertices with explicit densities (Veach 1997, ch. 8 and 10).
 *
 * The integrand with respect to area measure is L_e prod G prod F W_e. All geometry terms G use geometric normals. At
 * an inner vertex, F = f_radiance(to camera, to light) |ns . to light| / |ng . to light|, with shading normal ns and
 * geometric normal ng: what a path tracer that starts at the camera computes with shading normals, whichever technique
 * sampled the path. In a medium, F is sigma_s times the phase function and G has no cosine at that vertex. Every edge
 * is multiplied by the transmittance of the media along it (media.h). Directions that lie on different sides of the
 * shading and the geometric normal carry no light (like Mitsuba's strictNormals). Where the shading normal can be
 * turned round, the side of the camera decides (path_point_facing_camera).
 */
#ifndef WORKER_RENDER_PATH_PATH_H
#define WORKER_RENDER_PATH_PATH_H

#include "worker/render/path/sampler.h"
#include "worker/render/path/vertex.h"

/* The usual value of path_context.max_survival; below 1, so that paths between mirrors end, too. */
#define PATH_SURVIVAL_MAX 0.95

enum { PATH_SPLATS_MAX = PATH_EDGES_MAX + 2 };

/* One contribution to the film: f / p over the whole window, as CIE XYZ. */
struct splat {
	double x, y, xyz[3];
};

/* The receiver of splats; it is the first member of a film or of a map. */
struct splat_target {
	void (*add_splat)(struct splat_target *to, const struct splat *s, double weight);
};

struct path_sample {
	uint32_t splat_count;
	double intensity; /* I: the sum of X + Y + Z over all splats */
	/* Bit n is set if path class n carries light; class_intensity is 0 for all other classes. Always 0
	 * with path_context.skips_classes. */
	uint32_t class_mask;
	double class_intensity[PATH_CLASSES]; /* the part of the intensity in each class */
	struct splat splats[PATH_SPLATS_MAX];
};

/* Evaluates one point of the space of random numbers: see struct integrator.evaluate. */
typedef void path_tracer(struct path_context *c, struct sampler *s, struct path_sample *out);

struct film_window film_window_from_plan(const struct plan *p);

/* Prepares *c for independent samples of the plan's film, with roulette and without path classes. Events are counted in
 * `counters`, which stays the caller's. */
void path_context_init_for_samples(struct path_context *c, const struct world *w, const struct plan *p,
				   uint64_t *counters);

/* Walks a camera sub-path into c->camera. Vertex 0 is the pinhole or a point of the aperture; its density is 1 in
 * every technique. Returns the number of vertices; a path that escapes may end in VERTEX_INFINITE. Sets film to the
 * film point that was drawn. */
unsigned path_walk_camera(struct path_context *c, struct sampler *s, unsigned max_vertices, double film[2]);
/* Walks a light sub-path into c->light; vertex 0 lies on an emitter. Returns the number of vertices: 0 if there is no
 * emitter or it could not be sampled. */
unsigned path_walk_light(struct path_context *c, struct sampler *s, unsigned max_vertices);

/* Continues a sub-path of n >= 2 vertices whose last vertex is not at infinity. Returns the new number of vertices. */
unsigned path_continue_walk(struct path_context *c, struct sampler *s, enum sampler_side side, unsigned n,
			    unsigned max_vertices);

/* Returns the density with which `next` is generated from `vertex`, for a sub-path that came from `prev` (unused if
 * `vertex` is the camera or on an emitter). The measure is that of vertex.h. */
double path_pdf(const struct path_context *c, const struct path_vertex *prev, const struct path_vertex *vertex,
		const struct path_vertex *next, enum transport transport);

/* Returns the point of a surface vertex with the shading frame in which it scatters towards the camera. Where a relief
 * bends the normal away from the camera, this is the frame of the turned normal (relief.flips_invalid_normals), stored
 * in *turned; otherwise such places would be black. Surfaces with specular lobes keep their frame, because their paths
 * are found with the normal, before the side is known. */
const struct surface_point *path_bent_point_facing_camera(const struct path_vertex *v, vec3 to_camera,
							  struct surface_point *turned);
static inline const struct surface_point *path_point_facing_camera(const struct path_vertex *v, vec3 to_camera,
								   struct surface_point *turned)
{
	const struct geom_shape *s = v->x.shape;
	return s && s->relief && s->relief->flips_invalid_normals ? path_bent_point_facing_camera(v, to_camera, turned)
								  : &v->x;
}

/* Whether w lies on the same side of the geometric and the shading normal. */
static inline bool path_sides_agree(const struct surface_point *x, vec3 w)
{
	return vec3_dot(x->ng, w) * vec3_dot(x->sh.n, w) > 0;
}

/* Returns the refractive index on the camera's side of v divided by that on the light's side; 1 if
 * v's mode does not refract. */
static inline double path_eta(const struct path_vertex *v, const struct wavelengths *wl, vec3 to_camera)
{
	if (!(v->mode & BSDF_TRANSMIT) || (v->mode & BSDF_STRAIGHT))
		return 1;
	double eta = bsdf_eta(v->bsdf, wl);
	return vec3_dot(v->x.sh.n, to_camera) > 0 ? 1 / eta : eta;
}

/* Returns F of the comment at the top, at a surface vertex or in a medium, for unit directions
 * towards camera and light. */
spectrum path_scatter(const struct path_context *c, const struct path_vertex *v, vec3 to_camera, vec3 to_light);

/* Returns the probability with which a sub-path that comes from wo chooses the specular lobe `mode`. p->transport says
 * whether the sub-path started at the camera or at the light. */
double path_delta_probability(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode);

/* Returns the weight of the specular lobe by which v's sub-path, which comes from v->to_prev on the camera's side,
 * leaves v. It is also zero if no sub-path ever chooses that lobe, because densities are divided by the
 * probability of the choice. */
spectrum path_delta_weight(const struct path_context *c, const struct path_vertex *v);

/* Delta distributions are expressed in the direction towards the light, projected on the geometric normal. A unit
 * density in that measure is to_light = |ng . light| per solid angle towards the light. Per solid angle towards the
 * camera it is to_camera: to_light times the ratio of the two solid angles, which follows from the squared refractive
 * indices and the cosines with the shading normal, about which light is bent. eta_camera: refractive index on the
 * camera's side divided by that on the light's side. */
void path_delta_densities(const struct surface_point *x, vec3 light, vec3 camera, double eta_camera, double *to_light,
			  double *to_camera);

/* Returns I = X + Y + Z of the film's response to l. */
double path_intensity(const struct path_context *c, spectrum l);

/* Adds the contribution l (f / p) at a film point. Returns false if nothing was added: l is black, or NaN, negative or
 * infinite (also if the sum exceeds a float), which is counted. */
bool path_sample_add_splat(struct path_context *c, struct path_sample *out, double x, double y, spectrum l);
/* Returns false if l is zero or invalid (NaN, infinite, negative); invalid contributions are counted. */
bool path_accept(const struct path_context *c, spectrum l);

#endif
