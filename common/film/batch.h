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
/* Formats and arguments that print a lease: LEASE_FORMAT with LEASE_VALUES(&key) in a line of a log,
 * LEASE_POSITION_FORMAT with LEASE_POSITION_VALUES(&key), without the kind, in a sentence. */
#define LEASE_FORMAT "kind=%s group=%u part=%u epoch=%llu"
#define LEASE_VALUES(k) lease_kind_name((k)->kind), LEASE_POSITION_VALUES(k)
#define LEASE_POSITION_FORMAT "group %u part %u epoch %llu"
#define LEASE_POSITION_VALUES(k) (k)->group, (k)->part, (unsigned long long)(k)->epoch
bool lease_key_equal(const struct lease_key *a, const struct lease_key *b);

enum { TILE_SIZE = 64, TILE_CHANNELS = 3 }; /* X Y Z */

/* The sums of a rectangle of pixels. x and y are pixels of the FULL film; tiles are inside the crop and aligned to
 * TILE_SIZE from the crop's corner (smaller at the right and lower border). A batch contains only tiles that received
 * light, each at most once, in row-major order. */
struct tile {
	uint32_t x, y, width, height;
	float *xyz; /* [height][width][3], finite */
};

/* The state of one chain after an epoch, from which any worker can continue. Only the integrator interprets it. */
struct chain_state {
	uint8_t *bytes;
	uint32_t size; /* at most chain_state_max_bytes; 0: the chain does not run */
};
enum { CHAIN_STATE_MAX = 5376 }; /* largest size for any plan */

/* Returns the largest size of a state of this plan, in bytes; it grows with the plan's max_depth. */
uint32_t chain_state_max_bytes(const struct plan *p);
/* Returns the memory that the states of all chains of the plan need at most. */
uint64_t chain_states_max_bytes(const struct plan *p);
/* Returns the memory that these states need; 0 if s is NULL. */
uint64_t chain_states_bytes(const struct chain_state *s, uint32_t count);

enum { BATCH_COUNTERS = 16 };
enum batch_counter {
	COUNT_SAMPLES,	   /* samples or mutations made */
	COUNT_ACCEPTED,	   /* accepted mutations */
	COUNT_INDEPENDENT, /* independent proposals (bootstrap samples, large steps) */
	COUNT_NAN,	   /* contributions refused because they were NaN */
	COUNT_INFINITE,	   /* contributions refused because they were infinite */
	COUNT_NEGATIVE,	   /* contributions refused because they were negative */
	COUNT_RAYS_CLOSEST,
	COUNT_RAYS_SHADOW,
	COUNT_STUCK,	     /* chains that accepted nothing during the epoch */
	COUNT_LONGEST_STUCK, /* most rejections in a row (merged by maximum) */
	COUNT_STATES_LOST, /* chains whose state after the epoch could not be decoded again, so that they begin the next
			      epoch where they began this one; or whose seed carried no light on this worker */
	COUNT_REDISTRIBUTED, /* contributions of samples that were too bright and were spread by chains (erpt) */
	COUNT_REDISTRIBUTION_MUTATIONS, /* mutations of these chains */
	COUNT_REDISTRIBUTION_RAYS,	/* rays of these chains, included in COUNT_RAYS_CLOSEST and COUNT_RAYS_SHADOW */
};

/* Returns all rays of one batch, whose counters are bounded by batch_check. Sums of many batches may be saturated, and
 * adding them here could overflow. */
static inline uint64_t batch_ray_count(const uint64_t counters[BATCH_COUNTERS])
{
	return counters[COUNT_RAYS_CLOSEST] + counters[COUNT_RAYS_SHADOW];
}

/* Counters of the chains of a lease for each strategy of the plan's mixture; common/estimate/strategy.h has their
 * names. The counters from STRATEGY_FAIL_FIRST on are the reasons why proposals could not be made or carried no light,
 * one reason per proposal. */
