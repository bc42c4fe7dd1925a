/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The worker daemon: one loop thread that owns all state, a thread pool of render threads. Connects, asks for leases,
 * fetches what it needs, sends results and keeps them until they are acknowledged; reconnects for ever, unless it is
 * refused for good. On SIGTERM it finishes what runs within the grace period, or gives it up, and leaves. Tells the
 * service manager what it waits to hear (common/net/notify.h). A lease that gets nowhere is given back as failed, and
 * so are those that wait for a scene whose building gets nowhere; a thread cannot be ended, so the worker leaves as on
 * SIGTERM, and the program ends then and there, with AGENT_HUNG. Nobody waits for a scene that is being built when the
 * worker is to leave. It runs in a process that may be ended by a signal at any time (supervise.h); the leases that the
 * process before it had are given back as failed after the first welcome (work.h).
 */
#ifndef WORKER_DAEMON_AGENT_H
#define WORKER_DAEMON_AGENT_H

#include "common/base/error.h"
#include "worker/daemon/config.h"

enum { AGENT_HUNG = 75 };   /* exit code: to be started again */
enum { AGENT_REFUSED = 6 }; /* exit code of who gets -EACCES */

/* Returns when the worker has left; where a thread is still at work the program ends instead. -EINVAL, -EPERM,
 * -EHOSTUNREACH at once when the address is of no use; -EACCES: the coordinator refuses it, and calling again would not
 * mend that (role, version, what hello says). */
int agent_run(const struct agent_config *c, struct error *e);

/* The same in parts: opened, it works whenever its loop runs. */
struct agent;
int agent_open(struct agent **a, const struct agent_config *c, struct error *e);
void agent_close(struct agent *a); /* leaves, if it has not left; waits for its threads */
/* Leaves when it is to leave and nothing is left to do. */
void agent_settle(struct agent *a);

#endif
