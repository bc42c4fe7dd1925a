/* SPDX-License-Identifier: Apache-2.0 */
/* Composes JSON values without checking each step: if memory runs out for any part, all parts are freed and the result
 * is NULL. Any thread. */
#ifndef COMMON_JSON_COMPOSE_H
#define COMMON_JSON_COMPOSE_H

#include <jansson.h>

/* Adds a value to an object (json_object_with) or list (json_array_with) and returns the object or list. Both arguments
 * may be NULL, and both references are taken over; NULL if either is NULL or memory is out. */
static inline json_t *json_object_with(json_t *o, const char *key, json_t *value)
{
	if (json_object_set_new(o, key, value) == 0)
		return o;
	json_decref(o);
	return NULL;
}

static inline json_t *json_array_with(json_t *list, json_t *value)
{
	if (json_array_append_new(list, value) == 0)
		return list;
	json_decref(list);
	return NULL;
}

#endif
