/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Path vertices and the context in which they are made.
 *
 * Densities of vertices are per area of the rescaled world; in a medium per volume; for a vertex at infinity per solid
 * angle. For x_0 on a delta emitter, the density is that of choosing the emitter, and 0 for a camera sub-path, which
 * cannot hit it. At an exactly specular vertex, the density contains a delta distribution in the direction towards the
 * light, projected on the geometric normal; it cancels between all techniques of one path. Roulette is not part of the
 * densities. The film is sampled with density 1 / pixels (struct film_window).
 */
#ifndef WORKER_RENDER_PATH_VERTEX_H
#define WORKER_RENDER_PATH_VERTEX_H

#include "common/film/batch.h"
#include "worker/render/world/world.h"

enum {
	PATH_EDGES_MAX = 128,
	PATH_PASSED_VERTICES_MAX = 16,	 /* limit on the surfaces that one connection passes straight through */
	PATH_REFRACTED_VERTICES_MAX = 8, /* limit on the surfaces that refract one connection */
};

enum vertex_kind { VERTEX_CAMERA, VERTEX_SURFACE, VERTEX_EMITTER, VERTEX_INFINITE, VERTEX_MEDIUM };

/* The media along the edge between a vertex and its predecessor: see media.h. Set on the camera's sub-path, and on the
 * light's sub-path only where media scatter. */
struct path_edge {
	/* Medium of the edge at the vertex; for VERTEX_MEDIUM, the medium that contains the vertex. */
	uint32_t medium;
	/* The other members are only set where media scatter. */
	uint32_t previous_medium; /* medium of the edge at the preceding vertex */
	/* Every `null` face along the edge that states media has the edge's medium on the side from which the edge
	 * reaches it. */
	bool has_matching_media;
	spectrum scattering_transmittance; /* exp(-optical depth) of the scattering media along the edge */
	vec3 d;				   /* unit direction of the edge; either orientation */
};

struct path_vertex {
	enum vertex_kind kind;
	bool is_delta;		 /* its own sub-path left it by an exactly specular lobe */
	unsigned mode;		 /* bits of enum bsdf_mode: how its own sub-path left it */
	int32_t emitter;	 /* index of the emitter; -1 if the vertex does not emit */
	const struct bsdf *bsdf; /* VERTEX_SURFACE */
	struct path_edge edge;	 /* from the preceding vertex of its own sub-path */
	/* For VERTEX_INFINITE, p is the unit direction towards the emitter; a point light has ng = 0; VERTEX_MEDIUM
	 * only has p. prim.time is always set. */
	struct surface_point x;
	vec3 to_prev; /* unit direction towards the preceding vertex of its own sub-path */
	/* Throughput: the contribution of the sub-path up to this vertex divided by its density. */
	spectrum beta;
	double pdf; /* density of this vertex on its own sub-path; the measure is stated above */
	/* Density of this vertex if it were generated from the other end, from the next two
	 * vertices of its own sub-path. */
	double pdf_rev;
	double next_event[3]; /* random numbers reserved for next event estimation */
};

/* The region of the film that is sampled, in pixels: the crop and its border. */
struct film_window {
	double x, y, width, height;
};

static inline bool film_window_contains(const struct film_window *w, const double film[2])
{
	return film[0] >= w->x && film[0] < w->x + w->width && film[1] >= w->y && film[1] < w->y + w->height;
}

struct path_context;

/* Divides each contribution between the film and another consumer. `film_part` is given the weighted contribution l of
 * joining s light vertices to t camera vertices, which lands at `film`. It returns the part of l that the film gets and
 * takes care of the rest. It must leave the context as it finds it. */
struct path_split {
	spectrum (*film_part)(struct path_split *split, struct path_context *c, unsigned s, unsigned t,
			      const double film[2], spectrum l);
};

/* A path along which light from a point of an emitter is refracted to a vertex: see path/refracted.h. */
struct path_refraction {
	unsigned count;
	struct path_vertex v[PATH_REFRACTED_VERTICES_MAX]; /* ordered from the camera to the emitter */
	double log_transfer;				   /* log T of refracted.h */
};
/* The last refraction that was computed to weight a path of another technique. All connections to one light sub-path
 * need the same one, so it is kept. */
struct path_refraction_cache {
	bool is_filled, has_refraction;
	vec3 z, y;
	double time, nm;
	struct path_refraction refraction;
};
/* Finds the refracted path between z and y, which lies on an emitter. Returns false if there is none. */
typedef bool path_refract(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			  struct path_refraction *out);

