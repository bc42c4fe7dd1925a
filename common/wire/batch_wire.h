/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts a batch to the LeaseResult message with its payload and back. The payload holds the tiles' EXRs, the chain
 * states and the weights (float32, little endian), in this order. The chain states of a grant are packed in the same
 * way. Both come with the states' digest, which the packer computes and the unpacker checks. Any thread.
 */
#ifndef COMMON_WIRE_BATCH_WIRE_H
#define COMMON_WIRE_BATCH_WIRE_H

#include "common/blob/blob.h"
#include "common/wire/plan_wire.h"

/* The longest payload of a valid batch of this plan: the limit of a connection. */
uint32_t batch_payload_max(const struct plan *p);
uint32_t states_payload_max(const struct plan *p);

/* Identifies the chain states of a lease: SHA-256 of the SHA-256 of each, in order. -ENOMEM */
int states_digest(const struct chain_state *states, uint32_t count, struct blob_hash *out, struct error *e);
/* Reads a digest from a message. -EBADMSG: wrong length. */
int states_digest_from_wire(const ProtobufCBinaryData *m, struct blob_hash *out, struct error *e);
/* The hash of a scene's file, from a message whose lengths were checked. */
struct blob_hash file_hash_from_wire(const Farm__File *f);

/* The whole frame, mem_alloc'd. -EMSGSIZE: it does not fit. */
int batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size, struct error *e);
/* Fills in the batch (batch_fini frees it); ends with batch_check. States without a digest are accepted: journals of
 * versions before 8 have none. -EBADMSG, -ENOMEM. */
int batch_unpack(struct batch *b, const struct plan *p, const Farm__LeaseResult *m, const unsigned char *payload,
		 size_t payload_size, struct error *e);
/* One tile of a result in its encoded form, for callers that store it: index below n_tile_sizes of a message that
 * batch_unpack accepted. */
const unsigned char *batch_tile_bytes(const Farm__LeaseResult *m, const unsigned char *payload, size_t index,
				      size_t *size);

/* A grant: key, and either seeds or states (NULL: none). The whole frame, mem_alloc'd. */
int grant_pack(const struct lease_key *k, const uint64_t *seeds, const struct chain_state *states, uint32_t chain_count,
	       unsigned char **frame, size_t *size, struct error *e);
/* A grant received by a worker: it owns its memory. */
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
