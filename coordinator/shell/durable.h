/*
 * What survives the coordinator: its jobs in the ledger, their merged batches in journals, each flushed before it is
 * acknowledged. Batches that come while a flush is under way share the next one (group commit), which runs in the pool.
 * The loop's thread.
 */
#ifndef COORDINATOR_SHELL_DURABLE_H
#define COORDINATOR_SHELL_DURABLE_H

#include "coordinator/shell/server.h"

/* The job is in the ledger when this returns, with an empty journal: it may be told to whoever submitted it. */
int durable_begin(struct server *s, struct order *o, struct error *e);
/* Submission and plan as the ledger takes them; the two are mem_alloc'd, and NULL if they could not be made. */
int durable_pack(const struct order *o, struct ledger_job *j, unsigned char **submission, unsigned char **plan, struct error *e);
/* It has ended: its record is written, its films are kept (keep.h) or go. */
void durable_end(struct server *s, struct order *o);

/* Before the core sees the batch of this event: the frame for the journal, and room on the disk for it. -ENOSPC, -EFBIG: the disk
 * is full: the job is held until there is room. */
int durable_reserve(struct server *s, struct order *o, struct error *e);
/* The core merges the batch of this event. */
int durable_merged(struct server *s, struct order *o, struct error *e);
/* The answer to a batch that is merged, by now or before, when what the order's journal holds is safe. */
void durable_ack(struct server *s, const struct order *o, uint64_t peer, const struct lease_key *k, enum ack ack);
/* The last look at the job's error, if it is new. */
void durable_look(struct server *s, uint64_t job);

/* Now and then: jobs that are held for want of room, if there is some; what went wrong with a job since it was written down last. */
void durable_tick(struct server *s);
void durable_close(struct server *s); /* after the loop */

#endif
