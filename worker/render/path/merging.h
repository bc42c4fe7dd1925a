/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertex merging (Georgiev et al. 2012, Hachisuka et al. 2012): light that no sampling of paths finds soon, such as the
 * sun's on the floor of a pool, is found at once where the camera's sub-paths meet photons nearby. The image would be
 * blurred, and none is made of it: what is asked is how rarely `path` and `bdpt` would find that light, and how bright
 * it would then be. One thread; only merging_photons allocates.
 */
#ifndef WORKER_RENDER_PATH_MERGING_H
#define WORKER_RENDER_PATH_MERGING_H

#include "worker/render/math/point_tree.h"
#include "worker/render/path/brightness.h"

/* Where a light sub-path hit a rough surface: its vertex s, s >= 2, since direct light is easily found otherwise. */
struct photon {
	vec3 p, ng;
	spectrum beta;
	double pdf; /* per area, of landing here */
	unsigned s;
	double edge_rev; /* what media on the way contribute to the density of prev as generated from here */
	struct {
		enum vertex_kind kind;
		int32_t emitter;
		vec3 p, ng;
		double pdf;
		bool delta;
	} prev;
	/* Sums of the densities of techniques with fewer than s light vertices, over the density of technique s - 1:
	 * fewer: of all of them; path: of those with at most one, which are all that `path` has. Techniques whose joint
	 * passes all surfaces up to the photon (transparent.h) are summed apart, over the density of technique s. */
	double fewer, path;
	double fewer_through, path_through;
};

struct merging {
	struct photon *photons;
	struct point_tree tree;
	size_t count, room;
	uint64_t paths;		 /* light sub-paths that were followed */
	double wavelength, time; /* the numbers in [0,1) of all of them: photons of others could not be merged */
};

/* The camera's sub-path in path_context. */
struct merging_place {
	double film[2], radius; /* within which photons count */
	unsigned t;		/* its first rough vertex */
};

/* A path that merging makes. */
struct merged {
	double brings;	   /* X + Y + Z over the whole window, to the mean of the camera's samples */
	double bdpt, path; /* what a sample brings that finds it; INFINITY: none ever does */
};

/* Traces that many light sub-paths, with numbers of RNG_CHOICE. Ticks. -ENOMEM; merging_fini frees either way. */
int merging_photons(struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t paths);
void merging_fini(struct merging *m);
/* A sample of the camera, one of as many as there are sub-paths of light. false: it meets no rough surface, or an event
 * in a medium before it. */
bool merging_walk(const struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t index,
		  struct merging_place *out);
/* Each path that this sample makes with the photons around its place. */
void merging_each(const struct merging *m, struct path_context *c, const struct merging_place *place,
		  void (*take)(void *user, const struct merged *found), void *user);

/* 1 over the brightness there, as brightness_scale has it. A map of few samples is too dark where they did not find
 * light: each place is as bright as its photons say, if that is more. photons: what these bring, X + Y + Z. */
double merging_scale(const struct merging *m, struct path_context *c, const struct merging_place *place,
		     const struct brightness *map, double *photons);

/* The parts of it: c->light's vertex s as a photon, and the path that it makes with c->camera's vertex t, as of one
 * photon and a disk of area 1. false: black. */
struct photon photon_of(struct path_context *c, unsigned s);
bool merged_of(struct path_context *c, const struct photon *p, unsigned t, struct merged *out);

#endif
