#include "coordinator/store/journal.h"

#include "common/base/buf.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { PATH_MOST = 4200 };
/* Room is taken for several records at once: a file system that is writing back makes whoever asks for it wait. */
enum { AHEAD = 8, AHEAD_MOST = 1 << 28 };

struct head { /* of the file */
	char magic[8];
	uint64_t job, generation;
	uint32_t check, nothing;
};

struct record { /* before its body */
	uint32_t size, check; /* of the body; over all but itself */
	uint32_t kind, nothing;
	double elapsed;
};

struct journal {
	int fd;
	uint64_t generation;
	atomic_uint holders;
	_Atomic uint64_t bytes, synced; /* in the file */
	uint64_t room;                  /* the disk has it, up to this byte of the file */
	atomic_bool bad;                /* a call on the file failed: it is not written any more, nor believed */
	atomic_bool settled;            /* all of it is stored elsewhere */
	atomic_uint flushes;            /* under way */
	struct buf tail;                /* what was appended since it is bad */
	char path[PATH_MOST];
};

static const char magic[8] = "hsltJ001";

static uint32_t check_head(const struct head *h)
{
	return crc32c(0, h, offsetof(struct head, check));
}

static uint32_t check_record(const struct record *r, const void *a, size_t a_size, const void *b, size_t b_size)
{
	uint32_t c = crc32c(0, &r->size, sizeof r->size);
	c = crc32c(c, &r->kind, sizeof *r - offsetof(struct record, kind));
	c = crc32c(c, a, a_size);
	return crc32c(c, b, b_size);
}

static int fault(const struct journal *j, int code, struct error *e)
{
	return error_set(e, code, "%s: %s", j->path, strerror(code));
}

static struct journal *make(const char *folder, uint64_t generation, int flags, struct error *e)
{
	struct journal *j = mem_alloc(1, sizeof *j);
	if (!j) {
		error_set(e, ENOMEM, "no memory for a journal");
		return NULL;
	}
	j->generation = generation;
	j->tail.limit = SIZE_MAX;
	atomic_init(&j->holders, 1);
	snprintf(j->path, sizeof j->path, "%s/journal.%llu", folder, (unsigned long long)generation);
	j->fd = disk_open(j->path, flags | O_CLOEXEC, 0600);
	return j;
}

void journal_hold(struct journal *j)
{
	atomic_fetch_add(&j->holders, 1);
}

/* Gives back what nothing was written to. */
static int cut_off(struct journal *j)
{
	j->room = 0;
	return disk_ftruncate(j->fd, (off_t)j->bytes);
}

void journal_release(struct journal *j)
{
	if (!j || atomic_fetch_sub(&j->holders, 1) > 1)
		return;
	if (j->fd >= 0 && j->room > j->bytes && !j->bad && !j->settled) {
		int cut = cut_off(j); /* else it goes with the file */
		(void)cut;
	}
	if (j->fd >= 0)
		disk_close(j->fd);
	buf_fini(&j->tail);
	mem_free(j);
}

int journal_create(struct journal **out, const char *folder, uint64_t job, uint64_t generation, struct error *e)
{
	struct journal *j = make(folder, generation, O_RDWR | O_CREAT | O_TRUNC, e);
	if (!j)
		return -ENOMEM;
	struct head h = {.job = job, .generation = generation};
	memcpy(h.magic, magic, sizeof h.magic);
	h.check = check_head(&h);
	int rc = 0;
	if (j->fd < 0)
		rc = fault(j, errno, e);
	else if (disk_write_all(j->fd, &h, sizeof h) || disk_fsync(j->fd))
		rc = fault(j, errno ? errno : ENOSPC, e);
	if (!rc)
		rc = disk_sync_folder(folder, e);
	if (rc) {
		journal_release(j);
		return rc;
	}
	j->bytes = j->synced = sizeof h;
	*out = j;
	return 0;
}

/* ---- reading ---- */

static bool read_at(int fd, void *bytes, size_t size, uint64_t at)
{
	unsigned char *p = bytes;
	while (size) {
		ssize_t n = disk_pread(fd, p, size, (off_t)at);
		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return false;
		p += n;
		at += (uint64_t)n;
		size -= (size_t)n;
	}
	return true;
}

static bool head_fits(const struct head *h, uint64_t job, uint64_t generation)
{
	return memcmp(h->magic, magic, sizeof magic) == 0 && h->check == check_head(h) && h->job == job && h->generation == generation;
}

