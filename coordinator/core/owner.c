/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/owner.h"

#include "common/base/mem.h"
#include "common/base/text.h"

#include <math.h>
#include <string.h>

struct owner *owner_acquire(struct link *owners, const char *name)
{
	char truncated[OWNER_NAME_SIZE];
	text_copy(truncated, sizeof truncated, name);
	for (struct link *k = owners->next; k != owners; k = k->next) {
		struct owner *o = list_entry(k, struct owner, link);
		if (strcmp(o->name, truncated) == 0) {
			o->reference_count++;
			return o;
		}
	}
	struct owner *o = mem_alloc(1, sizeof *o);
	if (!o)
		return NULL;
	memcpy(o->name, truncated, sizeof o->name);
	o->reference_count = 1;
	o->limited_until = -INFINITY;
	list_init(&o->link);
	list_append(owners, &o->link);
	return o;
}

void owner_release(struct owner *o)
{
	if (!o || --o->reference_count > 0)
		return;
	list_remove(&o->link);
	mem_free(o);
}

void owner_limit(struct owner *o, double now)
{
	static const double first_limit_seconds = 60;
	enum { DOUBLINGS = 6 };
	o->limited_until = now + ldexp(first_limit_seconds,
				       o->limitation_count < DOUBLINGS ? (int)o->limitation_count : DOUBLINGS);
	o->limitation_count++;
}
