/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/worker_list.h"

#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/text.h"

/* Whether this client may read what workers say of jobs, its own or not. */
static bool can_read_faults(const struct session *p)
{
	return p->tls_peer.role == TLS_NO_ROLE || p->tls_peer.role == TLS_OPERATOR;
}

/* Copies the status of each connected worker. false: no memory. */
static bool copy_workers(const struct session *p, struct list *workers)
{
	const struct farm *f = p->jobs->farm;
	for (uint64_t id = 0; (id = farm_next_peer(f, id));) {
		struct peer_status *w = list_push(workers);
		if (!w)
			return false;
		farm_peer_status(f, id, w);
	}
	return true;
}

static void worker_to_wire(const struct peer_status *w, bool with_faults, Farm__WorkerStatus *out)
{
	farm__worker_status__init(out);
	out->name = text_unconst(w->name);
	out->state = text_unconst(peer_state_name(w->state));
	out->restarts = w->restarts;
	out->threads = w->threads;
	out->leases = w->held_leases;
	out->merged = w->merged;
	if (with_faults)
		out->text = text_unconst(w->last_fault);
}

void worker_list_send(struct session *p)
{
	struct list workers = {.item_size = sizeof(struct peer_status)};
	bool complete = copy_workers(p, &workers);
	struct peer_status *from = workers.items;
	Farm__WorkerStatus *to = mem_alloc(workers.count, sizeof *to), **refs = mem_alloc(workers.count, sizeof *refs);
	for (size_t i = 0; to && refs && i < workers.count; i++) {
		worker_to_wire(&from[i], can_read_faults(p), &to[i]);
		refs[i] = &to[i];
	}
	if (complete && to && refs)
		conn_send(p->conn,
			  ENVELOPE(WORKER_LIST_ANSWER, worker_list_answer, .n_workers = workers.count, .workers = refs),
			  NULL, 0);
	else
		session_fault(p, "no memory for the list of workers");
	mem_free(to);
	mem_free(refs);
	list_fini(&workers);
}