/* The context of one evaluation. Each thread has its own. */
struct path_context {
	const struct world *w;
	struct film_window window;
	struct wavelengths wl;
	double time; /* time of both sub-paths: see struct prim_ref */
	/* Limits on the number of edges of a path. */
	uint32_t min_depth, max_depth;
	double max_survival; /* upper limit on the survival probability; 0: no roulette */
	bool skips_classes;  /* path_sample.class_mask and class_intensity are not needed */
	/* pdf_rev is not needed, because no technique has more than one light vertex. */
	bool is_unidirectional;
	/* Points of emitters are joined to the lens, which also finds paths of one edge. */
	bool joins_emitters_to_lens;
	/* Connections do not look through surfaces, even if the world's effects allow it. */
	bool joints_are_opaque;
	/* A vertex removed from the front of the camera sub-path dispersed the light (path/overlong.c). */
	bool is_dispersed;
	/* Only one in light_subpath_interval samples has a light sub-path, whose contributions are multiplied by
	 * light_subpath_interval. 0 or 1: every sample has one. */
	uint32_t light_subpath_interval;
	bool makes_faint_connections; /* every connection is made, however faint */
	/* A connection between two surfaces that contributes less than this is only made with a
	 * probability. 0: make all. */
	double faint_threshold;
	/* Position of the next faint connection in the systematic sampling of connect.c. */
	double faint_position;
	uint64_t *counters;	  /* indexed by enum batch_counter */
	struct path_split *split; /* NULL: the film gets every contribution */
	path_refract *refract;	  /* NULL: connections are not refracted */
	struct path_vertex camera[PATH_EDGES_MAX + 2], light[PATH_EDGES_MAX + 2];
	/* The vertices that the last connection passed (transparent.h) or at which it was refracted (refracted.h),
	 * ordered from the camera to the light. Their pdf is that of a camera sub-path that meets them one by one. */
	unsigned passed_count;
	struct path_vertex passed[PATH_PASSED_VERTICES_MAX];
	double log_transfer; /* log T of refracted.h if the last connection was refracted */
	struct path_refraction_cache refraction_cache;
	/* emission[e], for e = 1 .. emission_edges, is the contribution of the light that media emit along edge e of
	 * the camera's sub-path, whether or not the edge ends in a vertex (volume_emission.h). */
	unsigned emission_edges;
	spectrum emission[PATH_EDGES_MAX + 1];
};

/* Returns false for x_0 on a delta emitter, which no camera sub-path can hit. */
static inline bool path_can_be_hit(const struct path_context *c, const struct path_vertex *v)
{
	bool is_emitter_point = v->kind == VERTEX_EMITTER || v->kind == VERTEX_INFINITE;
	return !is_emitter_point || v->emitter < 0 || !c->w->emitters[v->emitter].is_delta;
}

/* Returns a vertex with the kind, emitter, position and time of a point drawn on an emitter; all other members are
 * 0. */
struct path_vertex path_emitter_vertex(const struct world *w, int32_t emitter, const struct emitter_point *p,
				       double time);

/* Whether v scatters light into a range of directions, so that it can be joined to another vertex. v
 * must be an inner vertex. */
static inline bool path_scatters_smoothly(const struct path_vertex *v)
{
	return v->kind == VERTEX_MEDIUM || v->bsdf->has_smooth;
}

/* Whether the path continues from v with a single wavelength. */
static inline bool path_vertex_disperses(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->bsdf->is_dispersive;
}

/* Returns |ng . w| of the geometry term; 1 for vertices without a surface: the camera, vertices at infinity, point
 * lights and vertices in media. */
static inline double path_cosine(const struct path_vertex *v, vec3 w)
{
	vec3 n = v->x.ng;
	if (v->kind == VERTEX_CAMERA || v->kind == VERTEX_INFINITE || (n.x == 0 && n.y == 0 && n.z == 0))
		return 1;
	return fabs(vec3_dot(n, w));
}

/* Whether a ray along w meets the vertex: culled curves are only met from outside. */
static inline bool path_ray_can_meet(vec3 w, const struct path_vertex *v)
{
	const struct geom_shape *s = v->kind == VERTEX_SURFACE ? v->x.shape : NULL; /* photons (merging.h) have none */
	return !s || !s->culls_backfaces || vec3_dot(v->x.ng, w) < 0;
}

/* Converts a density per solid angle at x to one per area at y, or per volume if y is in a medium. omega: the unit
 * direction between x and y. */
static inline double path_jac_solid_from_vertex(const struct path_vertex *y, vec3 omega, double distance2)
{
	return path_cosine(y, omega) / distance2;
}

/* The geometry term without visibility. */
static inline double path_geometry_term(const struct path_vertex *x, const struct path_vertex *y, vec3 omega,
					double distance2)
{
	return path_cosine(x, omega) * path_cosine(y, omega) / distance2;
}

/* Returns the radiance that the emitter's point v emits in direction w. */
spectrum path_emitted_radiance(const struct path_context *c, const struct path_vertex *v, vec3 w,
			       const struct wavelengths *wl);

/* Traces the ray from `from` along d and fills in the vertex where it ends: a surface, or the emitter at infinity.
 * Returns false if it meets neither. Counts a ray. */
bool path_extend(struct path_context *c, const struct path_vertex *from, vec3 d, double t_min, double t_max,
		 struct path_vertex *to);

/* Returns the unit direction from a to b and sets the squared distance (1 if one of them lies at infinity). The
 * direction is 0 if a and b coincide. */
static inline vec3 path_direction(const struct path_vertex *a, const struct path_vertex *b, double *distance2)
{
	*distance2 = 1;
	if (b->kind == VERTEX_INFINITE)
		return b->x.p;
	if (a->kind == VERTEX_INFINITE)
		return vec3_neg(a->x.p);
	vec3 d = vec3_sub(b->x.p, a->x.p);
	*distance2 = vec3_dot(d, d);
	return *distance2 > 0 ? vec3_scale(1 / sqrt(*distance2), d) : (vec3){0, 0, 0};
}

#endif
