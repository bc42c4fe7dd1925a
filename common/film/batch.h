/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A batch: the result of one lease. Its content depends on (plan, kind, group, part, epoch) only. On the wire it is a
 * message header followed by one EXR per tile (common/exr/exr_tile.h).
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
const char *lease_kind_name(enum lease_kind kind); /* "bootstrap", "render" */
/* A lease in a line of a log, and (without its kind) in a sentence: printf(LEASE_WORDS, LEASE_PLACE(&key)). */
#define LEASE_FORMAT "kind=%s group=%u part=%u epoch=%llu"
#define LEASE_VALUES(k) lease_kind_name((k)->kind), LEASE_PLACE(k)
#define LEASE_WORDS "group %u part %u epoch %llu"
#define LEASE_PLACE(k) (k)->group, (k)->part, (unsigned long long)(k)->epoch
bool lease_key_equal(const struct lease_key *a, const struct lease_key *b);

enum { TILE_SIZE = 64, TILE_CHANNELS = 3 }; /* X Y Z */

/* A rectangle that changed; x, y in pixels of the FULL film, inside the crop, aligned to TILE_SIZE from the crop's
 * corner (smaller at the right and lower border). A batch contains each tile at most once, in row-major order. */
struct tile {
	uint32_t x, y, width, height;
	float *xyz; /* [height][width][3], finite */
};

/* The state of one chain after an epoch: opaque to all but the integrator. Any worker can continue from it. */
struct chain_state {
	uint8_t *bytes;
	uint32_t size; /* 1..chain_state_max */
};
enum { CHAIN_STATE_MAX = 5376 }; /* of any plan */

/* The longest state of a chain of this plan: so many bytes for each vertex of the longest path. */
uint32_t chain_state_max(const struct plan *p);
/* Memory that the states of all its chains need at most. */
uint64_t chain_states_max(const struct plan *p);
uint64_t chain_states_bytes(const struct chain_state *s, uint32_t count); /* memory that these need; NULL: 0 */

enum { BATCH_COUNTERS = 16 };
enum batch_counter {
	COUNT_SAMPLES,	   /* samples or mutations made */
	COUNT_ACCEPTED,	   /* accepted mutations */
	COUNT_INDEPENDENT, /* independent proposals (bootstrap samples, large steps) */
	COUNT_NAN,	   /* contributions refused: NaN */
	COUNT_INFINITE,	   /* ... infinite */
	COUNT_NEGATIVE,	   /* ... negative */
	COUNT_RAYS_CLOSEST,
	COUNT_RAYS_SHADOW,
	COUNT_STUCK,		/* chains that accepted nothing during the epoch */
	COUNT_LONGEST_STUCK,	/* most rejections in a row (merged by maximum) */
	COUNT_STATES_LOST,	/* chains whose last state could not be read back: they start the next epoch where they
				   started this one */
	COUNT_SPREAD,		/* contributions too bright for a sample, which chains spread */
	COUNT_SPREAD_MUTATIONS, /* mutations of these chains */
	COUNT_SPREAD_RAYS,	/* rays that these chains took, part of COUNT_RAYS_CLOSEST and COUNT_RAYS_SHADOW */
};

/* All rays of one batch, whose counters are bounded. Not for sums of many batches, which may be saturated. */
static inline uint64_t batch_rays(const uint64_t counters[BATCH_COUNTERS])
{
	return counters[COUNT_RAYS_CLOSEST] + counters[COUNT_RAYS_SHADOW];
}

/* Counters of the chains of a lease for each strategy of the plan's mixture; names in common/estimate/strategy.h.
 * From STRATEGY_FAIL_FIRST on: why a proposal could not be made or carried no light, one reason per proposal. */
