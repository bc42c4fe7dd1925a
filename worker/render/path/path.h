/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths as vertices with explicit densities (Veach 1997, ch. 8 and 10).
 *
 * The integrand over area measure: L_e prod G prod F W_e, all G with geometric normals, and at each inner vertex
 * F = f_radiance(to camera, to light) |ns . to light| / |ng . to light|: what a path tracer that starts at the camera
 * realises with shading normals, whichever way the path was sampled.
 * Directions on different sides of the shading and the geometric normal are refused (as Mitsuba's strictNormals); which
 * shading normal that is, the camera's side of the path may decide (path_facing).
 *
 * Densities of vertices: per area of the rescaled world; per solid angle for a vertex at infinity; x_0 on a delta
 * emitter counts: 1 times the choice of the emitter, and 0 as found by a path from the camera; times a delta
 * distribution in the direction towards the light, projected on the geometric normal, where scattering is exactly
 * specular (it cancels between all techniques of one path). Roulette is not part of them. The film is sampled with
 * density 1 / pixels (struct film_window).
 */
#ifndef WORKER_RENDER_PATH_PATH_H
#define WORKER_RENDER_PATH_PATH_H

#include "common/film/batch.h"
#include "worker/render/path/sampler.h"
#include "worker/render/world/world.h"

/* The usual value of path_context.roulette: mirrors do not keep a path for ever. */
#define PATH_ROULETTE 0.95

enum { PATH_MAX_EDGES = 128, PATH_MAX_SPLATS = PATH_MAX_EDGES + 2 };

enum vertex_kind { VERTEX_CAMERA, VERTEX_SURFACE, VERTEX_EMITTER, VERTEX_INFINITE };

struct path_vertex {
	enum vertex_kind kind;
	bool delta;		 /* its own sub-path left it by an exactly specular lobe */
	unsigned mode;		 /* of enum bsdf_mode: how its own sub-path left it */
	int32_t emitter;	 /* shines: index; -1 */
	const struct bsdf *bsdf; /* VERTEX_SURFACE */
	uint32_t medium;	 /* on the camera's sub-path: the medium between it and the vertex before */
	struct surface_point
		x;	/* VERTEX_INFINITE: p is the unit direction towards the emitter. A point light's ng is 0 */
	vec3 to_prev;	/* unit; towards the vertex before it on its own sub-path */
	spectrum beta;	/* carried to this vertex over the density of getting here */
	double pdf;	/* of this vertex from its own sub-path, see above */
	double pdf_rev; /* of this vertex as generated from the next two of its own sub-path */
	double next_event[3]; /* random numbers kept for next event estimation */
};

/* The film points that are sampled: the crop and its border, in pixels. */
struct film_window {
	double x, y, width, height;
};

static inline bool film_window_holds(const struct film_window *w, const double film[2])
{
	return film[0] >= w->x && film[0] < w->x + w->width && film[1] >= w->y && film[1] < w->y + w->height;
}

struct path_context;

/* Divides each contribution between the film and somebody else. `keep` is told the weighted contribution l of joining s
 * vertices of the light with t of the camera's at a film point, returns the part of it that the film gets, and sees to
 * the rest. It must leave the context as it finds it. */
struct path_split {
	spectrum (*keep)(struct path_split *p, struct path_context *c, unsigned s, unsigned t, const double film[2],
			 spectrum l);
};

/* One evaluation's surroundings; one a thread. */
struct path_context {
	const struct world *w;
	struct film_window window;
	struct wavelengths wl;
	uint32_t min_depth, max_depth; /* edges */
	double roulette;	       /* the most that a sub-path goes on with; 0: no roulette */
	bool unclassed;		       /* nobody asks for path_sample.classes */
	bool one_way;		       /* nobody asks for pdf_rev: no technique has more than one light vertex */
	uint32_t light_every; /* one in so many samples has a light sub-path, for which it counts so many times; 0 or 1:
				 all have */
	double faint;	      /* what a connection of two surfaces must bring to be made for certain; 0: anything */
	double faint_place;   /* of the next such connection in systematic sampling: see connect.c */
	uint64_t *counters;   /* of enum batch_counter */
	struct path_split *split; /* NULL: the film gets all */
	struct path_vertex camera[PATH_MAX_EDGES + 2], light[PATH_MAX_EDGES + 2];
};

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

/* Goes on from a sub-path of n >= 2 vertices, the last of them a surface. Returns the number of vertices. */
unsigned path_walk_on(struct path_context *c, struct sampler *s, enum sampler_side side, unsigned n,
		      unsigned max_vertices);

/* Density with which `next` is generated from `at` having come from `prev` (unused for camera and emitters). */
double path_pdf(const struct path_context *c, const struct path_vertex *prev, const struct path_vertex *at,
		const struct path_vertex *next, enum transport transport);

/* false: x_0 on a delta emitter, which no path from the camera finds. */
static inline bool path_can_be_hit(const struct path_context *c, const struct path_vertex *v)
{
	bool end = v->kind == VERTEX_EMITTER || v->kind == VERTEX_INFINITE;
	return !end || v->emitter < 0 || !c->w->emitters[v->emitter].delta;
}

/* Kind, emitter and place of a point drawn on an emitter; the rest is 0. */
struct path_vertex path_emitter_vertex(const struct world *w, int32_t emitter, const struct emitter_point *p);

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

/* F of the head comment at a surface vertex for unit directions towards camera and light. */
spectrum path_scatter(const struct path_context *c, const struct path_vertex *v, vec3 to_camera, vec3 to_light);

/* |ng . w| of the geometry terms; 1 where a vertex has no surface: the camera, what lies at infinity, a point light. */
double path_cosine(const struct path_vertex *v, vec3 w);

/* Delta distributions are written in the direction towards the light, projected on the geometric normal: 1 in that
 * measure is the cosine per solid angle. Towards the camera 1 per solid angle there is worth the ratio of the two solid
 * angles, the squared indices and the cosines about which light is bent, those with the shading normal. eta_camera: the
 * index on the camera's side over that on the light's. */
void path_delta_per_solid(const struct surface_point *x, vec3 light, vec3 camera, double eta_camera, double *to_light,
			  double *to_camera);

/* Radiance that leaves an emitter's point in direction w. */
spectrum path_emitted(const struct path_context *c, const struct path_vertex *v, vec3 w, const struct wavelengths *wl);

/* The vertex where the ray from `from` along d ends: a surface, the emitter at infinity, or nothing (false). Counts a
 * ray. */
bool path_extend(struct path_context *c, const struct path_vertex *from, vec3 d, double t_min, double t_max,
		 struct path_vertex *to);

/* Unit direction and squared distance from a to b; b may lie at infinity (distance 1). */
vec3 path_direction(const struct path_vertex *a, const struct path_vertex *b, double *distance2);

/*
 * Media that absorb are numbers: 0 is none, others are 1 + an index into world.media. The camera stands in none. From
 * it on, the medium changes where the path leaves a shape that states an interior or an exterior, to the one on that
 * side (a side without one is empty), and nowhere else, as in Mitsuba: a stone in water need not state any. So the
 * medium of every edge follows from the path seen from the camera, whichever technique made it.
 */

/* The medium of the edge that leaves v along `away`, towards the light, if v was reached through `medium`. */
uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away);
/* The share of light that the edge between two vertices lets through. */
spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b);
/* Gives `to`, which the camera's sub-path reached from `at` along wi, its medium, and to its beta what that lets
 * through. On the light's sub-path that is done when it is joined: only the camera's knows which medium it is in. */
void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to);

/* I = X + Y + Z of what the film gets of l. */
double path_intensity(const struct path_context *c, spectrum l);

/* Adds L (f / p) at a film point; NaN, infinite (beyond a float in sum) and negative ones are counted and left
 * out, as black ones are: false. */
bool path_splat(struct path_context *c, struct path_sample *out, double x, double y, spectrum l);
/* false: L is zero, or was counted as invalid. */
bool path_accept(const struct path_context *c, spectrum l);

#endif
