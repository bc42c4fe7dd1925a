/* SPDX-License-Identifier: Apache-2.0 */
/* Composes JSON values: if memory runs out for a part, the rest is freed, and the result is NULL. Any thread. */
#ifndef COMMON_JSON_COMPOSE_H
#define COMMON_JSON_COMPOSE_H

#include <jansson.h>

/* Each takes both values, any of which may be NULL, and returns the first with the second in it. */
static inline json_t *json_with(json_t *o, const char *key, json_t *value)
{
	if (json_object_set_new(o, key, value) == 0)
		return o;
	json_decref(o);
	return NULL;
}

static inline json_t *json_and(json_t *list, json_t *value)
{
	if (json_array_append_new(list, value) == 0)
		return list;
	json_decref(list);
	return NULL;
}

#endif