enum { BATCH_STRATEGIES = PLAN_MAX_STRATEGIES };
enum strategy_counter {
	STRATEGY_PROPOSED, /* mutations for which the strategy was chosen */
	STRATEGY_ACCEPTED,
	STRATEGY_RAYS,		/* rays of its proposals, reverse walks included */
	STRATEGY_WALKS,		/* on the manifold */
	STRATEGY_ITERATIONS,	/* of all walks */
	STRATEGY_REVERSE_WALKS, /* walks from the proposal back to the current state */
	STRATEGY_FAIL_FIRST,
	STRATEGY_FAIL_OUTSIDE = STRATEGY_FAIL_FIRST, /* left the frame or the aperture */
	STRATEGY_FAIL_MISSED,			     /* a ray met nothing */
	STRATEGY_FAIL_BLOCKED,			     /* ... or another surface than expected */
	STRATEGY_FAIL_MODE,			     /* reflection or transmission, side, or material changed */
	STRATEGY_FAIL_SINGULAR,			     /* a singular matrix */
	STRATEGY_FAIL_DIVERGED,			     /* the step of a walk fell below the least step */
	STRATEGY_FAIL_ITERATIONS,		     /* a walk exceeded its iterations */
	STRATEGY_FAIL_REVERSE,			     /* the reverse walk failed or ended elsewhere */
	STRATEGY_FAIL_SPECULAR,			     /* would move a specular vertex that is fixed */
	STRATEGY_FAIL_EMITTER,			     /* did not end on an emitter that emits there */
	STRATEGY_FAIL_DARK,			     /* contributes nothing */
	STRATEGY_FAIL_INAPPLICABLE,		     /* the strategy cannot change this path */
	STRATEGY_COUNTERS,
};

/*
 * Within-chain moments, for chains only. A sequence is a chain; if the plan has more than SEQUENCES_MAX chains, a
 * sequence is all chains of one lease (which bounds the coordinator's memory). A mutation gives weight w to a state (1
 * - a to the current one, a to the proposal) whose I = X+Y+Z falls with share f into a tile of the crop; film points
 * outside the crop belong to no tile. First moments, by sequence and tile: the sum of w f. Second moments, by tile over
 * the whole lease: the sum of w f^2.
 */
enum { SEQUENCES_MAX = 4096 };
uint32_t batch_sequences(const struct plan *p);	 /* of one render lease; 0: no chains */
uint32_t batch_film_tiles(const struct plan *p); /* of the crop */
/* Number of floats in struct batch.moments for a lease of that kind. */
uint64_t batch_moment_count(const struct plan *p, enum lease_kind kind);

struct batch {
	struct lease_key key;
	uint64_t counters[BATCH_COUNTERS];
	uint32_t strategy_count; /* entries of the plan's mixture, or 0 */
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
	/* Sums over independent proposals of I = X+Y+Z of the whole sample; zeros are counted in COUNT_INDEPENDENT.
	 * beyond_sum: the same for paths longer than the integrator's state holds; estimated by the bootstrap and
	 * not part of independent_sum (b is the integral of what chains can reach). */
	double independent_sum, independent_square, beyond_sum;
	/* By path class. Bootstrap: the terms of independent_sum. Chains: time, the sum of w times the class's share
	 * of the state's I. Samples: the part of independent_sum that chains spread. */
	double classes[PATH_CLASSES];
	double cpu_seconds; /* not part of the result's bits */
	uint32_t tile_count;
	struct tile *tiles;
	uint32_t state_count; /* chains of the lease, in order of the chain range */
	struct chain_state *states;
	uint64_t weight_count; /* bootstrap: I of each index in the range, in order */
	float *weights;
	uint64_t moment_count;
	float *moments; /* [sequence][tile] first moments, then [tile] second ones; tiles in row-major order */
};

void batch_fini(struct batch *b);

/* Checks everything that can be checked without the scene: the key is in the plan; tiles are inside the crop,
 * aligned, unique, in order; values are finite; counts match the plan (COUNT_SAMPLES of a render lease and
 * COUNT_INDEPENDENT of a bootstrap lease exactly); states have sizes that such states can have; weights >= 0; as many
 * strategies as the plan has, none with more proposals than samples; no class and no sequence with more time than its
 * mutations; no tile with a second moment above the first; sums that non-negative numbers can have; counters of the
 * order of the samples. -EBADMSG with a sentence. */
int batch_check(const struct batch *b, const struct plan *p, struct error *e);

#endif
