/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/owner.h"

#include "common/base/mem.h"
#include "common/base/text.h"

#include <math.h>
#include <string.h>

struct owner *owner_use(struct link *owners, const char *name)
{
	char cut[OWNER_NAME];
	text_copy(cut, sizeof cut, name);
	for (struct link *k = owners->next; k != owners; k = k->next) {
		struct owner *o = list_entry(k, struct owner, link);
		if (strcmp(o->name, cut) == 0) {
			o->uses++;
			return o;
		}
	}
	struct owner *o = mem_alloc(1, sizeof *o);
	if (!o)
		return NULL;
	memcpy(o->name, cut, sizeof o->name);
	o->uses = 1;
	o->limited_until = -INFINITY;
	list_init(&o->link);
	list_append(owners, &o->link);
	return o;
}

void owner_drop(struct owner *o)
{
	if (!o || --o->uses > 0)
		return;
	list_remove(&o->link);
	mem_free(o);
}

void owner_limit(struct owner *o, double now)
{
	static const double first = 60;
	enum { DOUBLINGS = 6 };
	o->limited_until = now + ldexp(first, o->limits < DOUBLINGS ? (int)o->limits : DOUBLINGS);
	o->limits++;
}
