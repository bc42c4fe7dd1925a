/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Integrators as table entries: one file and one line in integrator_list.h each. An integrator turns one point of the
 * space of random numbers into a contribution f / p over the whole film window (docs/design.md, rules 2); whether
 * independent points are averaged or a Markov chain walks among them is the caller's.
 */
#ifndef WORKER_RENDER_PATH_INTEGRATOR_H
#define WORKER_RENDER_PATH_INTEGRATOR_H

#include "worker/render/path/integrator_face.h"
#include "worker/render/path/path.h"

struct integrator {
	struct render_integrator face; /* name, kind, depth that its state holds */
	enum rng_stream stream;	       /* of its own samples */
	path_tracer *evaluate;
	uint32_t light_every;	       /* of path_context, for its samples */
	bool redistributes;	       /* what is too bright for a sample goes to chains: chain/redistribution.h */
	const struct chain_ops *chain; /* worker/render/chain/chain.h; NULL: averages independent points */
};

extern const struct integrator *const integrator_registry[]; /* ends with NULL */
const struct integrator *integrator_find(const char *name);  /* NULL: none */

#endif
