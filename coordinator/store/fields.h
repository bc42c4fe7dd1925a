/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts members of a struct to JSON and back, by a table generated from the list of a job's fields
 * (coordinator/core/job_fields.h). Pure except for jansson's memory.
 */
#ifndef COORDINATOR_STORE_FIELDS_H
#define COORDINATOR_STORE_FIELDS_H

#include "common/base/error.h"
#include "coordinator/core/job_fields.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* All but FIELD_TEXT are named after their typedef, so that the kind in the list gives both. */
enum field_kind { FIELD_TEXT, FIELD_int, FIELD_u32, FIELD_u64, FIELD_bool, FIELD_real, FIELD_positive, FIELD_known };

struct field {
	enum field_kind kind;
	size_t offset, size;
	const char *key; /* NULL: not in this JSON */
};

/* Stores all fields, by their keys. -EINVAL: a text is not UTF-8; -ENOMEM */
int fields_store(const struct field *f, size_t count, const void *from, json_t *o, struct error *e);
/* Missing fields become 0 or "", or unknown if the kind allows that. */
void fields_read(const struct field *f, size_t count, void *to, const json_t *o);
/* As fields_store, but what is unknown is null. false: an error of that. */
bool fields_show(const struct field *f, size_t count, const void *from, json_t *o);

#endif
