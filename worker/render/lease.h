/* SPDX-License-Identifier: Apache-2.0 */
/* A lease: the chains of one group for one epoch, or a range of samples, rendered by one thread. */
#ifndef WORKER_RENDER_LEASE_H
#define WORKER_RENDER_LEASE_H

#include "common/film/batch.h"

#include <stdatomic.h>

struct brightness; /* brightness_map.h */
struct world;

/* The input of a lease: at epoch 0 its seeds (bootstrap indices, one per chain), later the states after the previous
 * epoch; if the states are lost, seeds again, from which the chains restart. */
struct lease_input {
	uint32_t chain_count;
	const uint64_t *seeds;		  /* NULL if there are states */
	const struct chain_state *states; /* NULL at epoch 0 */
	const struct brightness *map;	  /* NULL: a lease that needs a map makes an identical one itself */
};

enum lease_outcome { LEASE_DONE, LEASE_STOPPED };

/* Runs one lease and fills the batch (batch_fini frees it). `stop` may become true at any time; then the lease is
 * abandoned. Returns -ENOMEM, -EILSEQ (states that cannot be resumed), -EINVAL (plan and world do not fit), or -EDOM
 * (an invalid floating-point operation; the error message says where). Ticks (common/base/liveness.h) at least every
 * 16 samples or mutations. */
int render_lease(const struct world *w, const struct plan *p, const struct lease_key *k, const struct lease_input *in,
		 const atomic_bool *stop, enum lease_outcome *result, struct batch *out, struct error *e);

#endif
