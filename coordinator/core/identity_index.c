/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/identity_index.h"

#include "common/base/fnv.h"
#include "common/base/mem.h"

#include <string.h>

int identity_index_init(struct identity_index *x, uint32_t bucket_count)
{
	*x = (struct identity_index){.bucket_count = bucket_count};
	for (int i = 0; i < IDENTITY_KEY_COUNT; i++)
		if (!(x->bucket_heads[i] = mem_alloc(bucket_count, sizeof *x->bucket_heads[i]))) {
			identity_index_fini(x);
			return -ENOMEM;
		}
	return 0;
}

void identity_index_fini(struct identity_index *x)
{
	for (int i = 0; i < IDENTITY_KEY_COUNT; i++)
		mem_free(x->bucket_heads[i]);
	*x = (struct identity_index){.bucket_count = 0};
}

static struct identity **bucket_of_id(const struct identity_index *x, uint64_t id)
{
	return &x->bucket_heads[IDENTITY_BY_ID][id % x->bucket_count];
}

static struct identity **bucket_of_text(const struct identity_index *x, enum identity_key by, const char *certificate,
					const char *text)
{
	/* The final 0 is hashed, too: it separates the certificate from the text. */
	uint64_t hash = fnv_add(fnv_add(FNV_OFFSET_BASIS, certificate, strlen(certificate) + 1), text, strlen(text));
	return &x->bucket_heads[by][hash % x->bucket_count];
}

static struct identity **bucket_of(const struct identity_index *x, enum identity_key by, const struct identity *k)
{
	return by == IDENTITY_BY_ID ? bucket_of_id(x, k->id)
				    : bucket_of_text(x, by, k->certificate, by == IDENTITY_BY_HOME ? k->home : k->name);
}

void identity_index_add(struct identity_index *x, struct identity *k)
{
	for (enum identity_key by = 0; by < IDENTITY_KEY_COUNT; by++) {
		struct identity **at = bucket_of(x, by, k);
		k->next[by] = *at;
		*at = k;
	}
}

void identity_index_remove(struct identity_index *x, struct identity *k)
{
	for (enum identity_key by = 0; by < IDENTITY_KEY_COUNT; by++) {
		struct identity **at = bucket_of(x, by, k);
		while (*at != k)
			at = &(*at)->next[by];
		*at = k->next[by];
	}
}

struct identity *identity_index_find_by_id(const struct identity_index *x, uint64_t id)
{
	struct identity *k = *bucket_of_id(x, id);
	while (k && k->id != id)
		k = k->next[IDENTITY_BY_ID];
	return k;
}

struct identity *identity_index_find_by_home(const struct identity_index *x, const char *certificate, const char *home)
{
	struct identity *k = *bucket_of_text(x, IDENTITY_BY_HOME, certificate, home);
	while (k && (strcmp(k->home, home) != 0 || strcmp(k->certificate, certificate) != 0))
		k = k->next[IDENTITY_BY_HOME];
	return k;
}

struct identity *identity_index_find_by_name(const struct identity_index *x, const char *certificate, const char *name)
{
	struct identity *last = NULL;
	for (struct identity *k = *bucket_of_text(x, IDENTITY_BY_NAME, certificate, name); k;
	     k = k->next[IDENTITY_BY_NAME])
		if ((!last || k->registry_index > last->registry_index) && strcmp(k->name, name) == 0 &&
		    strcmp(k->certificate, certificate) == 0)
			last = k;
	return last;
}
