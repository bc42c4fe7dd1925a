#include "coordinator/store/journal.h"

#include "common/base/buf.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/spool.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { PATH_MOST = 4200 };
/* Room is taken for several records at once: a file system that is writing back makes whoever asks for it wait. */
enum { AHEAD = 8, AHEAD_MOST = 1 << 28 };
/* More than that does not wait in memory, of all journals together: whoever appends writes, too, as fast as the disk takes it. */
enum { UNWRITTEN_MOST = 1 << 28 };
static _Atomic uint64_t unwritten_bytes;

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

struct unwritten {
	struct unwritten *next;
	struct record record;
	struct buf a, b; /* its body */
};

struct journal {
	int fd;
	uint64_t generation;
	atomic_uint holders;
	pthread_mutex_t writer; /* held while the file is written or cut; taken before `list` */
	pthread_mutex_t list;   /* held for a moment only: of the next three */
	struct unwritten *first, **last;
	uint64_t waiting;                /* their bytes; what the file will have is written + waiting */
	_Atomic uint64_t written, synced; /* in the file */
	_Atomic uint64_t room;            /* the disk has it, up to this byte of the file */
	_Atomic uint64_t record;          /* the size of one, as room was asked for last */
	atomic_bool bad;                  /* a call on the file failed: it is not written any more, nor believed */
	atomic_bool settled;              /* all of it is stored elsewhere */
	atomic_uint flushes;              /* under way */
	char path[PATH_MOST];
};

/* Its digits grow with every change of what a record is, the bodies included (the next ones, and batches as common/wire packs them). */
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
	j->last = &j->first;
	pthread_mutex_init(&j->writer, NULL);
	pthread_mutex_init(&j->list, NULL);
	atomic_init(&j->holders, 1);
	snprintf(j->path, sizeof j->path, "%s/journal.%llu", folder, (unsigned long long)generation);
	j->fd = disk_open(j->path, flags | O_CLOEXEC, 0600);
	return j;
}

void journal_hold(struct journal *j)
{
	atomic_fetch_add(&j->holders, 1);
}

/* ---- what waits to be written ---- */

static struct unwritten *front(struct journal *j)
{
	pthread_mutex_lock(&j->list);
	struct unwritten *n = j->first;
	pthread_mutex_unlock(&j->list);
	return n;
}

static uint64_t size_of(const struct record *r)
{
	return sizeof *r + r->size;
}

static void pop(struct journal *j)
{
	pthread_mutex_lock(&j->list);
	struct unwritten *n = j->first;
	j->first = n->next;
	if (!j->first)
		j->last = &j->first;
	j->waiting -= size_of(&n->record);
	j->written += size_of(&n->record);
	pthread_mutex_unlock(&j->list);
	unwritten_bytes -= size_of(&n->record);
	buf_fini(&n->a);
	buf_fini(&n->b);
	mem_free(n);
}

static void drop_all(struct journal *j)
{
	while (j->first)
		pop(j);
}

