/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/session.h"

#include "common/base/text.h"

#include <stdarg.h>
#include <stdio.h>

struct session *peers_find_session(const struct peers *s, uint64_t id)
{
	for (struct session *p = LIST_FIRST(&s->buckets[id % SESSION_BUCKETS]); p; p = LIST_NEXT(p, bucket_entry))
		if (p->id == id)
			return p;
	return NULL;
}

void peers_add_session(struct peers *s, struct session *p)
{
	LIST_INSERT_HEAD(&s->buckets[p->id % SESSION_BUCKETS], p, bucket_entry);
	LIST_INSERT_HEAD(&s->sessions, p, next);
	s->session_count++;
}

void peers_remove_session(struct peers *s, struct session *p)
{
	LIST_REMOVE(p, bucket_entry);
	LIST_REMOVE(p, next);
	s->session_count--;
}

void session_fault(struct session *p, const char *format, ...)
{
	char text[512];
	va_list ap;
	va_start(ap, format);
	vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	text_clean(text);
	log_event(LOG_PEER_FAULT, "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id, p->address,
		  log_quote(p->name).text, log_quote(text).text);
	conn_send(p->conn, ENVELOPE(FAULT, fault, .text = text), NULL, 0);
	p->state = SESSION_LEAVING;
	conn_close_when_sent(p->conn, text);
}
