/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/peer_class.h"

#include "common/base/mem.h"
#include "common/base/text.h"

#include <string.h>

struct peer_class *peer_class_acquire(struct link *classes, const char *fingerprint)
{
	for (struct link *l = classes->next; l != classes; l = l->next) {
		struct peer_class *c = list_entry(l, struct peer_class, link);
		if (strcmp(c->fingerprint, fingerprint) == 0) {
			c->reference_count++;
			return c;
		}
	}
	struct peer_class *c = mem_alloc(1, sizeof *c);
	if (!c)
		return NULL;
	text_copy(c->fingerprint, sizeof c->fingerprint, fingerprint);
	c->reference_count = 1;
	list_init(&c->waiting_peers);
	list_append(classes, &c->link);
	return c;
}

void peer_class_release(struct peer_class *c)
{
	if (--c->reference_count)
		return;
	list_remove(&c->link);
	mem_free(c);
}
