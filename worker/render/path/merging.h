/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertex merging (Georgiev et al. 2012, Hachisuka et al. 2012): light that path sampling rarely finds, such as sunlight
 * on the floor of a pool, is found at once where camera sub-paths meet nearby photons. An image made this way would be
 * blurred, so none is made. Merging only estimates how rarely `path` and `bdpt` would find that light, and
 * how bright it would then be. One thread; only merging_trace_photons allocates.
 */
#ifndef WORKER_RENDER_PATH_MERGING_H
#define WORKER_RENDER_PATH_MERGING_H

#include "worker/render/math/point_tree.h"
#include "worker/render/path/brightness.h"

/* A point where a light sub-path hit a rough surface: vertex s of the sub-path, s >= 2, because direct light is
 * easy to find by other means. */
struct photon {
	vec3 p, ng;
	spectrum beta;
	double pdf; /* density of this vertex, per area */
	unsigned s;
	/* The factor that media on the edge contribute to the density of prev as generated from here. */
	double edge_pdf_rev;
	struct {
		enum vertex_kind kind;
		int32_t emitter;
		vec3 p, ng;
		double pdf;
		bool is_delta;
	} prev;
	/* Sums of the densities of techniques with fewer than s light vertices, divided by the density of technique s -
	 * 1: `fewer_sum` sums all of them; `path_sum` sums those with at most one light vertex, the only ones that the
	 * integrator `path` has. Techniques whose joint passes all surfaces up to the photon (transparent.h) are summed
	 * separately, in the members ..._passing_sum, divided by the density of technique s. */
	double fewer_sum, path_sum;
	double fewer_passing_sum, path_passing_sum;
};

struct merging {
	struct photon *photons;
	struct point_tree tree;
	size_t photon_count, photon_capacity;
	uint64_t path_count; /* number of light sub-paths that were traced */
	/* Numbers in [0,1) that all sub-paths share, because only photons of the same
	 * wavelengths and time can be merged. */
	double wavelength_u, time;
};

/* The state of the camera sub-path in path_context. */
struct merging_point {
	double film[2], radius; /* photons within this radius are merged */
	unsigned vertex;	/* index of its first rough vertex */
};

/* A path that merging makes. */
struct merged_path {
	/* Its contribution to the mean of the camera's samples: X + Y + Z over the whole window. */
	double contribution;
	/* The contribution of a sample of bdpt and of path that finds this path; INFINITY if none ever does. */
	double bdpt_contribution, path_contribution;
};

/* Traces `path_count` light sub-paths with numbers of the stream RNG_CHOICE and calls liveness_tick(). Returns -ENOMEM
 * if out of memory; merging_fini frees *m in either case. */
int merging_trace_photons(struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t paths);
void merging_fini(struct merging *m);
/* Walks the camera sub-path of one sample, of as many as there are light sub-paths. Returns false if it meets no rough
 * surface, or an event in a medium before one. */
bool merging_walk_camera(const struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t index,
			 struct merging_point *out);
/* Calls `visit` for each path that this sample makes with the photons around its position. */
void merging_visit_paths(const struct merging *m, struct path_context *c, const struct merging_point *point,
			 void (*visit)(void *user, const struct merged_path *found), void *user);

/* Returns 1 / the brightness at the place, as brightness_inverse_at does. A map of few samples is too dark where they
 * missed light, so the brightness is taken from the photons if they say that the place is brighter. Sets *photons to
 * the contribution of these photons, X + Y + Z. */
double merging_inverse_brightness(const struct merging *m, struct path_context *c, const struct merging_point *point,
				  const struct brightness *map, double *photons);

/* The steps of merging: photon_from_vertex makes a photon of c->light's vertex s; merging_merge_photon computes the
 * path that a photon makes with c->camera's vertex t, as if it were the only photon and its disk had area 1.
 * merging_merge_photon returns false if that path is black or too long. */
struct photon photon_from_vertex(struct path_context *c, unsigned s);
bool merging_merge_photon(struct path_context *c, const struct photon *p, unsigned t, struct merged_path *out);

#endif
