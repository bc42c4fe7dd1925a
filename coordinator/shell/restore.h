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
/* Jobs whose checkpoint or journal is damaged begin anew, those without a folder, a plan or a scene fail with a sentence. An error is
 * one of the machine, and another start may go better, or -EPROTO: another version of the coordinator wrote it. Then all is as it
 * was: nothing stored is given up because it could not be read. */
int restore_jobs(struct server *s, struct error *e);

/* One job from its row, for nobody yet. -EBADMSG: something of it is damaged or gone. */
int restore_order(struct server *s, const struct ledger_job *j, struct order **o, struct error *e);
void restore_drop(struct server *s, struct order *o); /* and lets go of its files */
/* The core hears of an order that is in the server's list. held: by whom, or "". Refusals carry the tag. */
int restore_tell(struct server *s, const struct order *o, const char *held, uint64_t tag, struct error *e);

#endif
