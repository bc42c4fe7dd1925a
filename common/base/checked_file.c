/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/checked_file.h"

#include "common/base/bytes.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <string.h>

enum { BUFFER_SIZE = 1 << 16, CRC_SIZE = 4 };

static int set_file_error(const struct checked_file *s, int code, struct error *e)
{
	return error_set(e, code, "%s: %s", s->path, strerror(code));
}

static int open_file(struct checked_file *s, const char *path, int flags, struct error *e)
{
	*s = (struct checked_file){.path = path, .fd = disk_open(path, flags | O_CLOEXEC, 0666)};
	if (s->fd < 0)
		return set_file_error(s, errno, e);
	s->buffer = mem_alloc(BUFFER_SIZE, 1);
	if (s->buffer)
		return 0;
	disk_close(s->fd);
	return error_set(e, ENOMEM, "no memory to open %s", path);
}

int checked_file_create(struct checked_file *s, const char *path, struct error *e)
{
	return open_file(s, path, O_WRONLY | O_CREAT | O_TRUNC, e);
}

static int flush_buffer(struct checked_file *s, struct error *e)
{
	int rc = disk_write_all(s->fd, s->buffer, s->buffered_bytes);
	s->buffered_bytes = 0;
	return rc ? set_file_error(s, -rc, e) : 0;
}

/* Flushes the buffer when the next number would not fit, so that no number is split between two buffers. */
int checked_file_write_numbers(struct checked_file *s, const void *numbers, size_t width, size_t count, struct error *e)
{
	for (const unsigned char *p = numbers; count;) {
		size_t room = (BUFFER_SIZE - s->buffered_bytes) / width, n = count < room ? count : room,
		       size = width * n;
		copy_numbers(s->buffer + s->buffered_bytes, p, width, n);
		s->crc = crc32c(s->crc, s->buffer + s->buffered_bytes, size);
		s->buffered_bytes += size;
		s->bytes_written += size;
		p += size;
		count -= n;
		int rc = BUFFER_SIZE - s->buffered_bytes < width ? flush_buffer(s, e) : 0;
		if (rc)
			return rc;
	}
	return 0;
}

int checked_file_write(struct checked_file *s, const void *bytes, size_t size, struct error *e)
{
	return checked_file_write_numbers(s, bytes, 1, size, e);
}

int checked_file_finish(struct checked_file *s, struct error *e)
{
	unsigned char crc[CRC_SIZE];
	put32(crc, s->crc);
	int rc = checked_file_write(s, crc, sizeof crc, e);
	if (!rc)
		rc = flush_buffer(s, e);
	if (!rc && disk_fsync(s->fd))
		rc = set_file_error(s, errno, e);
	if (!rc)
		disk_drop_cache(s->fd);
	if (disk_close(s->fd) && !rc)
		rc = set_file_error(s, errno, e);
	mem_free(s->buffer);
	s->buffer = NULL;
	return rc;
}

/* Reads the next bytes of the file into the buffer, which stays empty at the end of the file. */
static int refill_buffer(struct checked_file *s, struct error *e)
{
	ssize_t n;
	do
		n = disk_pread(s->fd, s->buffer, BUFFER_SIZE, (off_t)s->file_offset);
	while (n < 0 && errno == EINTR);
	s->buffer_offset = 0;
	s->buffered_bytes = n > 0 ? (size_t)n : 0;
	s->file_offset += s->buffered_bytes;
	if (n < 0)
		return set_file_error(s, errno, e);
	return s->progress ? s->progress(s->user, s->buffered_bytes, e) : 0;
}

static int read_bytes(struct checked_file *s, void *bytes, size_t size, struct error *e)
{
	for (unsigned char *p = bytes; size;) {
		int rc = s->buffer_offset == s->buffered_bytes ? refill_buffer(s, e) : 0;
		if (rc)
			return rc;
		size_t n = s->buffered_bytes - s->buffer_offset < size ? s->buffered_bytes - s->buffer_offset : size;
		if (n == 0)
			return error_set(e, EBADMSG, "%s: ends too early", s->path);
		memcpy(p, s->buffer + s->buffer_offset, n);
		s->buffer_offset += n;
		p += n;
		size -= n;
	}
	return 0;
}

/* Reads the whole file and compares the CRC at its end. Sets the number of bytes before the CRC. */
static int verify_crc(struct checked_file *s, struct error *e)
{
	struct stat st;
	unsigned char expected[CRC_SIZE];
	uint32_t crc = 0;
	if (disk_fstat(s->fd, &st))
		return set_file_error(s, errno, e);
	if ((uint64_t)st.st_size < sizeof expected)
		return error_set(e, EBADMSG, "%s: too short", s->path);
	s->remaining_bytes = (uint64_t)st.st_size - sizeof expected;
	for (uint64_t remaining = s->remaining_bytes; remaining;) {
		int rc = s->buffer_offset == s->buffered_bytes ? refill_buffer(s, e) : 0;
		size_t n = s->buffered_bytes - s->buffer_offset < remaining ? s->buffered_bytes - s->buffer_offset
									    : (size_t)remaining;
		if (rc || n == 0)
			return rc ? rc : error_set(e, EBADMSG, "%s: ends too early", s->path);
		crc = crc32c(crc, s->buffer + s->buffer_offset, n);
		s->buffer_offset += n;
		remaining -= n;
	}
	int rc = read_bytes(s, expected, sizeof expected, e);
	return rc ? rc : get32(expected) == crc ? 0 : error_set(e, EBADMSG, "%s: damaged", s->path);
}

int checked_file_open_with_progress(struct checked_file *s, const char *path, checked_file_progress *progress,
				    void *user, struct error *e)
{
	int rc = open_file(s, path, O_RDONLY, e);
	if (rc)
		return rc;
	s->progress = progress;
	s->user = user;
	rc = verify_crc(s, e);
	s->buffer_offset = s->buffered_bytes = s->file_offset = 0;
	if (rc)
		checked_file_close(s);
	return rc;
}

int checked_file_open(struct checked_file *s, const char *path, struct error *e)
{
	return checked_file_open_with_progress(s, path, NULL, NULL, e);
}

int checked_file_read(struct checked_file *s, void *bytes, size_t size, struct error *e)
{
	if (size > s->remaining_bytes)
		return error_set(e, EBADMSG, "%s: ends too early", s->path);
	s->remaining_bytes -= size;
	return read_bytes(s, bytes, size, e);
}

int checked_file_read_numbers(struct checked_file *s, void *numbers, size_t width, size_t count, struct error *e)
{
	int rc = count > SIZE_MAX / width ? error_set(e, EBADMSG, "%s: ends too early", s->path)
					  : checked_file_read(s, numbers, width * count, e);
	if (!rc)
		copy_numbers(numbers, numbers, width, count);
	return rc;
}

int checked_file_expect_end(const struct checked_file *s, struct error *e)
{
	return s->remaining_bytes ? error_set(e, EBADMSG, "%s: %llu bytes after its end", s->path,
					      (unsigned long long)s->remaining_bytes)
				  : 0;
}

void checked_file_close(struct checked_file *s)
{
	if (s->buffer)
		disk_close(s->fd);
	mem_free(s->buffer);
	s->buffer = NULL;
}
