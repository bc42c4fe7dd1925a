/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/mutation/mutation.h"

#include <string.h>

#define MUTATION(name) extern const struct mutation_ops mutation_##name;
#include "worker/render/mutation/mutation_list.h"
#undef MUTATION

const struct mutation_ops *const mutation_registry[] = {
#define MUTATION(name) &mutation_##name,
#include "worker/render/mutation/mutation_list.h"
#undef MUTATION
	NULL,
};

const struct mutation_ops *mutation_find(const char *name, size_t length)
{
	for (size_t i = 0; mutation_registry[i]; i++)
		if (strlen(mutation_registry[i]->name) == length &&
		    memcmp(mutation_registry[i]->name, name, length) == 0)
			return mutation_registry[i];
	return NULL;
}

enum strategy_counter proposal_counter(enum proposal_result reason)
{
	static const enum strategy_counter counters[] = {
		[PROPOSAL_MADE] = STRATEGY_PROPOSED,
		[PROPOSAL_OUTSIDE] = STRATEGY_FAIL_OUTSIDE,
		[PROPOSAL_MISSED] = STRATEGY_FAIL_MISSED,
		[PROPOSAL_BLOCKED] = STRATEGY_FAIL_BLOCKED,
		[PROPOSAL_MODE_CHANGED] = STRATEGY_FAIL_MODE,
		[PROPOSAL_SINGULAR] = STRATEGY_FAIL_SINGULAR,
		[PROPOSAL_DIVERGED] = STRATEGY_FAIL_DIVERGED,
		[PROPOSAL_ITERATION_LIMIT] = STRATEGY_FAIL_ITERATIONS,
		[PROPOSAL_IRREVERSIBLE] = STRATEGY_FAIL_REVERSE,
		[PROPOSAL_EMITTER] = STRATEGY_FAIL_EMITTER,
		[PROPOSAL_BLACK] = STRATEGY_FAIL_DARK,
		[PROPOSAL_INAPPLICABLE] = STRATEGY_FAIL_INAPPLICABLE,
	};
	return counters[reason];
}

void mutation_draw_uniforms(const struct mutation_ctx *m, unsigned block, double out[4])
{
	rng_uniform4(m->seed, RNG_MUTATION, m->chain, m->step, block, out);
}

void mutation_normals_from_uniform(const double u[2], double out[2])
{
	double r = sqrt(-2 * log1p(-u[0])), phi = 2 * M_PI * u[1];
	out[0] = r * cos(phi);
	out[1] = r * sin(phi);
}

bool mutation_step_in_square(double u[2], const double r[2], double size)
{
	for (int i = 0; i < 2; i++) {
		u[i] += size * (2 * r[i] - 1);
		if (!(u[i] >= 0 && u[i] < 1))
			return false;
	}
	return true;
}
