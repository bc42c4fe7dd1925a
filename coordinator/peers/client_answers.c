/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/client_answers.h"

#include "common/base/text.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/peers/upload.h"

#include <string.h>

bool client_may_see(const struct session *p, struct job_view *v)
{
	if (p->tls_peer.role == TLS_NO_ROLE || p->tls_peer.role == TLS_OPERATOR)
		return true;
	view_hide_other_owners(v);
	return *p->tls_peer.name && strcmp(p->tls_peer.name, v->record.owner) == 0;
}

bool client_find_job(const struct session *p, uint64_t job, struct job_view *v)
{
	return jobs_get_view(p->jobs, job, v) && client_may_see(p, v);
}

void client_send_done(struct session *p, const char *refusal, const char *text)
{
	char message[256];
	text_copy(message, sizeof message, refusal ? refusal : text);
	conn_send(p->conn, ENVELOPE(DONE, done, .ok = !refusal, .text = message), NULL, 0);
}

uint64_t client_uploading_bytes(const struct session *p)
{
	uint64_t bytes = 0;
	for (const struct session *other = LIST_FIRST(&p->peers->sessions); other; other = LIST_NEXT(other, next))
		if (other != p && other->upload && strcmp(other->tls_peer.name, p->tls_peer.name) == 0)
			bytes += live_job_asset_bytes(other->upload->submission.message->submit);
	return bytes;
}
