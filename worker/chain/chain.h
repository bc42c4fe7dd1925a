/*
 * One Markov chain in primary sample space: selection, acceptance, counting, splatting. The target is I = X+Y+Z of the whole
 * contribution; expected values: the current state gets 1-a, the proposal a (Veach 1997, sec. 11.3.1; contract section 2).
 * No acceptance is ever forced. Independent proposals also estimate b. Nothing allocates inside a step.
 */
#ifndef WORKER_CHAIN_CHAIN_H
#define WORKER_CHAIN_CHAIN_H

#include "worker/chain/pss.h"
#include "worker/path/integrator.h"
#include "worker/render/sums.h"

struct chain_place {
	struct pss_point point;
	struct path_sample sample;
	double weight; /* gathered, not splatted yet */
};

struct chain {
	const struct integrator *integrator;
	struct path_context *context;
	struct film_sums *film;
	uint64_t seed, id;
	uint64_t step;          /* of the last mutation made; 0: none */
	uint64_t rejected_run;  /* rejections since the last acceptance */
	struct chain_place place[2];
	struct chain_place *current, *proposal;
};

struct chain_sums { /* over independent proposals */
	double sum, square;
};

/* The share of independent proposals. */
#define CHAIN_LARGE_STEP 0.3

/* From a bootstrap index; UINT64_MAX: the group's bootstrap was black, the chain looks for light by independent proposals.
 * false: the index carries no light (the coordinator's weights are not ours). */
bool chain_start(struct chain *c, uint64_t bootstrap_index);
bool chain_resume(struct chain *c, const struct chain_state *state);
void chain_step(struct chain *c, struct chain_sums *sums);
/* Splats what the current state has gathered; at the end of each epoch. */
void chain_flush(struct chain *c);
int chain_save(const struct chain *c, struct chain_state *out);

#endif
