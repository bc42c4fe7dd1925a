/*
 * A batch: the result of one lease. Its content depends on (plan, kind, group, part, epoch) only.
 * In memory here; on the wire a message header followed by one EXR per tile (common/film/exr.h).
 */
#ifndef COMMON_FILM_BATCH_H
#define COMMON_FILM_BATCH_H

#include "common/base/error.h"
#include "common/plan/plan.h"

struct lease_key {
	uint64_t job;
	enum lease_kind kind;
	uint32_t group, part;
	uint64_t epoch;
};

enum { TILE_SIZE = 64, TILE_CHANNELS = 3 }; /* X Y Z */

/* A rectangle that changed; x, y in pixels of the FULL film, inside the crop, aligned to TILE_SIZE from the crop's corner
 * (smaller at the right and lower border). Each tile at most once in a batch, in row-major order. */
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
	COUNT_SAMPLES,        /* samples or mutations made */
	COUNT_ACCEPTED,       /* accepted mutations */
	COUNT_INDEPENDENT,    /* independent proposals (bootstrap samples, large steps) */
	COUNT_NAN,            /* contributions refused: not a number */
	COUNT_INFINITE,       /* ... infinite */
	COUNT_NEGATIVE,       /* ... negative */
	COUNT_RAYS_CLOSEST,
	COUNT_RAYS_SHADOW,
	COUNT_STUCK,          /* chains that accepted nothing during the epoch */
	COUNT_LONGEST_STUCK,  /* most rejections in a row (merged by maximum) */
};

struct batch {
	struct lease_key key;
	uint64_t counters[BATCH_COUNTERS];
	/* Sums over independent proposals of I = X+Y+Z of the whole sample, zeros counted in COUNT_INDEPENDENT.
	 * beyond_sum: the same from paths longer than the integrator's state holds, estimated by the bootstrap and not in
	 * independent_sum (b is the integral of what the chains can reach). */
	double independent_sum, independent_square, beyond_sum;
	double cpu_seconds; /* not part of the result's bits */
	uint32_t tile_count;
	struct tile *tiles;
	uint32_t state_count; /* chains of the lease, in order of the chain range */
	struct chain_state *states;
	uint64_t weight_count; /* bootstrap: I of each index of the range, in order */
	float *weights;
};

void batch_fini(struct batch *b);

/* All that can be checked without the scene: key inside the plan, tiles inside the crop, aligned, once, in order, values
 * finite, counts as the plan says (COUNT_SAMPLES of a render lease and COUNT_INDEPENDENT of a bootstrap lease exactly),
 * states bounded, weights >= 0. -EBADMSG with a sentence. */
int batch_check(const struct batch *b, const struct plan *p, struct error *e);

#endif
