/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/client_answers.h"

#include "common/base/text.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/peers/upload.h"

#include <string.h>

bool client_may_see(const struct session *p, struct job_view *v)
{
	if (p->who.role == TLS_NOBODY || p->who.role == TLS_OPERATOR)
		return true;
	view_hide_others(v);
	return *p->who.name && strcmp(p->who.name, v->record.owner) == 0;
}

bool client_finds_job(const struct session *p, uint64_t job, struct job_view *v)
{
	return jobs_view(p->jobs, job, v) && client_may_see(p, v);
}

void client_send_done(struct session *p, const char *refusal, const char *text)
{
	char said[256];
	text_copy(said, sizeof said, refusal ? refusal : text);
	conn_send(p->conn, ENVELOPE(DONE, done, .ok = !refusal, .text = said), NULL, 0);
}

uint64_t client_uploading(const struct session *p)
{
	uint64_t bytes = 0;
	for (const struct session *other = LIST_FIRST(&p->peers->sessions); other; other = LIST_NEXT(other, next))
		if (other != p && other->upload && strcmp(other->who.name, p->who.name) == 0)
			bytes += live_job_asset_bytes(other->upload->submit.message->submit);
	return bytes;
}
