/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Members of a struct to JSON and back, by a table that is made of a list of fields (record_fields.h, job/view.h). Pure
 * but for jansson's memory.
 */
#ifndef COORDINATOR_STORE_FIELDS_H
#define COORDINATOR_STORE_FIELDS_H

#include "common/base/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Each but FIELD_TEXT is named after its typedef below, so that the kind in a list gives both. positive and known are
 * real numbers that need not be known, and are shown as null then: those that are not positive, and those that are
 * negative. */
enum field_kind { FIELD_TEXT, FIELD_int, FIELD_u32, FIELD_u64, FIELD_bool, FIELD_real, FIELD_positive, FIELD_known };

typedef int field_int;
typedef uint32_t field_u32;
typedef uint64_t field_u64;
typedef bool field_bool;
typedef double field_real, field_positive, field_known;

struct field {
	enum field_kind kind;
	size_t offset, size;
	const char *key;   /* where it is stored; NULL: it is not */
	const char *shown; /* where it is shown; NULL: it is not */
};

/* As they are, by their keys. -EINVAL: a text is not UTF-8; -ENOMEM */
int fields_store(const struct field *f, size_t count, const void *from, json_t *o, struct error *e);
/* What is missing is 0 or "", and not known where a field has that. */
void fields_read(const struct field *f, size_t count, void *to, const json_t *o);
/* By the names by which they are shown. false: as the errors of fields_store. */
bool fields_show(const struct field *f, size_t count, const void *from, json_t *o);

#endif
