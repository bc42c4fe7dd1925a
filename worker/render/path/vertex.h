/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertices of paths, and what surrounds their making.
 *
 * Densities of vertices: per area of the rescaled world, in a medium per volume; per solid angle for a vertex at
 * infinity; x_0 on a delta emitter counts: 1 times the choice of the emitter, and 0 as found by a path from the camera;
 * times a delta distribution in the direction towards the light, projected on the geometric normal, where scattering is
 * exactly specular (it cancels between all techniques of one path). Roulette is not part of them. The film is sampled
 * with density 1 / pixels (struct film_window).
 */
#ifndef WORKER_RENDER_PATH_VERTEX_H
#define WORKER_RENDER_PATH_VERTEX_H

#include "common/film/batch.h"
#include "worker/render/world/world.h"

enum {
	PATH_MAX_EDGES = 128,
	PATH_PASSED_MOST = 16,	 /* surfaces that one connection passes */
	PATH_REFRACTED_MOST = 8, /* surfaces at which one connection is refracted */
};

enum vertex_kind { VERTEX_CAMERA, VERTEX_SURFACE, VERTEX_EMITTER, VERTEX_INFINITE, VERTEX_MEDIUM };

/* What is between a vertex and the one before it: path/media.h. On the camera's sub-path; where media scatter, on the
 * light's, too. */
struct path_edge {
	uint32_t medium; /* at the vertex; the one that VERTEX_MEDIUM is in */
	/* Where media scatter: */
	uint32_t before; /* at the vertex before */
	bool fits;	 /* each face on the way states the medium that it is reached through */
	spectrum free;	 /* exp(-optical depth), without media that only absorb */
	vec3 d;		 /* the unit direction along it, one way or the other */
};

