/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts members of a struct to JSON and back, by a table generated from the list of a job's fields
 * (coordinator/core/job_fields.h). Pure except for jansson's memory.
 */
#ifndef COORDINATOR_STORE_JOB_FIELD_H
#define COORDINATOR_STORE_JOB_FIELD_H

#include "common/base/error.h"
#include "coordinator/core/job_fields.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* All kinds but FIELD_TEXT are named after their typedef in job_fields.h, so that the kind in the list gives both. */
enum job_field_kind {
	FIELD_TEXT,
	FIELD_int,
	FIELD_u32,
	FIELD_u64,
	FIELD_bool,
	FIELD_real,
	FIELD_positive,
	FIELD_known
};

struct job_field {
	enum job_field_kind kind;
	size_t offset, size;
	const char *key; /* NULL: the member is not in this JSON */
};

/* Stores all fields in o under their keys. Returns -EINVAL if a text is not UTF-8, -ENOMEM if out of memory. */
int fields_to_json(const struct job_field *f, size_t count, const void *from, json_t *o, struct error *e);
/* Reads all fields from o. A missing field becomes 0, "", or unknown if its kind allows that. */
void fields_from_json(const struct job_field *f, size_t count, void *to, const json_t *o);
/* Like fields_to_json(), but writes null for unknown numbers. Returns false on an error. */
bool fields_to_status_json(const struct job_field *f, size_t count, const void *from, json_t *o);

#endif