/* The record at j->bytes, and beyond it. 0: it is not whole; else what the visitor says, or 1. */
static int visit_next(struct journal *j, uint64_t end, journal_visit *visit, void *user, struct error *e)
{
	struct record r;
	if (end - j->bytes < sizeof r || !read_at(j->fd, &r, sizeof r, j->bytes) || r.size > end - j->bytes - sizeof r)
		return 0;
	unsigned char *body = mem_alloc(r.size, 1);
	if (!body)
		return error_set(e, ENOMEM, "no memory for a record of %u bytes", r.size);
	int rc = 0;
	if (read_at(j->fd, body, r.size, j->bytes + sizeof r) && r.check == check_record(&r, body, r.size, NULL, 0)) {
		rc = visit(user, (enum journal_kind)r.kind, r.elapsed, body, r.size, e);
		rc = rc ? rc : 1;
		j->bytes += sizeof r + r.size;
	}
	mem_free(body);
	return rc;
}

static int read_all(struct journal *j, uint64_t job, journal_visit *visit, void *user, uint64_t *cut, struct error *e)
{
	struct stat st;
	struct head h;
	if (disk_fstat(j->fd, &st))
		return fault(j, errno, e);
	uint64_t end = (uint64_t)st.st_size;
	if (!read_at(j->fd, &h, sizeof h, 0) || !head_fits(&h, job, j->generation))
		return error_set(e, EBADMSG, "%s: not the journal of j%llu", j->path, (unsigned long long)job);
	j->bytes = sizeof h;
	int rc;
	do
		rc = visit_next(j, end, visit, user, e);
	while (rc > 0);
	*cut = end - j->bytes;
	if (rc < 0)
		return rc;
	if (*cut && disk_ftruncate(j->fd, (off_t)j->bytes))
		return fault(j, errno, e);
	return disk_fsync(j->fd) ? fault(j, errno, e) : 0;
}

int journal_open(struct journal **out, const char *folder, uint64_t job, uint64_t generation, journal_visit *visit, void *user,
		 uint64_t *cut, struct error *e)
{
	*cut = 0;
	struct journal *j = make(folder, generation, O_RDWR, e);
	if (!j)
		return -ENOMEM;
	int rc = j->fd < 0 ? fault(j, errno, e) : read_all(j, job, visit, user, cut, e);
	if (rc) {
		journal_release(j);
		return rc;
	}
	atomic_store(&j->synced, atomic_load(&j->bytes));
	*out = j;
	return 0;
}

/* ---- writing ---- */

static bool reserve(struct journal *j, uint64_t size)
{
	if (disk_fallocate(j->fd, FALLOC_FL_KEEP_SIZE, (off_t)j->bytes, (off_t)size))
		return false;
	j->room = j->bytes + size;
	return true;
}

int journal_reserve(struct journal *j, size_t body, struct error *e)
{
	uint64_t size = sizeof(struct record) + body;
	if (j->bad)
		return fault(j, EIO, e);
	if (j->bytes + size <= j->room || (AHEAD * size <= AHEAD_MOST && reserve(j, AHEAD * size)) || reserve(j, size) || errno == EOPNOTSUPP || errno == ENOSYS)
		return 0;
	int code = errno;
	int cut = cut_off(j);
	(void)cut;
	return fault(j, code, e);
}

static int write_parts(struct journal *j, struct iovec *part, int count)
{
	off_t at = (off_t)j->bytes;
	while (count) {
		ssize_t n = disk_pwritev(j->fd, part, count, at);
		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return n < 0 ? -errno : -ENOSPC;
		at += n;
		for (; count && (size_t)n >= part->iov_len; part++, count--)
			n -= (ssize_t)part->iov_len;
		if (count) {
			part->iov_base = (char *)part->iov_base + n;
			part->iov_len -= (size_t)n;
		}
	}
	return 0;
}

/* struct iovec is for reading too, so that its pointer is not to const. */
static struct iovec part_of(const void *bytes, size_t size)
{
	struct iovec v = {.iov_len = size};
	memcpy(&v.iov_base, &bytes, sizeof bytes);
	return v;
}

int journal_append(struct journal *j, enum journal_kind kind, double elapsed, const void *a, size_t a_size, const void *b,
		   size_t b_size, struct error *e)
{
	size_t size = a_size + b_size;
	if (size > UINT32_MAX)
		return error_set(e, EFBIG, "%s: a record of %zu bytes", j->path, size);
	struct record r = {.size = (uint32_t)size, .kind = kind, .elapsed = elapsed};
	r.check = check_record(&r, a, a_size, b, b_size);
	struct iovec parts[3] = {part_of(&r, sizeof r), part_of(a, a_size), part_of(b, b_size)};
	size_t before = j->tail.size;
	int rc = j->bad ? -EIO : write_parts(j, parts, 3);
	if (!rc) {
		j->bytes += sizeof r + size;
		return 0;
	}
	if (!j->bad) { /* a torn record that could not be cut off would be cut off by whoever reads it */
		int cut = cut_off(j);
		if (!cut && rc == -ENOSPC && kind != JOURNAL_BATCH && kind != JOURNAL_PINNED)
			return fault(j, -rc, e);
		j->bad = true;
	}
	if (buf_append(&j->tail, &r, sizeof r) && buf_append(&j->tail, a, a_size) && buf_append(&j->tail, b, b_size))
		return 0;
	j->tail.size = before;
	return error_set(e, ENOMEM, "no memory for a record of %zu bytes", size);
}

