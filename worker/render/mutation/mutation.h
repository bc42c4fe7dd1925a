/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mutations of whole paths: one file and one line in mutation_list.h each. A mutation only proposes and evaluates the
 * probability of its proposal; the chain selects, accepts, counts and splats.
 *
 * The chain keeps two copies of its state: x, and y, which equals x when `propose` is called. A proposal changes y and
 * says which vertices (with their edges) differ. The acceptance probability is min(1, exp(log_weight(x -> y) -
 * log_weight(y -> x))), where log_weight(x -> y) = log f(y) - log T(x -> y) up to terms that are equal both ways; f and
 * T are per area, multiplied out as far as geometry terms and Jacobians cancel (Hanika, Kaplanyan, Dachsbacher 2015,
 * sec. 4 and 5).
 *
 * The probability of choosing a strategy does not depend on the state: a strategy that cannot change x fails. One
 * thread; nothing allocates.
 */
#ifndef WORKER_RENDER_MUTATION_MUTATION_H
#define WORKER_RENDER_MUTATION_MUTATION_H

#include "worker/render/halfvec/stepsize.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/world/summary.h"

/* Forced choices, for tests: "hslt@b3c1". */
struct mutation_setting {
	int b, c; /* -1: drawn */
};

enum mutation_direction { X_TO_Y, Y_TO_X };

/* What a proposal did, for the densities in both directions. */
struct move {
	unsigned first, last;	/* vertices of y that may differ from x; all if the numbers of edges differ */
	unsigned b, c;		/* breakup: x_b .. x_c by half vectors, x_k .. x_b traced, x_c .. x_0 unchanged */
	double log_density[2];	/* of the choices that depend on the state: P(b) P(c), steps, end points */
	double log_transfer[2]; /* log |det d x_{b-1} / d x_c| at y, at x (X_TO_Y: at y); 0 where b - c < 2 */
	double log_symmetric;	/* of choices with the same probability both ways, pixels and half vectors of the traced
				   part; not part of weights */
};

struct mutation_scratch {
	struct walk_scratch walk;
	struct constraint k[FULL_PATH_MAX_VERTICES];	     /* of x */
	struct halfvec_step step[2][FULL_PATH_MAX_VERTICES]; /* of x, of y */
	struct walk_target target[FULL_PATH_MAX_VERTICES];
	double weight[FULL_PATH_MAX_VERTICES];
	vec2 dh[FULL_PATH_MAX_VERTICES];
	struct full_path back;
};

struct mutation_ctx {
	struct path_context *path;
	uint64_t seed, chain, step; /* index of this mutation's random numbers */
	uint64_t *count;	    /* counters of the strategy, by enum strategy_counter */
	struct walk_limits limits;
	struct mutation_scratch scratch;
};

enum proposal_end {
	PROPOSAL_MADE,
	/* Why there is none: the counters of common/film/batch.h say what each means. */
	PROPOSAL_OUTSIDE,
	PROPOSAL_MISSED,
	PROPOSAL_BLOCKED,
	PROPOSAL_MODE,
	PROPOSAL_SINGULAR,
	PROPOSAL_DIVERGED,
	PROPOSAL_ITERATIONS,
	PROPOSAL_REVERSE,
	PROPOSAL_EMITTER,
	PROPOSAL_DARK,
	PROPOSAL_INAPPLICABLE,
};
/* The counter of a reason. */
enum strategy_counter proposal_counter(enum proposal_end reason);

struct mutation_ops {
	const char *name, *summary;
	bool independent;		 /* independent of x: also estimates b by f / T */
	const struct strategy *strategy; /* of a breakup (strategy.h) */
	/* Weight in the default mixture of a scene with these effects; 0: not part of it. NULL: of none. */
	double (*useful)(const struct render_summary *scene);
	/* PROPOSAL_MADE: y is complete, and all its rays have been cast. Otherwise the reason, and y's vertices
	 * first..last are undefined. */
	enum proposal_end (*propose)(const struct mutation_ops *self, struct mutation_ctx *m,
				     const struct mutation_setting *how, struct full_path *x, struct full_path *y,
				     struct move *move);
	/* The weight of y for X_TO_Y, of x for Y_TO_X. -INFINITY: black. */
	double (*log_weight)(struct mutation_ctx *m, struct full_path *into, const struct move *move,
			     enum mutation_direction direction);
};

extern const struct mutation_ops *const mutation_registry[]; /* ends with NULL */
const struct mutation_ops *mutation_find(const char *name, size_t length);

/* Random numbers of the current mutation; blocks of four. */
enum mutation_block {
	BLOCK_STRATEGY, /* of the chain: strategy, acceptance */
	BLOCK_BREAKUP,	/* b, c, what else moves */
	BLOCK_FILM,
	BLOCK_ENDS,   /* wavelength, aperture, emitter */
	BLOCK_VERTEX, /* + j: the step of vertex j */
};
void mutation_random(const struct mutation_ctx *m, unsigned block, double out[4]);
/* A symmetric step of two numbers in [0,1), by the random numbers r in [0,1). false: it leaves the square. */
bool mutation_step_square(double u[2], const double r[2], double size);
/* Two standard normals from two numbers in [0,1) (Box and Muller 1958). */
void mutation_normals(const double u[2], double out[2]);

#endif
