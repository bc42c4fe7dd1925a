/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's core: a pure state machine without I/O, clock or threads; time is a field of each event. One thread
 * at a time. It allocates when a worker joins or a job is submitted, both of which may be refused, and never otherwise,
 * so a step cannot fail. Memory: O(groups x parts) per live job, O(leases held) per worker, nothing per merged lease.
 *
 * Rules (each has a transcript in tests/coordinator/core)
 *
 * Merging
 * - A batch is merged iff its (job, kind, group, part, epoch) is open and not merged yet, its content is valid and its
 *   sender has the job's fingerprint, no matter who holds the lease by then. A repeat is counted and dropped.
 * - Epoch e + 1 of a (group, part) opens when its epoch e is merged and round e + 1 is at most one ahead of the first
 *   incomplete round: two rounds are open.
 * - Bounds are tested after complete rounds only. The target error is evaluated when merge_error_due() says so, as in
 *   hslt-render, and when another bound ends the job. After the end nothing is merged: the image is exactly the prefix
 *   that met the bound, and depends on workers and order only if the bound is a time.
 *
 * Order of work
 * - Higher priority first; among equals the owner with the fewest leases out, then that owner's job with the fewest,
 *   then the older job. An owner is the name in a certificate. Jobs without one all have the same owner, because with a
 *   name of their own choice users could claim any number of shares.
 * - A job belongs to the fingerprint of its first worker, and is free again while nothing is merged and no lease is
 *   out.
 * - A job that is held gets no leases; results that arrive are merged, and its clock stands still.
 *
 * Time-outs
 * - A lease returns to the pool when its holder leaves, is silent, fails or returns it. After 10 times the job's median
 *   lease time (at least 60 s; doubled each time for the same lease) it is handed out again, and the first answer
 *   counts.
 * - An idle worker gets a second copy of a lease of the first incomplete round that takes longer than 1.5 medians.
 *   Otherwise at most two workers hold the same lease. While the job has no median because nobody has answered yet,
 *   that happens after 30 s (leases are made to take about 20), and the older of two copies is given up after 120 s for
 *   an idle worker.
 * - The number of leases that a worker may hold depends on what it has returned: 8 at first, twice as many after each
 *   that is merged, half as many (at least 1) after each that timed out or that another worker answered who got it
 *   later. A node of 64 threads holds all it wants after four results.
 *
 * Failures
 * - Invalid content is its sender's fault; after three faults in a row the worker gets no more leases.
 * - A failed lease is tried elsewhere; its worker, whatever its connection, waits 10, 20, 40 ... 640 s before it gets
 *   more of this job. What it fails with meanwhile is the same failure.
 * - A job fails when one lease failed on three workers, with three different certificates if the farm knows as many
 *   (failure_quorum.h). So one worker never ends a job of which something was computed: the job waits for others, or
 *   for that worker to be repaired. While nothing was merged or noted, a job also fails when any of its leases failed
 *   on three such workers, or three times and on all workers present. A failure that a worker attributes to its own
 *   machine (a full disk) makes it pause and does not count; if all workers present say so, the job waits and its
 *   status names them. A worker whose memory is taken by another scene is asked again every 10 s.
 * - A worker that disappears while it holds a lease is listed with that lease (lost_holders.h). When it reconnects it
 * may report that the lease ended it, which is an ordinary failure. Workers that never return count only if eight in a
 *   row held the same lease. After a job ended workers, its owner's jobs of which nothing was computed get one lease at
 *   a time for a while.
 *
 * Verification
 * - A share of the leases of a verified job is computed by two workers of different identities (worker_registry.h) with
 *   the same fingerprint. The first answer is noted; one that equals another worker's is merged. If two differ a third
 *   decides, and a fourth; then the job fails. A worker whose answer differs from one that two agree on has given a
 *   wrong result.
 * - A worker is quarantined permanently, by identity, after three faults in a row or three wrong results. Nothing that
 *   it sends counts any more, and its wrong results do not make a job fail.
 *
 * Restarts and changes
 * - A worker that reconnects, in the same run or a later one of the same home, replaces its old connection.
 * - A job of an earlier run continues from its merged leases; leases that were out count when their results arrive. A
 *   bound that the last complete round met still applies, and an estimate of the error that was due is made.
 * - A live job may get other bounds. A job that has ended continues like one of an earlier run, under its id. Neither
 *   changes what its leases compute.
 */
#ifndef COORDINATOR_CORE_FARM_H
#define COORDINATOR_CORE_FARM_H

#include "coordinator/core/config.h"
#include "coordinator/core/event.h"
#include "coordinator/core/status.h"
#include "coordinator/core/update.h"

struct farm;
int farm_new(struct farm **f, const struct farm_config *c, struct error *e); /* -EINVAL, -ENOMEM */
void farm_free(struct farm *f);
void farm_step(struct farm *f, const struct event *ev, struct update *u);

#endif
