/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts a batch to the LeaseResult message with its payload and back. The payload holds the tiles' EXRs, the chain
 * states, the weights and the moments (float32, little endian), in this order. The payload of a grant holds its chain
 * states in the same way. Messages with states have the states' digest, which packing computes and unpacking checks.
 * Any thread.
 */
#ifndef COMMON_WIRE_BATCH_WIRE_H
#define COMMON_WIRE_BATCH_WIRE_H

#include "common/blob/blob.h"
#include "common/wire/plan_wire.h"

/* Return the longest payload of a valid batch, or of a grant, of this plan: the limit to set for a connection. */
uint32_t batch_payload_max(const struct plan *p);
uint32_t chain_states_payload_max(const struct plan *p);

/* Computes the digest that identifies the chain states of a lease: SHA-256 of the SHA-256 of each, in order. Returns 0
 * or -ENOMEM. */
int chain_states_digest(const struct chain_state *states, uint32_t count, struct blob_hash *out, struct error *e);
/* Reads a digest from a message; -EBADMSG if its length is wrong. */
int chain_states_digest_from_wire(const ProtobufCBinaryData *m, struct blob_hash *out, struct error *e);
/* Returns the hash of a scene's file from a message in which the length of the hash has been checked. */
struct blob_hash file_hash_from_wire(const Farm__File *f);

/* Packs a batch into a whole frame, which is freed with mem_free. Returns 0, -EMSGSIZE if a frame cannot hold it, or
 * -ENOMEM. */
int batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size, struct error *e);
/* Unpacks a batch, which batch_fini frees, and applies batch_check. States without a digest are accepted: journals of
 * versions before 8 have none. Returns 0, -EBADMSG or -ENOMEM; the batch is empty after an error. */
int batch_unpack(struct batch *b, const struct plan *p, const Farm__LeaseResult *m, const unsigned char *payload,
		 size_t payload_size, struct error *e);
/* Returns the encoded form of one tile of a result, for callers that store it. index: below n_tile_sizes of a message
 * that batch_unpack has accepted. */
const unsigned char *batch_tile_bytes(const Farm__LeaseResult *m, const unsigned char *payload, size_t index,
				      size_t *size);

/* Packs a grant into a whole frame, which is freed with mem_free: a lease, and for chains either seeds or states (NULL:
 * none). */
int grant_pack(const struct lease_key *k, const uint64_t *seeds, const struct chain_state *states, uint32_t chain_count,
	       unsigned char **frame, size_t *size, struct error *e);
/* A grant received by a worker. It owns its memory. */
struct grant {
	struct lease_key key;
	uint32_t chain_count;
	uint64_t *seeds;
	struct chain_state *states;
	struct blob_hash digest; /* of the states */
};
/* Unpacks a grant, which grant_fini frees. Returns 0, -EBADMSG or -ENOMEM. */
int grant_unpack(struct grant *g, const Farm__LeaseGrant *m, const unsigned char *payload, size_t payload_size,
		 struct error *e);
void grant_fini(struct grant *g);

void chain_states_free(struct chain_state *states, uint32_t count); /* frees the states and the array */

#endif
