/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The worker daemon: one loop thread that owns all state, and a pool of render threads. The worker connects, requests
 * leases, fetches scene files, sends results and keeps them until they are acknowledged. It reconnects for ever, unless
 * it is refused permanently. On SIGTERM it finishes running leases within the grace period, or gives them up, and
 * exits. It notifies the service manager (common/net/notify.h).
 *
 * A lease that makes no progress is returned as failed; if building a scene makes no progress, all leases that wait for
 * that scene are. A thread cannot be killed, so the worker then leaves as on SIGTERM, and the program exits with
 * AGENT_EXIT_HUNG. A leaving worker does not wait for scenes being built. The worker runs in a process that a signal
 * may end at any time (supervise.h); the leases of the previous process are returned as failed as soon as the next one
 * is connected (crash_record.h).
 */
#ifndef WORKER_DAEMON_AGENT_H
#define WORKER_DAEMON_AGENT_H

#include "common/base/error.h"
#include "worker/daemon/config.h"

enum { AGENT_EXIT_HUNG = 75 };	 /* exit code after a thread hung: the worker should be restarted */
enum { AGENT_EXIT_REFUSED = 6 }; /* exit code after -EACCES */

/* Runs a worker until it has left; if a thread is still working then, exits the program instead of returning. Returns
 * 0; -EINVAL, -EPERM or -EHOSTUNREACH at once for an unusable address; -EACCES if the coordinator refuses the worker
 * and reconnecting would not change that (role, version, contents of Hello); or another -errno of starting. */
int agent_run(const struct agent_config *c, struct error *e);

/* Like agent_run, in parts: an open agent works whenever its loop runs. */
struct agent;
int agent_open(struct agent **out, const struct agent_config *c, struct error *e);
void agent_close(struct agent *a); /* leaves at once, if it has not left; waits for the threads */
/* Leaves, if the worker is leaving and nothing is left to do. */
void agent_leave_if_idle(struct agent *a);

#endif