struct path_vertex {
	enum vertex_kind kind;
	bool delta;		 /* its own sub-path left it by an exactly specular lobe */
	unsigned mode;		 /* of enum bsdf_mode: how its own sub-path left it */
	int32_t emitter;	 /* shines: index; -1 */
	const struct bsdf *bsdf; /* VERTEX_SURFACE */
	struct path_edge edge;	 /* from the vertex before it on its own sub-path */
	struct surface_point x;	 /* VERTEX_INFINITE: p is the unit direction towards the emitter. A point light's ng is
				    0. VERTEX_MEDIUM: p, and nothing else. All: prim.time */
	vec3 to_prev;		 /* unit; towards the vertex before it on its own sub-path */
	spectrum beta;		 /* carried to this vertex over the density of getting here */
	double pdf;		 /* of this vertex from its own sub-path, see above */
	double pdf_rev;		 /* of this vertex as generated from the next two of its own sub-path */
	double next_event[3];	 /* random numbers kept for next event estimation */
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

/* The path by which light is refracted from a point of an emitter: path/refracted.h. */
struct path_refraction {
	unsigned count;
	struct path_vertex v[PATH_REFRACTED_MOST]; /* the one nearest to the camera first */
	double log_transfer;			   /* log T */
};
/* The last refraction that was computed to weigh a path of another technique: all joints of one light sub-path need the
 * same one. */
struct path_refraction_known {
	bool any, found;
	vec3 z, y;
	double time, nm;
	struct path_refraction of;
};
/* Finds that between y, on an emitter, and z; false: none was found. */
typedef bool path_refract(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			  struct path_refraction *out);

/* One evaluation's surroundings; one a thread. */
struct path_context {
	const struct world *w;
	struct film_window window;
	struct wavelengths wl;
	double time;		       /* of the sub-paths: struct prim_ref */
	uint32_t min_depth, max_depth; /* edges */
	double roulette;	       /* the most that a sub-path goes on with; 0: no roulette */
	bool unclassed;		       /* path_sample.classes is not wanted */
	bool one_way;		       /* pdf_rev is not needed: no technique has more than one light vertex */
	bool joins_lens;      /* points of emitters are joined to the camera: paths of one edge are found so, too */
	bool opaque;	      /* connections do not look through surfaces, even if they do in this world */
	bool dispersed;	      /* by a vertex of the camera's sub-path that is not in it any more */
	uint32_t light_every; /* one in so many samples has a light sub-path, for which it counts so many times; 0 or 1:
				 all have */
	bool makes_all;	      /* connections: none is left to chance, however faint */
	double faint;	      /* what a connection of two surfaces must bring to be made for certain; 0: anything */
	double faint_place;   /* of the next such connection in systematic sampling: see connect.c */
	uint64_t *counters;   /* of enum batch_counter */
	struct path_split *split; /* NULL: the film gets all */
	path_refract *refract;	  /* NULL: connections are not refracted */
	struct path_vertex camera[PATH_MAX_EDGES + 2], light[PATH_MAX_EDGES + 2];
	/* The vertices that the last connection passed (transparent.h) or at which it was refracted (refracted.h), the
	 * one nearest to the camera first. pdf: for a sub-path from the camera that meets them one by one. */
	unsigned passed_count;
	struct path_vertex passed[PATH_PASSED_MOST];
	double log_transfer; /* of refracted.h, if it was refracted */
	struct path_refraction_known refraction;
	/* The emission of media along edge e of the camera's sub-path, as it reaches the film, whether or not a vertex
	 * ends the edge; e from 1 to emission_edges (volume_emission.h). */
	unsigned emission_edges;
	spectrum emission[PATH_MAX_EDGES + 1];
};

/* false: x_0 on a delta emitter, which no path from the camera finds. */
static inline bool path_can_be_hit(const struct path_context *c, const struct path_vertex *v)
{
	bool end = v->kind == VERTEX_EMITTER || v->kind == VERTEX_INFINITE;
	return !end || v->emitter < 0 || !c->w->emitters[v->emitter].delta;
}

/* Kind, emitter, place and time of a point drawn on an emitter; the rest is 0. */
struct path_vertex path_emitter_vertex(const struct world *w, int32_t emitter, const struct emitter_point *p,
				       double time);

/* Whether it scatters light in a range of directions, so that it can be joined. Only what is not an end. */
static inline bool path_scatters_smoothly(const struct path_vertex *v)
{
	return v->kind == VERTEX_MEDIUM || v->bsdf->has_smooth;
}

/* One wavelength goes on alone from there. */
static inline bool path_disperses(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->bsdf->dispersive;
}

/* |ng . w| of the geometry terms; 1 where a vertex has no surface: the camera, what lies at infinity, a point light, a
 * medium. */
static inline double path_cosine(const struct path_vertex *v, vec3 w)
{
	vec3 n = v->x.ng;
	if (v->kind == VERTEX_CAMERA || v->kind == VERTEX_INFINITE || (n.x == 0 && n.y == 0 && n.z == 0))
		return 1;
	return fabs(vec3_dot(n, w));
}

/* Whether a ray along w meets the vertex: on culled curves only from outside. */
static inline bool path_meets(vec3 w, const struct path_vertex *v)
{
	const struct geom_shape *s = v->kind == VERTEX_SURFACE ? v->x.shape : NULL; /* photons (merging.h) have none */
	return !s || !s->culled || vec3_dot(v->x.ng, w) < 0;
}

/* Density per solid angle at x -> per area at y, or per volume in a medium. omega: the unit direction between them. */
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

/* Radiance that leaves an emitter's point in direction w. */
spectrum path_emitted(const struct path_context *c, const struct path_vertex *v, vec3 w, const struct wavelengths *wl);

/* The vertex where the ray from `from` along d ends: a surface, the emitter at infinity, or nothing (false). Counts a
 * ray. */
bool path_extend(struct path_context *c, const struct path_vertex *from, vec3 d, double t_min, double t_max,
		 struct path_vertex *to);

/* Unit direction and squared distance from a to b; b may lie at infinity (distance 1). */
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
