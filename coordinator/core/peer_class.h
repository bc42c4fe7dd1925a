/* SPDX-License-Identifier: Apache-2.0 */
/* Workers with the same numeric fingerprint. */
#ifndef COORDINATOR_CORE_PEER_CLASS_H
#define COORDINATOR_CORE_PEER_CLASS_H

#include "coordinator/core/list.h"

#include <stdint.h>

enum { FINGERPRINT_SIZE = 128 };

struct peer_class {
	struct link link;	    /* in farm.classes */
	struct link waiting_peers;  /* workers that want a lease */
	uint32_t reference_count;   /* references: workers and live jobs */
	uint32_t active_peer_count; /* workers that may get leases */
	char fingerprint[FINGERPRINT_SIZE];
};

/* The class of this fingerprint, made if necessary; NULL: out of memory. */
struct peer_class *peer_class_acquire(struct link *classes, const char *fingerprint);
void peer_class_release(struct peer_class *c);

#endif
