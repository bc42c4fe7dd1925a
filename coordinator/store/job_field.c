/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/job_field.h"

#include "common/base/text.h"
#include "common/json/estimate_json.h"

static json_t *field_to_json(const struct job_field *f, const void *from)
{
	const void *member = (const char *)from + f->offset;
	switch (f->kind) {
	case FIELD_TEXT:
		return json_string(member);
	case FIELD_int:
		return json_integer(*(const field_int *)member);
	case FIELD_u32:
		return json_integer(*(const field_u32 *)member);
	case FIELD_u64:
		return json_integer((json_int_t) * (const field_u64 *)member);
	case FIELD_bool:
		return json_boolean(*(const field_bool *)member);
	case FIELD_real:
	case FIELD_positive:
	case FIELD_known:
		return json_real_or_null(*(const field_real *)member);
	}
	return NULL;
}

static json_t *field_to_status_json(const struct job_field *f, const void *from)
{
	const double *x = (const void *)((const char *)from + f->offset);
	if (f->kind == FIELD_positive)
		return *x > 0 ? json_real_or_null(*x) : json_null();
	if (f->kind == FIELD_known)
		return *x >= 0 ? json_real_or_null(*x) : json_null();
	return field_to_json(f, from);
}

int fields_to_json(const struct job_field *f, size_t count, const void *from, json_t *o, struct error *e)
{
	for (const struct job_field *end = f + count; f < end; f++) {
		if (!f->key || json_object_set_new(o, f->key, field_to_json(f, from)) == 0)
			continue;
		json_t *text = f->kind == FIELD_TEXT ? json_string_nocheck((const char *)from + f->offset) : NULL;
		int rc = text ? error_set(e, EINVAL, "Invalid UTF-8 in \"%s\"", f->key)
			      : error_set(e, ENOMEM, "no memory for \"%s\"", f->key);
		json_decref(text);
		return rc;
	}
	return 0;
}

bool fields_to_status_json(const struct job_field *f, size_t count, const void *from, json_t *o)
{
	for (size_t i = 0; i < count; i++)
		if (f[i].key && json_object_set_new(o, f[i].key, field_to_status_json(&f[i], from)))
			return false;
	return true;
}

static void field_from_json(const struct job_field *f, void *to, const json_t *value)
{
	void *member = (char *)to + f->offset;
	const char *text = json_string_value(value);
	switch (f->kind) {
	case FIELD_TEXT:
		text_copy(member, f->size, text ? text : "");
		break;
	case FIELD_int:
		*(field_int *)member = (field_int)json_integer_value(value);
		break;
	case FIELD_u32:
		*(field_u32 *)member = (field_u32)json_integer_value(value);
		break;
	case FIELD_u64:
		*(field_u64 *)member = (field_u64)json_integer_value(value);
		break;
	case FIELD_bool:
		*(field_bool *)member = json_is_true(value);
		break;
	case FIELD_real:
	case FIELD_positive:
		*(field_real *)member = json_number_value(value);
		break;
	case FIELD_known:
		*(field_real *)member = json_is_number(value) ? json_number_value(value) : -1;
		break;
	}
}

void fields_from_json(const struct job_field *f, size_t count, void *to, const json_t *o)
{
	for (size_t i = 0; i < count; i++)
		if (f[i].key)
			field_from_json(&f[i], to, json_object_get(o, f[i].key));
}
