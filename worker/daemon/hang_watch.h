/* SPDX-License-Identifier: Apache-2.0 */
/* Finds threads that no longer make progress, and fails the leases that depend on them. The loop's thread. */
#ifndef WORKER_DAEMON_HANG_WATCH_H
#define WORKER_DAEMON_HANG_WATCH_H

#include "worker/daemon/agent_state.h"

enum { STALL_CHECKS = 8 }; /* looks without progress until a thread counts as hung */
/* Looks at all threads; to be called at regular intervals. Returns true if another thread hangs. */
bool hang_watch_check(struct agent *a);

#endif
