/* SPDX-License-Identifier: Apache-2.0 */
/* Finds threads that make no progress any more, and fails the leases that depend on them. Loop's thread. */
#ifndef WORKER_DAEMON_HANG_WATCH_H
#define WORKER_DAEMON_HANG_WATCH_H

#include "worker/daemon/agent_state.h"

enum { STALL_LOOKS = 8 };	       /* looks without progress until a thread counts as hung */
bool hang_watch_look(struct agent *a); /* call at regular intervals; true: another thread hangs */

#endif
