/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One Markov chain: selection, acceptance, counting, splatting. The target is I = X+Y+Z of a path's contribution;
 * expected values: the current state gets 1-a, the proposal a (Veach 1997, sec. 11.3.1; docs/design.md, rules 2). No
 * acceptance is ever forced. Independent proposals also estimate b. Nothing allocates inside a step. A table entry a
 * kind of state space.
 */
#ifndef WORKER_RENDER_CHAIN_CHAIN_H
#define WORKER_RENDER_CHAIN_CHAIN_H

#include "worker/render/path/integrator.h"
#include "worker/render/film/sums.h"

struct chain_sums { /* over independent proposals */
	double sum, square;
};

/* Common to all kinds; each kind's struct begins with it. */
struct chain {
	const struct integrator *integrator;
	struct path_context *context;
	struct film_sums *film;
	const char *mixture;			 /* of the plan; "" where the kind has no strategies */
	uint64_t (*strategy)[STRATEGY_COUNTERS]; /* of the batch */
	uint64_t seed, id;
	uint64_t step;	       /* of the last mutation made; 0: none */
	uint64_t rejected_run; /* rejections since the last acceptance */
};

struct chain_ops {
	size_t size;
	/* From a bootstrap index; UINT64_MAX: the group's bootstrap was black, the chain looks for light by independent
	 * proposals. false: the index carries no light (the coordinator's weights are not ours). */
	bool (*start)(struct chain *c, uint64_t bootstrap_index);
	/* After the bytes of `save`, which may be anybody's; c->step: how many mutations are behind it. false: not a
	 * state of this plan and world. */
	bool (*resume)(struct chain *c, const struct chain_state *state);
	void (*step)(struct chain *c, struct chain_sums *sums);
	/* Splats what the current state has gathered; at the end of each epoch. */
	void (*flush)(struct chain *c);
	/* What it saves it can resume from. A state of which that is not true is not saved: the chain is back where it
	 * began this epoch (COUNT_STATES_LOST). -ENOMEM */
	int (*save)(struct chain *c, struct chain_state *out);
};

/* What every kind does after a decision: counts, and the run of rejections. */
void chain_count(struct chain *c, bool accepted);

/* The head of a state's bytes, little endian: id, step, run of rejections. */
enum { CHAIN_STATE_HEAD = 24 };
void chain_put_head(const struct chain *c, uint8_t *bytes);
bool chain_get_head(struct chain *c, const uint8_t *bytes, size_t size); /* false: of another chain or step */
/* Copies bytes into memory of the batch's. -ENOMEM */
int chain_give(const uint8_t *bytes, size_t size, struct chain_state *out);

#endif
