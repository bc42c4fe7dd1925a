/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The breakup of a path (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4 and 5), with the paper's indices: x_k .. x_b is
 * traced from the camera with perturbed half vectors (multi-chain perturbation), x_b .. x_c moves by half vectors
 * between its two ends (predictor-corrector walk), x_c .. x_0 stays. b = k: nothing is traced; b = 0: everything is
 * traced; c = b - 1: x_b is joined to x_c. Strategies differ in the b and c that they allow and in what else moves.
 */
#ifndef WORKER_RENDER_MUTATION_BREAKUP_H
#define WORKER_RENDER_MUTATION_BREAKUP_H

#include "worker/render/mutation/heuristic.h"
#include "worker/render/mutation/mutation.h"

struct breakup {
	unsigned b, c;	   /* c is ignored if b = 0; b = c = k: nothing moves */
	double log_choice; /* log P(b) P(c) given x */
	/* The half vectors between x_b and x_c take steps; otherwise they are kept while the ends move. */
	bool moves_halfvecs;
	/* These move, too, if the scene and the path have them. */
	bool moves_wavelength, moves_aperture, moves_emitter;
};

/* See mutation_ops.propose. On success everything is set, except that move->log_density[MUTATION_REVERSE] does not yet
 * include the probability of choosing b and c. */
enum proposal_result breakup_propose(struct mutation_ctx *m, const struct breakup *breakup, struct full_path *x,
				     struct full_path *y, struct proposal_move *move);
double breakup_log_weight(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			  enum mutation_direction direction);

/* Whether a path can be broken up like this: x_b and x_c must not be exactly specular, c < b (unless b = 0), and no
 * event in a medium may lie between them. */
bool breakup_is_allowed(const struct full_path *x, unsigned b, unsigned c);

#endif
