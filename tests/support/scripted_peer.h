/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scripted peers of a coordinator: a client, and a worker whose results depend on the lease alone and take no time.
 * Blocking, one thread. A coordinator that hangs up is reported as NULL; one that is silent for a minute fails the
 * test.
 */
#ifndef TESTS_SUPPORT_SCRIPTED_PEER_H
#define TESTS_SUPPORT_SCRIPTED_PEER_H

#include "common/wire/batch_wire.h"
#include "common/wire/frame.h"

struct scripted_peer {
	int fd;
	struct frame_reader reader;
	unsigned char bytes[1 << 16];
	size_t offset, size;
	struct envelope env;
	unsigned heartbeats; /* number received */
};

/* Returns the port that a coordinator writes into this file once it listens; 0: not within a minute. */
uint16_t scripted_peer_read_port(const char *port_file);
struct scripted_peer *scripted_peer_connect(uint16_t port); /* sends nothing; NULL: nobody answers */
const Farm__HelloAck *scripted_peer_exchange_hello(struct scripted_peer *p, uint32_t version,
						   Farm__Role role);		/* NULL: no such answer */
struct scripted_peer *scripted_peer_connect_as(uint16_t port, Farm__Role role); /* NULL: nobody answers */
void scripted_peer_disconnect(struct scripted_peer *p);				/* NULL: nothing */
/* false: it hung up. */
bool scripted_peer_send(const struct scripted_peer *p, const Farm__Envelope *m, const void *payload,
			size_t payload_size);
/* Returns the next message that is not a heartbeat, valid until the next call; the payload is in p->reader. */
const Farm__Envelope *scripted_peer_receive(struct scripted_peer *p);
bool scripted_peer_is_merge_ack(const Farm__Envelope *m); /* m says that a result is merged and stored; not NULL */
/* There is a message, or the connection has ended. */
bool scripted_peer_is_readable(struct scripted_peer *p, int milliseconds);

/* Two groups of eight chains on a film of 20 x 10. */
extern const struct plan_request scripted_peer_plan_request;
bool scripted_peer_submit(const struct scripted_peer *p, const struct plan_request *r, const char *scene);
/* Sends the scene as well if it is asked for. Returns the job; a refusal fails the test. */
uint64_t scripted_peer_submit_with_scene(struct scripted_peer *p, const struct plan_request *r, const char *scene);
bool scripted_peer_send_scene(const struct scripted_peer *p, const char *scene);
bool scripted_peer_request_leases(const struct scripted_peer *p, uint32_t leases);
bool scripted_peer_request_job_list(const struct scripted_peer *p);
bool scripted_peer_fetch(const struct scripted_peer *p, uint64_t job, Farm__What what, uint64_t offset);

/* Makes a result: uniform light that differs for every lease, and chain states of state_bytes bytes that begin with
 * the lease's tag. */
struct batch scripted_peer_make_batch(const struct lease_key *k, const struct plan *plan, uint32_t state_bytes);
bool scripted_peer_send_batch(const struct scripted_peer *p, const struct batch *b, const struct plan *plan);
uint64_t scripted_peer_lease_tag(const struct lease_key *k); /* the number with which the lease's chain states begin */

#endif
