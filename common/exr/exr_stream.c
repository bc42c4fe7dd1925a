/* SPDX-License-Identifier: Apache-2.0 */
#include "common/exr/exr_stream.h"

#include "common/base/mem.h"

#include <stdio.h>
#include <string.h>

static struct exr_stream *stream_of(exr_const_context_t x)
{
	void *user = NULL;
	if (!x || exr_get_user_data(x, &user) != EXR_ERR_SUCCESS)
		return NULL;
	return user;
}

static void save_message(exr_const_context_t x, exr_result_t code, const char *message)
{
	struct exr_stream *s = stream_of(x);
	(void)code;
	if (s)
		snprintf(s->message, sizeof s->message, "%s", message);
}

static int64_t read_at(exr_const_context_t x, void *user, void *to, uint64_t size, uint64_t offset,
		       exr_stream_error_func_ptr_t error)
{
	const struct exr_stream *s = user;
	(void)x;
	(void)error;
	if (offset >= s->size)
		return 0;
	if (size > s->size - offset)
		size = s->size - offset;
	memcpy(to, s->source + offset, size);
	return (int64_t)size;
}

static int64_t stream_size(exr_const_context_t x, void *user)
{
	const struct exr_stream *s = user;
	(void)x;
	return (int64_t)s->size;
}

static int64_t write_at(exr_const_context_t x, void *user, const void *from, uint64_t size, uint64_t offset,
			exr_stream_error_func_ptr_t error)
{
	struct exr_stream *s = user;
	(void)error;
	if (offset > SIZE_MAX / 4 || size > SIZE_MAX / 4)
		return -1;
	size_t end = (size_t)(offset + size);
	if (end > s->capacity) {
		size_t capacity = end + end / 2;
		unsigned char *bytes = mem_grow(s->bytes, s->capacity, capacity);
		if (!bytes) {
			save_message(x, EXR_ERR_OUT_OF_MEMORY, "out of memory");
			return -1;
		}
		s->bytes = bytes;
		s->capacity = capacity;
	}
	memcpy(s->bytes + offset, from, size);
	s->size = end > s->size ? end : s->size;
	return (int64_t)size;
}

static exr_context_initializer_t make_initializer(struct exr_stream *s)
{
	exr_context_initializer_t i = EXR_DEFAULT_CONTEXT_INITIALIZER;
	/* The library uses its own allocator, not mem.h: tests make allocations of mem.h fail, and OpenEXRCore 3.1.5
	 * deadlocks if the allocation of an attribute fails. */
	i.error_handler_fn = save_message;
	i.user_data = s;
	i.max_image_width = i.max_image_height = EXR_SIDE_MAX;
	i.max_tile_width = i.max_tile_height = EXR_SIDE_MAX;
	return i;
}

int exr_set_error(const struct exr_stream *s, exr_result_t rc, struct error *e)
{
	int code = rc == EXR_ERR_OUT_OF_MEMORY ? ENOMEM : EBADMSG;
	return error_set(e, code, "OpenEXR: %s", s->message[0] ? s->message : exr_get_default_error_message(rc));
}

int exr_open_read(exr_context_t *x, struct exr_stream *s, const unsigned char *bytes, size_t size, struct error *e)
{
	*s = (struct exr_stream){.source = bytes, .size = size};
	exr_context_initializer_t i = make_initializer(s);
	i.read_fn = read_at;
	i.size_fn = stream_size;
	*x = NULL;
	exr_result_t rc = exr_start_read(x, "(memory)", &i);
	if (rc == EXR_ERR_SUCCESS)
		return 0;
	int code = exr_set_error(s, rc, e);
	if (*x)
		exr_finish(x);
	return code;
}

int exr_open_write(exr_context_t *x, struct exr_stream *s, size_t capacity, struct error *e)
{
	*s = (struct exr_stream){.bytes = mem_alloc(capacity, 1), .capacity = capacity};
	if (!s->bytes)
		return error_set(e, ENOMEM, "no memory for an EXR file");
	exr_context_initializer_t i = make_initializer(s);
	i.write_fn = write_at;
	*x = NULL;
	exr_result_t rc = exr_start_write(x, "(memory)", EXR_WRITE_FILE_DIRECTLY, &i);
	if (rc == EXR_ERR_SUCCESS)
		return 0;
	mem_free(s->bytes);
	return exr_set_error(s, rc, e);
}

int exr_close_write(exr_context_t *x, struct exr_stream *s, exr_result_t rc, unsigned char **bytes, size_t *size,
		    struct error *e)
{
	exr_result_t end = exr_finish(x);
	if (rc == EXR_ERR_SUCCESS)
		rc = end;
	if (rc != EXR_ERR_SUCCESS) {
		mem_free(s->bytes);
		return exr_set_error(s, rc, e);
	}
	*bytes = s->bytes;
	*size = s->size;
	return 0;
}

exr_attr_box2i_t exr_make_box(uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
	exr_attr_box2i_t b;
	b.min.x = (int32_t)x;
	b.min.y = (int32_t)y;
	b.max.x = (int32_t)(x + width) - 1;
	b.max.y = (int32_t)(y + height) - 1;
	return b;
}
