/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A batch between memory and the LeaseResult message with its payload: the tiles' EXRs, the chain states, the weights
 * (float32, little endian), one after the other. Chain states of a grant travel the same way, both with the states'
 * digest, which is made by who packs them and held against them by who unpacks them. Any thread.
 */
#ifndef COMMON_WIRE_BATCH_WIRE_H
#define COMMON_WIRE_BATCH_WIRE_H

#include "common/blob/blob.h"
#include "common/wire/plan_wire.h"

/* Longest payload that an honest batch of this plan has: what a connection lets through. */
uint32_t batch_payload_max(const struct plan *p);
uint32_t states_payload_max(const struct plan *p);

/* Names the chain states of a lease: SHA-256 of the SHA-256 of each, in order. -ENOMEM */
int states_digest(const struct chain_state *states, uint32_t count, struct blob_hash *out, struct error *e);
/* Reads a digest from a message. -EBADMSG: of another length. */
int states_digest_from_wire(const ProtobufCBinaryData *m, struct blob_hash *out, struct error *e);

/* The whole frame, mem_alloc'd. -EMSGSIZE when it does not fit. */
int batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size, struct error *e);
/* Fills the batch (batch_fini frees it); ends with batch_check. States without a digest are taken: journals of versions
 * before 8 have none. -EBADMSG, -ENOMEM. */
int batch_unpack(struct batch *b, const struct plan *p, const Farm__LeaseResult *m, const unsigned char *payload,
		 size_t payload_size, struct error *e);
/* One tile of a result as it came, for those who keep it: index below n_tile_sizes of a message that batch_unpack took.
 */
const unsigned char *batch_tile_bytes(const Farm__LeaseResult *m, const unsigned char *payload, size_t index,
				      size_t *size);

/* A grant: key, and either seeds or states (NULL: none). The whole frame, mem_alloc'd. */
int grant_pack(const struct lease_key *k, const uint64_t *seeds, const struct chain_state *states, uint32_t chain_count,
	       unsigned char **frame, size_t *size, struct error *e);
/* A grant in the hands of a worker: copies. */
struct grant {
	struct lease_key key;
	uint32_t chain_count;
	uint64_t *seeds;
	struct chain_state *states;
	struct blob_hash digest; /* of the states */
};
int grant_unpack(struct grant *g, const Farm__LeaseGrant *m, const unsigned char *payload, size_t payload_size,
		 struct error *e);
void grant_fini(struct grant *g);

void states_fini(struct chain_state *states, uint32_t count);

#endif
