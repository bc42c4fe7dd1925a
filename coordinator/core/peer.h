/* SPDX-License-Identifier: Apache-2.0 */
/* What a connected worker may get: its place in the queue, its limit of leases, and its pauses with jobs. */
#ifndef COORDINATOR_CORE_PEER_H
#define COORDINATOR_CORE_PEER_H

#include "coordinator/core/state.h"

void peer_set_state(struct farm *f, struct peer *p, enum peer_state s);
/* Notes that the worker has sent something; a silent worker becomes active again. */
void peer_note_contact(struct farm *f, struct peer *p);
/* Moves the worker to the end of the queue, or takes it out of the queue if it wants or may hold no more leases. Call
 * after its wish, leases or state changed. */
void peer_requeue(struct farm *f, struct peer *p);
/* Whether the worker wants a lease and may hold one more. */
bool peer_wants_lease(const struct peer *p);

/* Begins or extends the worker's pause with the job. worker_at_fault: a fault of the worker's own machine. */
void peer_note_failure(const struct farm *f, struct peer *p, uint64_t job, bool worker_at_fault);
/* The worker returned a lease because another scene is in its memory: begins a pause of constant length. */
void peer_note_memory_full(const struct farm *f, struct peer *p, uint64_t job);
/* A result of the worker was merged: ends its pause with the job and doubles its limit of leases. */
void peer_note_success(struct farm *f, struct peer *p, uint64_t job);
/* halves its limit of leases: one timed out, or was first answered by a worker that got it later */
void peer_note_lateness(struct farm *f, struct peer *p);
double peer_backoff_end(const struct peer *p, uint64_t job); /* end of its pause with the job; -INFINITY: none */
/* The time until which the worker gets no lease of the job, because it pauses with it or its memory is full with
 * another job's scene; -INFINITY: none. */
double peer_pause_end(const struct peer *p, const struct job *j);
/* Whether the worker returned its last lease of the job because its memory was full. */
bool peer_waits_for_memory(const struct peer *p, uint64_t job);
/* Whether its last failure with the job was its own machine's fault. */
bool peer_is_at_fault(const struct peer *p, uint64_t job);

#endif