enum { BATCH_STRATEGIES = PLAN_STRATEGIES_MAX };
enum strategy_counter {
	STRATEGY_PROPOSED, /* mutations for which the strategy was chosen */
	STRATEGY_ACCEPTED,
	STRATEGY_RAYS,		/* rays of its proposals, reverse walks included */
	STRATEGY_WALKS,		/* walks on the manifold */
	STRATEGY_ITERATIONS,	/* iterations of all walks */
	STRATEGY_REVERSE_WALKS, /* walks from the proposal back to the current state */
	STRATEGY_FAIL_FIRST,
	STRATEGY_FAIL_OUTSIDE = STRATEGY_FAIL_FIRST, /* left the frame or the aperture */
	STRATEGY_FAIL_MISSED,			     /* a ray met nothing */
	STRATEGY_FAIL_BLOCKED,			     /* a ray met another surface than expected */
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
 * Moments within chains, for plans of chains only. They are kept per sequence and tile. A sequence is one chain; if the
 * plan has more than SEQUENCES_MAX chains, it is all chains of one lease, which bounds the coordinator's memory. Each
 * mutation gives the weight w = 1 - a to the current state and w = a to the proposal (a: the acceptance probability); a
 * share f of a state's I = X+Y+Z falls into a tile of the crop (film points outside the crop belong to no tile). First
 * moments, per sequence and tile, are the sums of w f; second moments, per tile over the whole lease, the sums of w
 * f^2.
 */
enum { SEQUENCES_MAX = 4096 };
uint32_t batch_sequence_count(const struct plan *p);  /* sequences of one render lease; 0: the plan has no chains */
uint32_t batch_film_tile_count(const struct plan *p); /* tiles of the crop */
/* Returns the number of floats in struct batch.moments for a lease of that kind. */
uint64_t batch_moment_count(const struct plan *p, enum lease_kind kind);

struct batch {
	struct lease_key key;
	uint64_t counters[BATCH_COUNTERS];
	uint32_t strategy_count; /* entries of the plan's mixture, or 0 */
	uint64_t strategies[BATCH_STRATEGIES][STRATEGY_COUNTERS];
	/* Sums of I and I^2 over the independent samples, I = X+Y+Z of the whole sample. COUNT_INDEPENDENT also counts
	 * samples with I = 0. overlong_sum: the sum of I of paths too long for a chain's state, estimated by the
	 * bootstrap; not part of independent_sum, since b is the integral over the paths that chains can reach. */
	double independent_sum, independent_square, overlong_sum;
	/* By path class. Bootstrap: the class's part of independent_sum. Chains: time, the sum of w times the class's
	 * share of the state's I. Samples: the part of independent_sum that chains spread (erpt). */
	double classes[PATH_CLASSES];
	double cpu_seconds; /* not part of the result's bits */
	uint32_t tile_count;
	struct tile *tiles;
	uint32_t state_count; /* chains of the lease; states are in the order of its chain range */
	struct chain_state *states;
	uint64_t weight_count; /* bootstrap samples of the lease */
	float *weights;	       /* I of each, in order of their indices */
	uint64_t moment_count;
	float *moments; /* [sequence][tile] first moments, then [tile] second ones; tiles in row-major order */
};

void batch_fini(struct batch *b); /* frees the arrays */

/* Checks everything that can be checked without the scene:
 * - the lease exists in the plan;
 * - tiles are inside the crop, aligned, unique and in order, and their values are finite;
 * - counts match the plan, COUNT_SAMPLES of a render lease and COUNT_INDEPENDENT of a bootstrap lease exactly, and no
 *   counter is larger than that many samples can make it;
 * - chain states have possible sizes, and weights are finite and not negative;
 * - sums of non-negative terms and of their squares are consistent;
 * - strategies are as many as in the plan, with at most as many proposals as samples;
 * - no class and no sequence has more time than mutations, and no tile's second moment is above its first.
 * Returns 0, or -EBADMSG with a sentence. */
int batch_check(const struct batch *b, const struct plan *p, struct error *e);

#endif
