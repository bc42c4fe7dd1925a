/*
 * Jobs of an earlier life, at the start: from the ledger and their journals into orders and the core, by the code that live
 * batches go through, so that the bits are the same. The core hears which leases are merged and no more: what was out when the
 * coordinator stopped comes back with its worker, or is handed out again.
 */
#ifndef COORDINATOR_SHELL_RESTORE_H
#define COORDINATOR_SHELL_RESTORE_H

#include "coordinator/shell/server.h"

int restore_open(struct server *s, struct error *e);           /* the ledger */
bool restore_lives(const struct server *s, uint64_t job);      /* it had not ended */
/* Jobs whose checkpoint or journal is damaged begin anew, those without a plan or a scene fail with a sentence; an error is one of the machine, and another start may go better. */
int restore_jobs(struct server *s, struct error *e);

#endif
