/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A batch: the result of one lease. Its content depends on (plan, kind, group, part, epoch) only.
 * In memory here; on the wire a message header followed by one EXR per tile (common/exr/exr_tile.h).
 */
#ifndef COMMON_FILM_BATCH_H
#define COMMON_FILM_BATCH_H

#include "common/base/error.h"
#include "common/film/path_class.h"
#include "common/plan/plan.h"

struct lease_key {
	uint64_t job;
	enum lease_kind kind;
	uint32_t group, part;
	uint64_t epoch;
};
bool lease_key_equal(const struct lease_key *a, const struct lease_key *b);

enum { TILE_SIZE = 64, TILE_CHANNELS = 3 }; /* X Y Z */

/* A rectangle that changed; x, y in pixels of the FULL film, inside the crop, aligned to TILE_SIZE from the crop's
 * corner (smaller at the right and lower border). Each tile at most once in a batch, in row-major order. */
struct tile {
	uint32_t x, y, width, height;
	float *xyz; /* [height][width][3], finite */
};

/* The state of one chain after an epoch: opaque to all but the integrator; any worker can go on from it. */
struct chain_state {
	uint8_t *bytes;
	uint32_t size; /* 1..CHAIN_STATE_MAX */
};
enum { CHAIN_STATE_MAX = 1 << 16 };

enum { BATCH_COUNTERS = 16 };
enum batch_counter {
	COUNT_SAMPLES,	   /* samples or mutations made */
	COUNT_ACCEPTED,	   /* accepted mutations */
	COUNT_INDEPENDENT, /* independent proposals (bootstrap samples, large steps) */
	COUNT_NAN,	   /* contributions refused: not a number */
	COUNT_INFINITE,	   /* ... infinite */
	COUNT_NEGATIVE,	   /* ... negative */
	COUNT_RAYS_CLOSEST,
	COUNT_RAYS_SHADOW,
	COUNT_STUCK,	     /* chains that accepted nothing during the epoch */
	COUNT_LONGEST_STUCK, /* most rejections in a row (merged by maximum) */
	COUNT_STATES_LOST, /* chains whose last state could not be read back: they begin the next epoch where they began
			      this one */
};

/* What the chains of a lease count of each strategy of the plan's mixture; names in common/estimate/strategy.h. From
 * STRATEGY_FAIL_FIRST on: why a proposal could not be made or carried nothing, one reason a proposal. */
enum { BATCH_STRATEGIES = PLAN_MAX_STRATEGIES };
enum strategy_counter {
	STRATEGY_PROPOSED, /* mutations that the strategy was chosen for */
	STRATEGY_ACCEPTED,
	STRATEGY_RAYS,		/* of its proposals, the way back included */
	STRATEGY_WALKS,		/* on the manifold */
	STRATEGY_ITERATIONS,	/* of all walks */
	STRATEGY_REVERSE_WALKS, /* walks from the proposal back to the state */
	STRATEGY_FAIL_FIRST,
	STRATEGY_FAIL_OUTSIDE = STRATEGY_FAIL_FIRST, /* left the frame or the aperture */
	STRATEGY_FAIL_MISSED,			     /* a ray met nothing */
	STRATEGY_FAIL_BLOCKED,			     /* ... or another surface than it should */
	STRATEGY_FAIL_MODE,			     /* reflection, transmission, side or material changed */
	STRATEGY_FAIL_SINGULAR,			     /* a matrix without inverse */
	STRATEGY_FAIL_DIVERGED,			     /* the step of a walk fell below the least */
	STRATEGY_FAIL_ITERATIONS,		     /* a walk ran out of them */
	STRATEGY_FAIL_REVERSE,			     /* the way back failed or came elsewhere */
	STRATEGY_FAIL_SPECULAR,			     /* would move a delta vertex that is fixed */
	STRATEGY_FAIL_EMITTER,			     /* did not end on an emitter that shines */
	STRATEGY_FAIL_DARK,			     /* contributes nothing */
	STRATEGY_FAIL_INAPPLICABLE,		     /* the path has nothing that this strategy can move */
	STRATEGY_COUNTERS,
};

/*
 * Within-chain moments, for chains only. A sequence is a chain; where the plan has more than SEQUENCES_MAX of them, all
 * chains of one lease together (which bounds the coordinator's memory). A mutation gives weight w to a state (1 - a to
 * the current one, a to the proposal) of which the share f of I = X+Y+Z has its film points in a tile of the crop;
 * points outside the crop belong to no tile. First moments: by sequence and tile, the sum of w f. Second: by tile over
 * the whole lease, the sum of w f^2.
 */
enum { SEQUENCES_MAX = 4096 };
uint32_t batch_sequences(const struct plan *p);	 /* of one render lease; 0: not of chains */
uint32_t batch_film_tiles(const struct plan *p); /* of the crop */
/* Floats of struct batch.moments of a lease of that kind. */
uint64_t batch_moment_count(const struct plan *p, enum lease_kind kind);

struct batch {
	struct lease_key key;
	uint64_t counters[BATCH_COUNTERS];
	uint32_t strategy_count; /* entries of the plan's mixture, or 0 */
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
	/* Sums over independent proposals of I = X+Y+Z of the whole sample, zeros counted in COUNT_INDEPENDENT.
	 * beyond_sum: the same from paths longer than the integrator's state holds, estimated by the bootstrap and not
	 * in independent_sum (b is the integral of what the chains can reach). */
	double independent_sum, independent_square, beyond_sum;
	/* By path class. Bootstrap: what independent_sum is the sum of. Chains: their time, the sum of w times the
	 * class's share of the state's I. Else 0. */
	double classes[PATH_CLASSES];
	double cpu_seconds; /* not part of the result's bits */
	uint32_t tile_count;
	struct tile *tiles;
	uint32_t state_count; /* chains of the lease, in order of the chain range */
	struct chain_state *states;
	uint64_t weight_count; /* bootstrap: I of each index of the range, in order */
	float *weights;
	uint64_t moment_count;
	float *moments; /* [sequence][tile] first moments, then [tile] second ones; tiles row by row */
};

void batch_fini(struct batch *b);

/* All that can be checked without the scene: key inside the plan, tiles inside the crop, aligned, once, in order,
 * values finite, counts as the plan says (COUNT_SAMPLES of a render lease and COUNT_INDEPENDENT of a bootstrap lease
 * exactly), states bounded, weights >= 0, strategies as many as the plan's and none with more proposals than samples,
 * no class and no sequence with more time than its mutations, no tile with a second moment above the first, sums that
 * numbers which are not negative can have, counters of the order of the samples. -EBADMSG with a sentence. */
int batch_check(const struct batch *b, const struct plan *p, struct error *e);

#endif
