/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/identity_index.h"

#include "common/base/fnv.h"
#include "common/base/mem.h"

#include <string.h>

int identity_index_init(struct identity_index *x, uint32_t buckets)
{
	*x = (struct identity_index){.buckets = buckets};
	for (int i = 0; i < IDENTITY_KEYS; i++)
		if (!(x->first[i] = mem_alloc(buckets, sizeof *x->first[i]))) {
			identity_index_fini(x);
			return -ENOMEM;
		}
	return 0;
}

void identity_index_fini(struct identity_index *x)
{
	for (int i = 0; i < IDENTITY_KEYS; i++)
		mem_free(x->first[i]);
	*x = (struct identity_index){.buckets = 0};
}

static struct identity **bucket_of_id(const struct identity_index *x, uint64_t id)
{
	return &x->first[IDENTITY_BY_ID][id % x->buckets];
}

static struct identity **bucket_of_text(const struct identity_index *x, enum identity_key by, const char *certificate,
					const char *text)
{
	/* The final 0 is hashed, too: it separates the certificate from the text. */
	uint64_t hash = fnv_add(fnv_add(FNV_BEGIN, certificate, strlen(certificate) + 1), text, strlen(text));
	return &x->first[by][hash % x->buckets];
}

static struct identity **bucket_of(const struct identity_index *x, enum identity_key by, const struct identity *k)
{
	return by == IDENTITY_BY_ID ? bucket_of_id(x, k->id)
				    : bucket_of_text(x, by, k->certificate, by == IDENTITY_BY_HOME ? k->home : k->name);
}

void identity_index_add(struct identity_index *x, struct identity *k)
{
	for (enum identity_key by = 0; by < IDENTITY_KEYS; by++) {
		struct identity **at = bucket_of(x, by, k);
		k->next[by] = *at;
		*at = k;
	}
}

void identity_index_remove(struct identity_index *x, struct identity *k)
{
	for (enum identity_key by = 0; by < IDENTITY_KEYS; by++) {
		struct identity **at = bucket_of(x, by, k);
		while (*at != k)
			at = &(*at)->next[by];
		*at = k->next[by];
	}
}

struct identity *identity_index_id(const struct identity_index *x, uint64_t id)
{
	struct identity *k = *bucket_of_id(x, id);
	while (k && k->id != id)
		k = k->next[IDENTITY_BY_ID];
	return k;
}

struct identity *identity_index_home(const struct identity_index *x, const char *certificate, const char *home)
{
	struct identity *k = *bucket_of_text(x, IDENTITY_BY_HOME, certificate, home);
	while (k && (strcmp(k->home, home) != 0 || strcmp(k->certificate, certificate) != 0))
		k = k->next[IDENTITY_BY_HOME];
	return k;
}

struct identity *identity_index_name(const struct identity_index *x, const char *certificate, const char *name)
{
	struct identity *last = NULL;
	for (struct identity *k = *bucket_of_text(x, IDENTITY_BY_NAME, certificate, name); k;
	     k = k->next[IDENTITY_BY_NAME])
		if ((!last || k->place > last->place) && strcmp(k->name, name) == 0 &&
		    strcmp(k->certificate, certificate) == 0)
			last = k;
	return last;
}
