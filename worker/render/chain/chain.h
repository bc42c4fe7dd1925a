/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One Markov chain: selection, acceptance, counting, splatting. The target is I = X+Y+Z of a path's contribution.
 * Expected values are splatted: for acceptance probability a, the current state gets 1-a and the proposal a (Veach
 * 1997, sec. 11.3.1; docs/design.md, rules 2). No acceptance is ever forced. Independent proposals also estimate b.
 * Nothing allocates inside a step. Each kind of state space is a table entry.
 */
#ifndef WORKER_RENDER_CHAIN_CHAIN_H
#define WORKER_RENDER_CHAIN_CHAIN_H

#include "worker/render/path/integrator.h"
#include "worker/render/film/sums.h"

/* Sums of f / T over independent proposals. */
struct chain_sums {
	double sum, square_sum;
};

/* The part common to all kinds; each kind's struct begins with it. */
struct chain {
	const struct integrator *integrator;
	struct path_context *context;
	struct film_sums *film;
	/* The plan's mixture; "" if the kind has no strategies. */
	const char *mixture;
	uint64_t (*strategy_counters)[STRATEGY_COUNTERS]; /* the batch's counters */
	uint64_t seed, id;
	uint64_t step;		    /* number of the last mutation; 0: none yet */
	uint64_t rejected_in_a_row; /* rejections since the last acceptance */
};

struct chain_ops {
	size_t size;
	/* Starts from a bootstrap index. UINT64_MAX: the group's bootstrap was black, so the chain looks for light with
	 * independent proposals. Returns false if the index carries no light, which means that the coordinator's
	 * weights disagree with ours. */
	bool (*start)(struct chain *c, uint64_t bootstrap_index);
	/* Resumes from the bytes of `save`, which are not trusted; c->step is the number of mutations made so far.
	 * Returns false if they are not a state of this plan and world. */
	bool (*resume)(struct chain *c, const struct chain_state *state);
	void (*step)(struct chain *c, struct chain_sums *sums);
	/* Splats the weight that the current state has gathered; called at the end of each epoch. */
	void (*flush)(struct chain *c);
	/* Saves a state from which the chain can resume. A state that cannot be read back is replaced by the one with
	 * which the chain began this epoch (COUNT_STATES_LOST). Returns -ENOMEM if out of memory. */
	int (*save)(struct chain *c, struct chain_state *out);
};

/* Updates the counters and the run of rejections after a decision. */
void chain_count_decision(struct chain *c, bool accepted);

/* The head of a state's bytes, in little endian: id, step, run of rejections. */
enum { CHAIN_STATE_HEADER_BYTES = 24 };
void chain_write_header(const struct chain *c, uint8_t *bytes);
/* false: belongs to another chain or step. */
bool chain_read_header(struct chain *c, const uint8_t *bytes, size_t size);
/* Copies bytes into newly allocated memory that belongs to the batch. Returns -ENOMEM if out of memory. */
int chain_state_copy_bytes(const uint8_t *bytes, size_t size, struct chain_state *out);

#endif
