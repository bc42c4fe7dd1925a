/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A lease of an integrator that can be run again and again, the rays that it traces through worker/render/geom/accel.h,
 * and the same rays for Embree alone, with a scene of its own (robust, no filters, the same triangles, Embree's
 * spheres). One thread.
 */
#ifndef TESTS_BENCH_SUBJECT_H
#define TESTS_BENCH_SUBJECT_H

#include "tests/bench/record.h"
#include "worker/render/render.h"

struct subject {
	struct world *w;
	struct plan plan;
	struct lease_key key;
	struct lease_input input;
	uint64_t *seeds;
	struct recorded_ray *rays;
	struct subject_embree *embree;
	size_t ray_count;
};

/* Chooses samples per pixel or mutations per chain such that about 2^19 rays are traced. mutations: the mixture, for
 * integrators that have one; NULL: the one that suits the scene. The world stays the caller's. */
void subject_init(struct subject *s, struct world *w, const char *integrator, const char *mutations);
void subject_fini(struct subject *s);

/* Sets other random numbers, and for chains other starts; the amount of work stays the same. */
void subject_reseed(struct subject *s, uint64_t seed);

/* The caller frees the batch with batch_fini. */
void subject_run(const struct subject *s, struct batch *b);
/* Runs the lease to measure time only; returns the number of rays it traced. */
uint64_t subject_render(const struct subject *s);

/* Records the rays of one run, and builds Embree's scene. */
void subject_record(struct subject *s);
double subject_replay_embree(const struct subject *s); /* CPU seconds */
double subject_replay_accel(const struct subject *s);

/* Returns the CPU seconds in which Embree alone builds its scene of a world's triangles and spheres. */
double subject_build_embree(const struct world *w);

/* Returns the CPU seconds in which Embree alone finds the closest hits of a million incoherent rays among 2 triangles
 * and 3 spheres. */
double subject_million_rays(void);

#endif
