/* SPDX-License-Identifier: Apache-2.0 */
/* Finds threads that no longer make progress, and fails what they work on. Loop's thread. */
#ifndef WORKER_DAEMON_HANG_WATCH_H
#define WORKER_DAEMON_HANG_WATCH_H

#include "worker/daemon/agent_state.h"

enum { STALL_LOOKS = 8 };	       /* looks without progress until a thread counts as hung */
bool hang_watch_look(struct agent *a); /* true: a thread hangs that did not at the last look */

#endif
