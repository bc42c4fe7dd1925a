/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mutations of whole paths: each has one file and one line in mutation_list.h. A mutation only proposes a path and
 * evaluates the density of its proposal; the chain selects, accepts, counts and splats.
 *
 * The chain keeps two copies of its state: x, and y, which equals x when `propose` is called. A proposal changes y and
 * reports which vertices (with their edges) differ. The acceptance probability is min(1, exp(log_weight(x -> y) -
 * log_weight(y -> x))), where log_weight(x -> y) = log f(y) - log T(x -> y) up to terms that are equal in both
 * directions. The contribution f and the transition density T are per area; geometry terms and Jacobians that they have
 * in common are cancelled (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4 and 5).
 *
 * The probability of choosing a strategy does not depend on the state: a strategy that cannot change x fails. One
 * thread; nothing allocates.
 */
#ifndef WORKER_RENDER_MUTATION_MUTATION_H
#define WORKER_RENDER_MUTATION_MUTATION_H

#include "worker/render/halfvec/stepsize.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/world/summary.h"

/* Forced choices for tests: "hslt@b3c1". */
struct mutation_forced_choice {
	int b, c; /* -1: chosen at random */
};

enum mutation_direction { MUTATION_FORWARD, MUTATION_REVERSE };

/* What a proposal did, for the densities in both directions. */
struct proposal_move {
	/* The vertices of y that may differ from x; all of them if the numbers of edges differ. */
	unsigned first, last;
	/* The breakup: x_k .. x_b is traced, x_b .. x_c moved by half vectors, x_c .. x_0 unchanged. */
	unsigned b, c;
	/* Densities of the choices that depend on the state: P(b) P(c), steps, end points. */
	double log_density[2];
	/* Logarithms of |det d x_{b-1} / d x_c|, MUTATION_FORWARD at y and MUTATION_REVERSE at x; 0 if b - c < 2. */
	double log_transfer[2];
	/* Density of the choices that have the same density in both directions: film point and half vectors of the
	 * traced part. Not part of the weights. */
	double log_symmetric;
};

struct mutation_scratch {
	struct walk_scratch walk;
	struct constraint constraints[FULL_PATH_VERTICES_MAX]; /* of x */
	struct halfvec_step step[2][FULL_PATH_VERTICES_MAX];   /* steps at x, at y */
	struct walk_target target[FULL_PATH_VERTICES_MAX];
	double weight[FULL_PATH_VERTICES_MAX];
	vec2 dh[FULL_PATH_VERTICES_MAX];
	struct full_path reverse_path;
};

struct mutation_ctx {
	struct path_context *path;
	uint64_t seed, chain, step; /* index of this mutation's random numbers */
	uint64_t *counters;	    /* the strategy's counters, indexed by enum strategy_counter */
	struct walk_limits limits;
	struct mutation_scratch scratch;
};

enum proposal_result {
	PROPOSAL_MADE,
	/* Reasons for having no proposal; the counters of common/film/batch.h describe each. */
	PROPOSAL_OUTSIDE,
	PROPOSAL_MISSED,
	PROPOSAL_BLOCKED,
	PROPOSAL_MODE_CHANGED,
	PROPOSAL_SINGULAR,
	PROPOSAL_DIVERGED,
	PROPOSAL_ITERATION_LIMIT,
	PROPOSAL_IRREVERSIBLE,
	PROPOSAL_EMITTER,
	PROPOSAL_BLACK,
	PROPOSAL_INAPPLICABLE,
};
/* Returns the counter of a reason. */
enum strategy_counter proposal_counter(enum proposal_result reason);

struct mutation_ops {
	const char *name, *summary;
	bool is_independent;		 /* proposals are independent of x and also estimate b by f / T */
	const struct strategy *strategy; /* for breakups (strategy.h) */
	/* Returns the weight in the default mixture of a scene with these effects; 0: not part of it.
	 * NULL: in no default mixture. */
	double (*default_weight)(const struct render_summary *scene);
	/* Proposes y. PROPOSAL_MADE: y is complete, and all its rays have been traced. Otherwise returns the reason,
	 * and y's vertices first..last are undefined. */
	enum proposal_result (*propose)(const struct mutation_ops *self, struct mutation_ctx *m,
					const struct mutation_forced_choice *forced, struct full_path *x,
					struct full_path *y, struct proposal_move *move);
	/* Returns the logarithm of the weight of y for MUTATION_FORWARD, of x for MUTATION_REVERSE. -INFINITY: black.
	 */
	double (*log_weight)(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			     enum mutation_direction direction);
};

extern const struct mutation_ops *const mutation_registry[]; /* terminated by NULL */
const struct mutation_ops *mutation_find(const char *name, size_t length);

/* Blocks of four random numbers of the current mutation. */
enum mutation_block {
	BLOCK_STRATEGY, /* used by the chain: strategy, acceptance */
	BLOCK_BREAKUP,	/* b, c and what else moves */
	BLOCK_FILM,
	BLOCK_ENDS,   /* wavelength, aperture, emitter */
	BLOCK_VERTEX, /* BLOCK_VERTEX + j: the step of vertex j */
};
void mutation_draw_uniforms(const struct mutation_ctx *m, unsigned block, double out[4]);
/* Makes a symmetric step of two numbers in [0,1), from the random numbers r in [0,1). Returns false if
 * it leaves the unit square. */
bool mutation_step_in_square(double u[2], const double r[2], double size);
/* Computes two standard normals from two numbers in [0,1) (Box and Muller 1958). */
void mutation_normals_from_uniform(const double u[2], double out[2]);

#endif
