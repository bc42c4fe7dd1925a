/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's core: a pure state machine. No I/O, clock, threads; time is a field of the event.
 * One thread at a time. Allocates when a worker joins or a job is submitted, never later: those two can be refused, so
 * a step cannot fail. Memory: O(groups x parts) per live job, O(leases held) per worker, nothing per merged lease.
 *
 * Rules (each has a transcript in tests/coordinator/core):
 *  - A batch is merged iff its (job, kind, group, part, epoch) is open, not merged yet, its content is valid and its
 *    sender has the job's fingerprint, whoever holds the lease by now. A repeat is counted and dropped.
 *  - Epoch e + 1 of a (group, part) opens when its epoch e is merged and round e + 1 is at most one ahead of the first
 *    incomplete round: two rounds are open.
 *  - Higher priority first; among equals the owner with the fewest leases out in all, of its jobs that with the fewest,
 * then the older one. An owner is a name of a certificate; jobs without one are all one owner's, for a name that
 * anybody can call himself would be worth as many shares as he likes.
 *  - A job belongs to the fingerprint of its first worker (again free while nothing is merged and no lease is out).
 *  - A lease goes back to the pool when its holder leaves, is silent, fails or returns it. After 10 x the job's median
 *    lease time (at least 60 s; doubled each time for the same lease) it is handed out again, the first answer wins.
 *    A worker without other work gets a second copy of a lease of the first incomplete round that takes longer
 *    than 1.5 medians; never more than two workers are on one lease otherwise. While the job has no median, which is so
 * as long as nobody has answered, that is after 30 s (leases are made to take about 20), and of two copies that are
 * both out the older one is given up after 120 s for a worker that has nothing else to do.
 *  - What a worker holds at once is bounded by what it has given: 8 leases at first, twice as many after each that is
 * merged, half as many (1 at least) after each that was out for too long or that somebody else answered who got it
 * later. A node of 64 threads holds all it wants after its first four.
 *  - Invalid content is its sender's fault; after three faults in a row the worker gets no more leases.
 *    A failed lease is tried elsewhere; its worker, whatever its connection, waits 10, 20, 40 ... 640 s before it gets
 * more of this job; what it fails with meanwhile is the same failure.
 *  - The job fails when one lease failed on three workers, of three certificates where the farm knows as many
 * (failure_quorum.h): one worker never ends a job of which something is made, it waits for others, or for that one to
 * mend. While nothing was merged or noted the job fails, too, when any leases of it failed on three such workers, or on
 * all that are here and three times. What a worker lays to its own machine (a full disk) makes it pause and counts for
 * none of this: where all that are here say so the job waits, and its status names them.
 *  - A worker that goes while it holds a lease is on that lease's list (lost.h): when it calls again it may say that
 * the lease ended it, and that is a failure like any. Those who never call again count only when eight in a row held
 * the same lease. The owner of a job that ended workers gets one lease at a time for a while, of all his jobs that
 * nothing has been made of.
 *  - Of a job that is verified a share of the leases is computed by two workers, of two identities (worker_registry.h)
 * and one fingerprint. The first answer is noted; one that equals another worker's is merged; where two differ a third
 *    decides, and a fourth; then the job fails. Who said otherwise than two that agree has given a wrong result.
 *  - A worker is quarantined permanently, by identity, after three faults in a row or three wrong results. Nothing that
 * it sends counts any more, and no failure of a job is laid to its wrong results.
 *  - A worker that calls again, in the same run or a later one of the same home, takes the place of its old
 * connection.
 *  - A job of an earlier run goes on where its merged leases say that it was; leases that were out then count when
 * their results come, as any do. A bound that its last complete round had met, or a look at its error, is not
 * forgotten.
 *  - A job may get other bounds while it lives; one that has ended goes on as one of an earlier run does, under its
 * id. Neither changes what its leases compute.
 *  - A job that is held gets no leases out; results that come are merged, and its clock stands still.
 *  - Bounds are tested after complete rounds only. The target error is evaluated when merge_error_due() says so, as
 *    hslt-render does, and when another bound ends the job. From the end on nothing is merged: the image is exactly the
 *    prefix that met the bound, and depends on workers and order only if the bound is a time.
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
