/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Integrators as table entries: each has one file and one line in integrator_list.h. An integrator turns one point of
 * the space of random numbers into a contribution f / p over the whole film window (docs/design.md, rules 2). Whether
 * independent points are averaged or a Markov chain walks among them is up to the caller.
 */
#ifndef WORKER_RENDER_PATH_INTEGRATOR_H
#define WORKER_RENDER_PATH_INTEGRATOR_H

#include "worker/render/path/integrator_properties.h"
#include "worker/render/path/path.h"

struct integrator {
	struct integrator_properties properties; /* properties that all programs know */
	enum rng_stream stream;			 /* random number stream of its samples */
	path_tracer *evaluate;
	uint32_t light_subpath_interval; /* path_context.light_subpath_interval for its samples */
	/* Contributions that are too bright for one sample are spread by chains: chain/redistribution.h. */
	bool redistributes;
	const struct chain_ops *chain; /* worker/render/chain/chain.h; NULL: averages independent samples */
};

extern const struct integrator *const integrator_registry[]; /* terminated by NULL */
const struct integrator *integrator_find(const char *name);  /* returns NULL if there is none */

#endif