static int write_parts(int fd, off_t at, struct iovec *part, int count)
{
	while (count) {
		ssize_t n = disk_pwritev(fd, part, count, at);
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

static int write_one(int fd, uint64_t at, struct unwritten *n)
{
	struct record *r = &n->record;
	r->check = check_record(r, n->a.bytes, n->a.size, n->b.bytes, n->b.size);
	struct iovec parts[3] = {{r, sizeof *r}, {n->a.bytes, n->a.size}, {n->b.bytes, n->b.size}};
	return write_parts(fd, (off_t)at, parts, 3);
}

/* Gives back what nothing was written to; the writer's lock is held. */
static int cut_off(struct journal *j)
{
	j->room = 0;
	return disk_ftruncate(j->fd, (off_t)j->written);
}

uint64_t journal_bytes(struct journal *j)
{
	pthread_mutex_lock(&j->list);
	uint64_t bytes = j->written + j->waiting;
	pthread_mutex_unlock(&j->list);
	return bytes;
}

/* All that waited when this began, and no more: on a slow disk more would come for ever, and nobody hear that the first is stored. */
static int write_waiting(struct journal *j)
{
	int rc = 0;
	pthread_mutex_lock(&j->writer);
	uint64_t end = journal_bytes(j);
	while (!rc && !j->bad && j->written < end) {
		struct unwritten *n = front(j);
		rc = write_one(j->fd, j->written, n);
		if (!rc) {
			pop(j);
			continue;
		}
		int cut = cut_off(j); /* a torn record that could not be cut off would be cut off by whoever reads it */
		(void)cut;
		j->bad = true;
	}
	pthread_mutex_unlock(&j->writer);
	return rc;
}

void journal_release(struct journal *j)
{
	if (!j || atomic_fetch_sub(&j->holders, 1) > 1)
		return;
	if (j->fd >= 0 && !j->bad) {
		int rc = j->settled ? 0 : write_waiting(j); /* nobody was told that it is stored */
		if (!rc && j->room > j->written)
			rc = cut_off(j); /* else it goes with the file */
		(void)rc;
	}
	drop_all(j);
	if (j->fd >= 0)
		disk_close(j->fd);
	pthread_mutex_destroy(&j->list);
	pthread_mutex_destroy(&j->writer);
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
	j->written = j->synced = sizeof h;
	*out = j;
	return 0;
}

/* ---- reading ---- */

/* -ENODATA: the file ends before that. What cannot be read is not what is not there. */
static int read_at(int fd, void *bytes, size_t size, uint64_t at)
{
	unsigned char *p = bytes;
	while (size) {
		ssize_t n = disk_pread(fd, p, size, (off_t)at);
		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return n < 0 ? -errno : -ENODATA;
		p += n;
		at += (uint64_t)n;
		size -= (size_t)n;
	}
	return 0;
}

static bool head_fits(const struct head *h, uint64_t job, uint64_t generation)
{
	return memcmp(h->magic, magic, sizeof magic) == 0 && h->check == check_head(h) && h->job == job && h->generation == generation;
}

/* The record at `at` of a file with so many bytes; its body is mem_alloc'd. -ENODATA: it is not whole. */
static int read_record(const struct journal *j, uint64_t at, uint64_t end, struct record *r, unsigned char **body, struct error *e)
{
	int rc = end - at < sizeof *r ? -ENODATA : read_at(j->fd, r, sizeof *r, at);
	if (!rc && r->size > end - at - sizeof *r)
		rc = -ENODATA;
	if (!rc && !(*body = mem_alloc(r->size, 1)))
		return error_set(e, ENOMEM, "no memory for a record of %u bytes", r->size);
	if (!rc) {
		rc = read_at(j->fd, *body, r->size, at + sizeof *r);
		if (!rc && r->check != check_record(r, *body, r->size, NULL, 0))
			rc = -ENODATA;
		if (rc)
			mem_free(*body);
	}
	return rc && rc != -ENODATA ? fault(j, -rc, e) : rc;
}

/* The record at j->written, and beyond it. 1, -ENODATA, or what the visitor says. */
static int visit_next(struct journal *j, uint64_t end, journal_visit *visit, void *user, struct error *e)
{
	struct record r;
	unsigned char *body;
	int rc = read_record(j, j->written, end, &r, &body, e);
	if (rc)
		return rc;
	rc = visit(user, (enum journal_kind)r.kind, r.elapsed, body, r.size, e);
	j->written += sizeof r + r.size;
	mem_free(body);
	return rc ? rc : 1;
}

static int read_all(struct journal *j, uint64_t job, journal_visit *visit, void *user, uint64_t *cut, struct error *e)
{
	struct stat st;
	struct head h;
	if (disk_fstat(j->fd, &st))
		return fault(j, errno, e);
	uint64_t end = (uint64_t)st.st_size;
	int rc = read_at(j->fd, &h, sizeof h, 0);
	if (rc && rc != -ENODATA)
		return fault(j, -rc, e);
	if (!rc && (rc = spool_check_version(h.magic, magic, j->path, e)) == -EPROTO)
		return rc;
	if (rc || !head_fits(&h, job, j->generation))
		return error_set(e, EBADMSG, "%s: not the journal of j%llu", j->path, (unsigned long long)job);
	j->written = sizeof h;
	do
		rc = visit_next(j, end, visit, user, e);
	while (rc > 0);
	if (rc != -ENODATA)
		return rc;
	*cut = end - j->written;
	if (*cut && disk_ftruncate(j->fd, (off_t)j->written))
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
	atomic_store(&j->synced, atomic_load(&j->written));
	*out = j;
	return 0;
}

/* ---- appending ---- */

static bool reserve(struct journal *j, uint64_t from, uint64_t size)
{
	if (disk_fallocate(j->fd, FALLOC_FL_KEEP_SIZE, (off_t)from, (off_t)size))
		return false;
	j->room = from + size;
	return true;
}

static int room_for(struct journal *j, uint64_t size, struct error *e)
{
	uint64_t end = journal_bytes(j);
	if (j->bad)
		return fault(j, EIO, e);
	if (end + size <= j->room || (AHEAD * size <= AHEAD_MOST && reserve(j, end, AHEAD * size)) || reserve(j, end, size) || errno == EOPNOTSUPP || errno == ENOSYS)
		return 0;
	int code = errno;
	pthread_mutex_lock(&j->writer);
	int cut = cut_off(j);
	bool kept = j->written == end || reserve(j, j->written, end - j->written); /* what waits was promised its room */
	pthread_mutex_unlock(&j->writer);
	(void)cut;
	(void)kept;
	return fault(j, code, e);
}

int journal_reserve(struct journal *j, size_t body, struct error *e)
{
	j->record = sizeof(struct record) + body;
	return room_for(j, j->record, e);
}

/* Before it runs out, by whoever flushes. */
static void reserve_ahead(struct journal *j)
{
	uint64_t size = j->record, end = journal_bytes(j);
	if (size && AHEAD * size <= AHEAD_MOST && end + AHEAD / 2 * size > j->room)
		reserve(j, end, AHEAD * size);
}

int journal_append(struct journal *j, enum journal_kind kind, double elapsed, const void *a, size_t a_size, struct buf *b,
		   struct error *e)
{
	size_t b_size = b ? b->size : 0;
	if (a_size > UINT32_MAX || b_size > UINT32_MAX - a_size)
		return error_set(e, EFBIG, "%s: a record of %zu bytes", j->path, a_size + b_size);
	if (kind != JOURNAL_BATCH && kind != JOURNAL_PINNED && !j->bad) { /* it may stay away, but must not make the journal bad */
		int rc = room_for(j, sizeof(struct record) + a_size + b_size, e);
		if (rc)
			return rc;
	}
	struct unwritten *n = mem_alloc(1, sizeof *n);
	if (n)
		*n = (struct unwritten){.record = {.size = (uint32_t)(a_size + b_size), .kind = kind, .elapsed = elapsed}, .a.limit = a_size};
	if (!n || !buf_append(&n->a, a, a_size)) {
		mem_free(n);
		return error_set(e, ENOMEM, "no memory for a record of %zu bytes", a_size + b_size);
	}
	if (b) {
		n->b = *b;
		memset(b, 0, sizeof *b);
	}
	uint64_t size = size_of(&n->record), bytes = atomic_fetch_add(&unwritten_bytes, size) + size;
	pthread_mutex_lock(&j->list);
	*j->last = n;
	j->last = &n->next;
	j->waiting += size;
	pthread_mutex_unlock(&j->list);
	if (bytes > UNWRITTEN_MOST && !j->bad)
		write_waiting(j); /* a journal that has become bad says so */
	return 0;
}

bool journal_is_bad(const struct journal *j)
{
	return j->bad;
}

void journal_settle(struct journal *j)
{
	j->settled = true;
}

/* All records of the file as they are read, each checked again, and those that wait, into another file. */
static int copy_records(struct journal *j, int to, struct error *e)
{
	struct record r;
	unsigned char *body;
	uint64_t at = sizeof(struct head);
	int rc = 0;
	for (; !rc && at < j->written; at += size_of(&r)) {
		rc = read_record(j, at, j->written, &r, &body, e);
		if (rc)
			return rc == -ENODATA ? fault(j, EIO, e) : rc;
		if ((rc = disk_write_all(to, &r, sizeof r)) || (rc = disk_write_all(to, body, r.size)))
			rc = fault(j, -rc, e);
		mem_free(body);
	}
	for (struct unwritten *n = j->first; !rc && n; at += size_of(&n->record), n = n->next)
		if ((rc = write_one(to, at, n)))
			rc = fault(j, -rc, e);
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
	if (read_at(j->fd, &h, sizeof h, 0) || !head_fits(&h, h.job, j->generation))
		return fault(j, EIO, e);
	int fd = disk_open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int rc = fd < 0 ? fault(j, errno, e) : disk_write_all(fd, &h, sizeof h) ? fault(j, errno ? errno : ENOSPC, e) : copy_records(j, fd, e);
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
	drop_all(j);
	j->synced = j->written;
	j->room = 0;
	j->bad = false;
	return 0;
}

uint64_t journal_generation(const struct journal *j)
{
	return j->generation;
}

int journal_write(struct journal *j, struct error *e)
{
	int rc = j->settled ? 0 : j->bad ? -EIO : write_waiting(j);
	return rc ? fault(j, -rc, e) : 0;
}

int journal_sync(struct journal *j, struct error *e)
{
	if (j->settled)
		return 0;
	atomic_fetch_add(&j->flushes, 1); /* before it is asked whether it is bad: a bad one may be renewed at any time */
	int rc = j->bad ? -EIO : write_waiting(j);
	uint64_t written = j->written;
	if (!rc && j->bad) {
		rc = -EIO;
	} else if (!rc && written != j->synced) {
		if (disk_fdatasync(j->fd)) {
			rc = -errno;
			j->bad = true;
		} else {
			j->synced = written;
			disk_forget(j->fd);
			reserve_ahead(j);
		}
	}
	atomic_fetch_sub(&j->flushes, 1);
	return rc && !j->settled ? fault(j, -rc, e) : 0;
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
