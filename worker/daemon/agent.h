/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The worker daemon: one loop thread that owns all state, and a pool of render threads. It connects, asks for leases,
 * fetches what it needs, sends results and keeps them until they are acknowledged. It reconnects forever, unless it is
 * refused permanently. On SIGTERM it finishes running work within the grace period, or gives it up, and exits. It
 * notifies the service manager (common/net/notify.h).
 *
 * A lease that makes no progress is returned as failed. If the building of a scene makes none, all leases that wait for
 * it are. A thread cannot be killed, so the worker then leaves as on SIGTERM, and the program exits with AGENT_HUNG.
 * When it leaves it does not wait for scenes being built. It runs in a process that a signal may end at any time
 * (supervise.h); the leases of the previous process are returned as failed after the first welcome (work.h).
 */
#ifndef WORKER_DAEMON_AGENT_H
#define WORKER_DAEMON_AGENT_H

#include "common/base/error.h"
#include "worker/daemon/config.h"

enum { AGENT_HUNG = 75 };   /* exit code: restart it */
enum { AGENT_REFUSED = 6 }; /* exit code after -EACCES */

/* Returns when the worker has left; if a thread is still working, the program exits instead. -EINVAL, -EPERM,
 * -EHOSTUNREACH at once for an unusable address; -EACCES: the coordinator refuses it, and reconnecting would not
 * change that (role, version, contents of hello). */
int agent_run(const struct agent_config *c, struct error *e);

/* The same in parts: once opened, it works whenever its loop runs. */
struct agent;
int agent_open(struct agent **a, const struct agent_config *c, struct error *e);
void agent_close(struct agent *a); /* leaves, if it has not; waits for its threads */
/* Leaves if it is to leave and nothing is left to do. */
void agent_settle(struct agent *a);

#endif