bool journal_is_bad(const struct journal *j)
{
	return j->bad;
}

void journal_settle(struct journal *j)
{
	j->settled = true;
}

/* All whole records as they are read, each checked again, into another file. */
static int copy_records(struct journal *j, int to, struct error *e)
{
	struct record r;
	uint64_t at = sizeof(struct head);
	int rc = 0;
	for (; !rc && at < j->bytes; at += sizeof r + r.size) {
		if (!read_at(j->fd, &r, sizeof r, at) || r.size > j->bytes - at - sizeof r)
			return fault(j, EIO, e);
		unsigned char *body = mem_alloc(r.size, 1);
		if (!body)
			return error_set(e, ENOMEM, "no memory for a record of %u bytes", r.size);
		if (!read_at(j->fd, body, r.size, at + sizeof r) || r.check != check_record(&r, body, r.size, NULL, 0))
			rc = fault(j, EIO, e);
		if (!rc && ((rc = disk_write_all(to, &r, sizeof r)) || (rc = disk_write_all(to, body, r.size))))
			rc = fault(j, -rc, e);
		mem_free(body);
	}
	return rc;
}

int journal_renew(struct journal *j, struct error *e)
{
	char path[PATH_MOST + 8], folder[PATH_MOST];
	struct head h;
	snprintf(path, sizeof path, "%s.new", j->path);
	snprintf(folder, sizeof folder, "%s", j->path);
	*strrchr(folder, '/') = 0;
	if (j->flushes)
		return error_set(e, EAGAIN, "%s: is being flushed", j->path);
	if (!read_at(j->fd, &h, sizeof h, 0) || !head_fits(&h, h.job, j->generation))
		return fault(j, EIO, e);
	int fd = disk_open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int rc = fd < 0 ? fault(j, errno, e) : disk_write_all(fd, &h, sizeof h) ? fault(j, errno ? errno : ENOSPC, e) : copy_records(j, fd, e);
	if (!rc && disk_write_all(fd, j->tail.bytes, j->tail.size))
		rc = fault(j, errno ? errno : ENOSPC, e);
	if (!rc && (disk_fsync(fd) || disk_rename(path, j->path)))
		rc = fault(j, errno, e);
	if (!rc)
		rc = disk_sync_folder(folder, e);
	if (rc) { /* with its name or without it: it holds all that was acknowledged */
		if (fd >= 0)
			disk_close(fd);
		disk_unlink(path);
		return rc;
	}
	disk_close(j->fd);
	j->fd = fd;
	j->bytes += j->tail.size;
	j->synced = j->bytes;
	j->tail.size = 0;
	j->bad = false;
	return 0;
}

uint64_t journal_bytes(const struct journal *j)
{
	return j->bytes + j->tail.size;
}

uint64_t journal_generation(const struct journal *j)
{
	return j->generation;
}

int journal_sync(struct journal *j, struct error *e)
{
	int rc = 0;
	if (j->settled)
		return 0;
	atomic_fetch_add(&j->flushes, 1); /* before it is asked whether it is bad: a bad one may be renewed at any time */
	uint64_t bytes = j->bytes;
	if (j->bad) {
		rc = fault(j, EIO, e);
	} else if (bytes != j->synced && disk_fdatasync(j->fd)) {
		rc = fault(j, errno, e);
		j->bad = true;
	} else {
		j->synced = bytes;
		disk_forget(j->fd);
	}
	atomic_fetch_sub(&j->flushes, 1);
	return rc;
}

void journal_clear(const char *folder, uint64_t keep)
{
	char path[PATH_MOST];
	DIR *d = disk_opendir(folder);
	for (struct dirent *f; d && (f = readdir(d));) {
		unsigned long long generation;
		char again[64];
		if (sscanf(f->d_name, "journal.%llu", &generation) != 1 || generation == keep)
			continue;
		snprintf(again, sizeof again, "journal.%llu", generation);
		size_t n = strlen(again);
		if (strncmp(again, f->d_name, n) != 0 || (f->d_name[n] && strcmp(f->d_name + n, ".new") != 0))
			continue;
		snprintf(path, sizeof path, "%s/%s", folder, f->d_name);
		disk_unlink(path);
	}
	if (d)
		closedir(d);
}
