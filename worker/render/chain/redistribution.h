/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Energy redistribution: a contribution that is too bright for one sample is spread by a short Markov chain that
 * starts at its path (Cline, Talbot and Egbert 2005, Energy Redistribution Path Tracing). Which paths are spread
 * follows from the density of all techniques together (Bitterli and Jarosz 2019, Selectively Metropolised Monte Carlo
 * Light Transport Simulation).
 *
 * For a path x, let C(x) = I(x) / sum of the densities of all techniques of bdpt, where I = X+Y+Z of its contribution.
 * (If only one in light_subpath_interval samples has a light sub-path, the densities of techniques that need one are
 * divided by light_subpath_interval.) Let u(x) = w C(x), with 1/w the brightness of the path's place on the film
 * (path/brightness.h). The film gets the fraction a(x) = min(1, T / u(x)) of the contribution, which depends on the
 * path alone. The rest is the weight of a chain that begins at x, has the target h = w (1 - a) I and only local
 * mutations, which leave h invariant. Because x is sampled with density sum_j p_j and has weight h(x) / sum_j p_j(x),
 * every state of the chain represents h, and splats of I (1 - a) / h = 1 / w add up to the rest of the image: without
 * normalisation, without start-up bias, for chains of any length.
 *
 * All chains have the same length of L mutations: if those that begin at bright paths were longer, light would flow
 * away from there and not come back. Energy is measured relative to the brightness of the place. If the rest of a
 * contribution is less than L / M, one chain that carries L / M starts with the probability rest / (L / M), otherwise
 * none. Else the rest is divided equally among as many chains as it has units of L / M, up to
 * REDISTRIBUTION_CHAINS_MAX. So a splat is 1 / M times as bright as its place, or brighter for the very brightest
 * contributions. No chain runs where no sample is too bright. Emitters in view, and those seen only by exactly specular
 * surfaces, are not spread, because all samples of such a place are alike.
 *
 * One thread. Memory: some 400 kB; nothing allocates after redistribution_new.
 */
#ifndef WORKER_RENDER_CHAIN_REDISTRIBUTION_H
#define WORKER_RENDER_CHAIN_REDISTRIBUTION_H

#include "worker/render/path/brightness.h"

struct redistribution;

struct redistribution_rule {
	double threshold;	   /* T */
	double mutations_per_unit; /* M: mutations for each unit of relative brightness */
	uint32_t chain_length;	   /* L */
};
/* The rule that renders use; tests spread more. */
extern const struct redistribution_rule redistribution_default_rule;

enum { REDISTRIBUTION_CHAINS_MAX = 64 }; /* most chains for one contribution */

/* c: the context of the samples, from which world, window, depths, light_subpath_interval and counters are taken.
 * target: where the chains splat. classes: gets the sums of the energy that is spread, I by path class. Returns -ENOMEM
 * if out of memory. */
int redistribution_new(struct redistribution **out, const struct redistribution_rule *rule,
		       const struct path_context *c, const struct brightness *map, uint64_t seed,
		       struct splat_target *target, double classes[PATH_CLASSES], struct error *e);
void redistribution_free(struct redistribution *r);

/* Returns the split to be used as path_context.split while the next sample is evaluated. The two numbers identify the
 * sample among all samples of the plan: the random numbers of its chains follow from them. */
struct path_split *redistribution_begin(struct redistribution *r, uint64_t pixel, uint64_t sample);
/* Returns I of the part of the sample that the film did not get directly. */
double redistribution_taken_intensity(const struct redistribution *r);

#endif
