/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts members of a struct to JSON and back, by a table generated from a list of fields (record_fields.h,
 * job/view.h). Pure except for jansson's memory.
 */
#ifndef COORDINATOR_STORE_FIELDS_H
#define COORDINATOR_STORE_FIELDS_H

#include "common/base/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* All but FIELD_TEXT are named after their typedef below, so that the kind in a list gives both. `positive` and
 * `known` are real numbers that may be unknown, and then are null in JSON: those that are not positive, and those
 * that are negative. */
enum field_kind { FIELD_TEXT, FIELD_int, FIELD_u32, FIELD_u64, FIELD_bool, FIELD_real, FIELD_positive, FIELD_known };

typedef int field_int;
typedef uint32_t field_u32;
typedef uint64_t field_u64;
typedef bool field_bool;
typedef double field_real, field_positive, field_known;

struct field {
	enum field_kind kind;
	size_t offset, size;
	const char *key;   /* key where it is stored; NULL: not stored */
	const char *shown; /* key where it is shown; NULL: not shown */
};

/* Stores all fields, by their keys. -EINVAL: a text is not UTF-8; -ENOMEM */
int fields_store(const struct field *f, size_t count, const void *from, json_t *o, struct error *e);
/* Missing fields become 0 or "", or unknown if the kind allows that. */
void fields_read(const struct field *f, size_t count, void *to, const json_t *o);
/* Shows the fields by their shown names. false: an error as of fields_store. */
bool fields_show(const struct field *f, size_t count, const void *from, json_t *o);

#endif
