/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Energy redistribution: what is too bright for one sample is spread by a short Markov chain that begins there (Cline,
 * Talbot and Egbert 2005, Energy Redistribution Path Tracing). Which paths are spread follows from the density of all
 * techniques together (Bitterli and Jarosz 2019, Selectively Metropolised Monte Carlo Light Transport Simulation).
 *
 * Every path x has C(x) = I(x) / sum of the densities of all techniques of bdpt (of those that need a light sub-path
 * over light_every, if only one sample in so many has one), I = X+Y+Z of its contribution, and
 * u(x) = w C(x), with 1/w the brightness of its place on the film (path/brightness.h). Of its contribution the film
 * gets the share a(x) = min(1, T / u(x)), a function of the path alone. The rest is the weight of a chain that begins
 * at x, has the target h = w (1 - a) I and only local mutations, which leave h invariant. As x comes with density
 * sum_j p_j and weight h(x) / sum_j p_j(x), every state of the chain stands for h, and splats of I (1 - a) / h = 1 / w
 * add up to the rest of the image: without a normalisation, without a start-up bias, for chains of any length.
 *
 * All chains have the same length, L mutations: if those that begin at bright paths were longer, light would flow from
 * there and not come back. How much a chain carries depends on what there is to spread: in units of the brightness of
 * the place L / M where the rest is less (a chain begins with that probability, else nothing is spread), or as many
 * equal parts of the rest as there are such units, up to REDISTRIBUTION_CHAINS. So a splat is 1 / M times as bright as
 * its place, or, beside the brightest, more. No chain runs where no sample is too bright. Emitters in view, and those
 * seen by exactly specular surfaces alone, are not spread: all samples of such a place are alike.
 *
 * One thread. Memory: some 400 kB; nothing allocates after redistribution_new.
 */
#ifndef WORKER_RENDER_CHAIN_REDISTRIBUTION_H
#define WORKER_RENDER_CHAIN_REDISTRIBUTION_H

#include "worker/render/path/brightness.h"

struct redistribution;

struct redistribution_rule {
	double threshold; /* T */
	double mutations; /* M, for each unit of relative brightness */
	uint32_t length;  /* L */
};
/* What renders use; tests spread more. */
extern const struct redistribution_rule redistribution_usual;

enum { REDISTRIBUTION_CHAINS = 64 }; /* for one contribution */

/* c: that of the samples; world, window, depths, light_every and counters are taken from it. to: where the chains
 * splat. classes: gets the sums of what is spread, I by path class. -ENOMEM */
int redistribution_new(struct redistribution **r, const struct redistribution_rule *rule, const struct path_context *c,
		       const struct brightness *map, uint64_t seed, struct splat_target *to,
		       double classes[PATH_CLASSES], struct error *e);
void redistribution_free(struct redistribution *r);

/* For path_context.split while the next sample is evaluated. The two numbers tell it from all others of the plan: its
 * chains' random numbers follow from them. */
struct path_split *redistribution_begin(struct redistribution *r, uint64_t pixel, uint64_t sample);
/* I of what the sample did not leave on the film itself. */
double redistribution_taken(const struct redistribution *r);

#endif
