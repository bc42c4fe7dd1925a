/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's core: a pure state machine without I/O, clock or threads; time is a field of each event. One
 * thread at a time. It allocates when a worker joins or a job is submitted, both of which may be refused, and never
 * otherwise, so a step cannot fail. Memory: O(groups x parts) per live job, O(leases held) per worker, nothing per
 * merged lease.
 *
 * Rules (each has a transcript in tests/coordinator/core)
 *
 * Merging
 * - A batch is merged iff its (job, kind, group, part, epoch) is open and not merged yet, its content is valid and
 *   its sender has the job's fingerprint, no matter who holds the lease by then. A repeat is counted and dropped.
 * - Epoch e + 1 of a (group, part) opens when its epoch e is merged and round e + 1 is at most one ahead of the
 *   first incomplete round: two rounds are open.
 * - Bounds are tested after complete rounds only. The target error is evaluated when merge_error_is_due() says so, as
 *   in hslt-render, and when another bound ends the job. After the end nothing is merged: the image is exactly the
 *   prefix that met the bound, and depends on workers and order only if the bound is a time.
 *
 * Order of work
 * - The job of the highest priority goes first; among equal priorities the owner with the fewest leases out, then
 *   that owner's job with the fewest leases out, then the older job. An owner is the name in a certificate. Jobs
 *   without a certificate all have the same owner, because with a name of their own choice users could claim any
 *   number of shares.
 * - A job is pinned to the fingerprint of its first worker. While nothing is merged, it is unpinned whenever no
 *   lease is out.
 * - A job that is held gets no leases; results that arrive are merged, and its clock stands still.
 *
 * Time-outs
 * - A lease returns to the pool when its holder leaves, is silent, fails or returns it. After 10 times the job's
 *   median lease time (at least 60 s; doubled each time for the same lease) it is handed out again, and the first
 *   answer counts.
 * - If a lease of the first incomplete round takes longer than 1.5 medians, an idle worker gets a second copy of
 *   it. Without a median, because no lease of the job has been merged yet, the copy goes out after 30 s (leases are
 *   sized to take about 20 s), and after 120 s the older of two copies is given up for an idle worker. No more than
 *   two workers hold the same lease at once, not counting overdue leases.
 * - The number of leases that a worker may hold depends on its past results: 8 at first, doubled with each merged
 *   result, halved (to at least 1) whenever a lease times out or is answered first by a worker that got it later. A
 *   node of 64 threads holds all it wants after four results.
 *
 * Failures
 * - Invalid content is its sender's fault; after three faults in a row the worker is quarantined.
 * - A failed lease is tried elsewhere; the worker that failed, whatever its connection, waits 10, 20, 40 ... 640 s
 *   before it gets more leases of this job. Further failures during that pause count as the same failure.
 * - A job fails when one lease failed on three workers, with three different certificates if the farm knows as many
 *   (failure_quorum.h). So a single worker never ends a job of which something was computed: the job waits for
 *   others, or for that worker to be repaired. While nothing was merged or noted, a job also fails when its leases,
 *   whichever they are, failed on three such workers, or failed three times and on all connected workers. A failure
 *   that a worker attributes to its own machine (a full disk) makes the worker pause and does not count against the
 *   job; if all connected workers report such failures, the job waits and its status names them. A worker whose
 *   memory is taken by another scene is asked again every 10 s.
 * - A worker that disappears while it holds a lease is listed with that lease (lost_holders.h). When it reconnects
 *   it may report that the lease ended its process, which is an ordinary failure. Workers that never return count
 *   only if eight in a row held the same lease. After a job ended workers, those jobs of the same owner of which
 *   nothing was computed yet get one lease at a time for a while.
 *
 * Verification
 * - A share of the leases of a verified job is computed by two workers of different identities (worker_registry.h)
 *   with the same fingerprint. The first answer is noted; a later one that equals another worker's is merged. If two
 *   answers differ, a third worker is asked, then a fourth; if all four differ, the job fails. A worker whose answer
 *   differs from one that two workers agree on has given a wrong result.
 * - A worker is quarantined permanently, by identity, after three faults in a row or three wrong results. Nothing
 *   that it sends counts any more, and its wrong results do not make a job fail.
 *
 * Restarts and changes
 * - A worker that reconnects, in the same run or a later one of the same home, replaces its old connection.
 * - A job of an earlier run continues from its merged leases; leases that were out count when their results arrive.
 *   A bound that the last complete round met still applies, and an estimate of the error that was due is made.
 * - The bounds of a live job may be changed. A job that has ended may be extended, and then continues like a job of
 *   an earlier run, under its id. Neither changes what its leases compute.
 */
#ifndef COORDINATOR_CORE_FARM_H
#define COORDINATOR_CORE_FARM_H

#include "coordinator/core/config.h"
#include "coordinator/core/event.h"
#include "coordinator/core/status.h"
#include "coordinator/core/update.h"

struct farm;
int farm_new(struct farm **out, const struct farm_config *c, struct error *e); /* -EINVAL, -ENOMEM */
void farm_free(struct farm *f);
/* Handles one event. *u lists what the caller has to do (update.h), and is valid until the next step. */
void farm_step(struct farm *f, const struct event *ev, struct update *u);

#endif
