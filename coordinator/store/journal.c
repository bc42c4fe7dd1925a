/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's journal: appending, flushing, and starting a new file when the old one has failed.
 *
 * journal_append puts a record into a queue in memory; journal_sync writes and flushes the queue, and may run in the
 * thread pool while other threads append. Disk space is reserved ahead, so that a full disk is noticed before a
 * result is merged. journal_open reads a file from its head on, gives each record to a visitor and cuts off an
 * incomplete record at the end.
 *
 * After a failed write or flush the file is bad and not touched again; journal_renew copies the durable and the
 * queued records into a new file. Records damaged in the middle are counted and skipped. A full disk is -ENOSPC.
 */
#include "coordinator/store/journal.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/journal_file.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { PATH_MOST = 4200 };
/* Space is reserved for several records at once, because a file system that is writing back delays each reservation. */
enum { AHEAD = 8, AHEAD_MOST = 1 << 28 };
/* Limit on the queued bytes of all journals together. Beyond it journal_append also writes, so it runs at the speed
 * of the disk. */
enum { UNWRITTEN_MOST = 1 << 28 };
static _Atomic uint64_t unwritten_bytes;

struct unwritten {
	struct unwritten *next;
	struct journal_record record;
	struct buf a, b; /* the body of the record is a followed by b */
};

struct journal {
	int fd;
	uint64_t job, generation, salt;
	atomic_uint holders;
	pthread_mutex_t writer; /* held while the file is written or truncated; taken before `list` */
	pthread_mutex_t list;	/* held briefly; protects the queue: first, last, waiting, number */
	struct unwritten *first, **last;
	uint64_t waiting; /* bytes in the queue; with `written`, the size of the file once the queue is empty */
	uint64_t number;  /* number of the next record */
	uint64_t damaged; /* records of the file that were damaged when it was read */
	_Atomic uint64_t in_file, stored; /* in_file: records written to the file; stored: records that are durable */
	_Atomic uint64_t written, synced; /* bytes of the file that are written, and that are flushed */
	_Atomic uint64_t room;		  /* space is reserved up to this offset */
	_Atomic uint64_t record;	  /* bytes of the record last reserved */
	/* 0, or the errno of the operation on the file that failed: the file is neither written nor trusted any more.
	 */
	atomic_int bad;
	atomic_bool settled; /* all its records are also stored elsewhere */
	atomic_uint flushes; /* number of running flushes, during which the journal must not be renewed */
	char path[PATH_MOST];
};

static int fault(const struct journal *j, int code, struct error *e)
{
	return error_set(e, code, "%s: %s", j->path, strerror(code));
}

static struct journal *make_journal(const char *folder, uint64_t job, uint64_t generation, int flags, struct error *e)
{
	struct journal *j = mem_alloc(1, sizeof *j);
	if (!j) {
		error_set(e, ENOMEM, "no memory for a journal");
		return NULL;
	}
	j->job = job;
	j->generation = generation;
	j->last = &j->first;
	pthread_mutex_init(&j->writer, NULL);
	pthread_mutex_init(&j->list, NULL);
	atomic_init(&j->holders, 1);
	snprintf(j->path, sizeof j->path, "%s/journal.%llu", folder, (unsigned long long)generation);
	j->fd = disk_open(j->path, flags | O_CLOEXEC, 0600);
	return j;
}

static void pack_head(const struct journal *j, unsigned char bytes[JOURNAL_HEAD])
{
	journal_head_pack(&(struct journal_head){j->job, j->generation, j->salt}, bytes);
}

void journal_hold(struct journal *j)
{
	atomic_fetch_add(&j->holders, 1);
}

static struct unwritten *first_unwritten(struct journal *j)
{
	pthread_mutex_lock(&j->list);
	struct unwritten *n = j->first;
	pthread_mutex_unlock(&j->list);
	return n;
}

static uint64_t size_of(const struct journal_record *r)
{
	return JOURNAL_RECORD + r->size;
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
	j->in_file = n->record.number + 1;
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

static int write_one(const struct journal *j, int fd, uint64_t at, struct unwritten *n)
{
	unsigned char head[JOURNAL_RECORD];
	n->record.stored = j->stored;
	journal_record_pack(&n->record, head, &n->a, &n->b);
	struct iovec parts[3] = {{head, sizeof head}, {n->a.bytes, n->a.size}, {n->b.bytes, n->b.size}};
	return write_parts(fd, (off_t)at, parts, 3);
}

/* Frees reserved space that was not used. The caller holds `writer`. */
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

/* Writes the records that were in the queue at the start, and no more: on a slow disk the queue might never become
 * empty, and the first record would never be acknowledged. */
static int write_waiting(struct journal *j)
{
	int rc = 0;
	pthread_mutex_lock(&j->writer);
	uint64_t end = journal_bytes(j);
	while (!rc && !j->bad && j->written < end) {
		struct unwritten *n = first_unwritten(j);
		rc = write_one(j, j->fd, j->written, n);
		if (!rc) {
			pop(j);
			continue;
		}
		/* A torn record that is left there would be cut off by the next reader, together with everything
		 * behind it. */
		int cut = cut_off(j);
		(void)cut;
		j->bad = -rc;
	}
	pthread_mutex_unlock(&j->writer);
	return rc;
}

void journal_release(struct journal *j)
{
	if (!j || atomic_fetch_sub(&j->holders, 1) > 1)
		return;
	if (j->fd >= 0 && !j->bad) {
		/* Without a flush these records were never acknowledged, so an error is of no consequence. */
		int rc = j->settled ? 0 : write_waiting(j);
		if (!rc && j->room > j->written)
			rc = cut_off(j); /* if this fails, the space is freed when the file is deleted */
		(void)rc;
	}
	drop_all(j);
	if (j->fd >= 0)
		disk_close(j->fd);
	pthread_mutex_destroy(&j->list);
	pthread_mutex_destroy(&j->writer);
	mem_free(j);
}

static int write_head(int fd, const unsigned char head[JOURNAL_HEAD])
{
	int rc = disk_write_all(fd, head, JOURNAL_HEAD);
	return rc ? rc : disk_fsync(fd) ? -errno : 0;
}

int journal_create(struct journal **out, const char *folder, uint64_t job, uint64_t generation, struct error *e)
{
	struct journal *j = make_journal(folder, job, generation, O_RDWR | O_CREAT | O_TRUNC, e);
	if (!j)
		return -ENOMEM;
	unsigned char head[JOURNAL_HEAD];
	int rc = 0;
	if (getentropy(&j->salt, sizeof j->salt))
		rc = fault(j, errno, e);
	pack_head(j, head);
	if (!rc && j->fd < 0)
		rc = fault(j, errno, e);
	else if (!rc && (rc = write_head(j->fd, head)))
		rc = fault(j, -rc, e);
	if (!rc)
		rc = disk_sync_folder(folder, e);
	if (rc) {
		journal_release(j);
		return rc;
	}
	j->written = j->synced = sizeof head;
	*out = j;
	return 0;
}

static int visit_piece(struct journal *j, const struct journal_piece *p, journal_visit *visit, void *user,
		       struct error *e)
{
	struct journal_item item = {.journal = j, .at = p->from, .missing = p->what == JOURNAL_WHOLE ? 0 : p->count};
	if (p->what != JOURNAL_UNKNOWN) {
		item.kind = (enum journal_kind)p->record.kind;
		item.elapsed = p->record.elapsed;
		item.lease = p->record.lease;
		item.lease.job = j->job;
		item.body = p->body;
		item.size = p->record.size;
	}
	j->written = p->to; /* journal_body can read up to here */
	return visit(user, &item, e);
}

static int read_records(struct journal *j, uint64_t end, struct journal_gaps *gaps, journal_visit *visit, void *user,
			struct journal_found *found, struct error *e)
{
	struct journal_scan s;
	struct journal_piece p;
	int rc;
	journal_scan_begin(&s, j->fd, end, j->salt);
	while ((rc = journal_scan_next(&s, &p)) > 0) {
		if (p.what != JOURNAL_WHOLE && p.count)
			rc = journal_gaps_add(gaps, s.number - p.count, p.count, e);
		if (rc >= 0 && (p.what == JOURNAL_WHOLE || p.count))
			rc = visit_piece(j, &p, visit, user, e);
		if (p.what == JOURNAL_WHOLE)
			mem_free(p.body);
		if (rc < 0) {
			journal_scan_end(&s);
			return rc;
		}
	}
	if (rc < 0)
		fault(j, -rc, e);
	journal_gaps_count(gaps, s.stored, &found->damaged, &found->lost);
	found->cut = end - s.at;
	j->written = s.at;
	j->number = s.number;
	atomic_store(&j->in_file, s.number);
	atomic_store(&j->stored, s.number);
	j->damaged = found->damaged;
	journal_scan_end(&s);
	return rc;
}

/* Reads the head of the file. If the head is damaged, takes the salt from the first record instead and sets *anew, so
 * that the head is written again. */
static int read_file_head(struct journal *j, uint64_t end, bool *anew, struct error *e)
{
	unsigned char head[JOURNAL_HEAD];
	struct journal_head h;
	int rc = end < sizeof head ? -ENODATA : journal_read_at(j->fd, head, sizeof head, 0);
	if (rc && rc != -ENODATA)
		return fault(j, -rc, e);
	int damaged = rc ? rc : journal_head_unpack(head, &h, j->path, e);
	if (damaged == -EPROTO)
		return damaged;
	if (!damaged && h.job == j->job && h.generation == j->generation) {
		j->salt = h.salt;
		return 0;
	}
	rc = damaged ? journal_scan_salt(j->fd, end, &j->salt) : -EBADMSG;
	*anew = !rc;
	if (rc == -EBADMSG)
		return error_set(e, EBADMSG, "%s: not the journal of j%llu", j->path, (unsigned long long)j->job);
	return rc ? fault(j, -rc, e) : 0;
}

static int read_all(struct journal *j, journal_visit *visit, void *user, struct journal_found *found, struct error *e)
{
	struct stat st;
	unsigned char head[JOURNAL_HEAD];
	struct journal_gaps gaps = {NULL, 0};
	bool anew = false;
	if (disk_fstat(j->fd, &st))
		return fault(j, errno, e);
	int rc = read_file_head(j, (uint64_t)st.st_size, &anew, e);
	if (!rc)
		rc = read_records(j, (uint64_t)st.st_size, &gaps, visit, user, found, e);
	mem_free(gaps.first);
	if (rc)
		return rc;
	pack_head(j, head);
	struct iovec part = {head, sizeof head};
	if (anew && (rc = write_parts(j->fd, 0, &part, 1)))
		return fault(j, -rc, e);
	if (found->cut && disk_ftruncate(j->fd, (off_t)j->written))
		return fault(j, errno, e);
	return disk_fsync(j->fd) ? fault(j, errno, e) : 0;
}

int journal_open(struct journal **out, const char *folder, uint64_t job, uint64_t generation, journal_visit *visit,
		 void *user, struct journal_found *found, struct error *e)
{
	*found = (struct journal_found){0};
	struct journal *j = make_journal(folder, job, generation, O_RDWR, e);
	if (!j)
		return -ENOMEM;
	int rc = j->fd < 0 ? fault(j, errno, e) : 0;
	if (!rc) {
		disk_read_through(j->fd);
		rc = read_all(j, visit, user, found, e);
	}
	if (rc) {
		*found = (struct journal_found){0};
		journal_release(j);
		return rc;
	}
	atomic_store(&j->synced, atomic_load(&j->written));
	*out = j;
	return 0;
}

int journal_body(struct journal *j, uint64_t at, unsigned char **body, size_t *size, struct error *e)
{
	struct journal_record r;
	int rc = journal_read_record(j->fd, j->written, j->salt, at, &r, body);
	*size = r.size;
	if (rc < 0)
		return fault(j, -rc, e);
	return rc ? 0 : error_set(e, EBADMSG, "%s: a record has been damaged", j->path);
}

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
	if (j->bad) {
		fault(j, j->bad, e);
		return -EIO;
	}
	if (end + size <= j->room || (AHEAD * size <= AHEAD_MOST && reserve(j, end, AHEAD * size)) ||
	    reserve(j, end, size) || errno == EOPNOTSUPP || errno == ENOSYS)
		return 0;
	int code = errno;
	pthread_mutex_lock(&j->writer);
	int cut = cut_off(j);
	bool kept = j->written == end ||
		    reserve(j, j->written, end - j->written); /* queued records need the space they had reserved */
	pthread_mutex_unlock(&j->writer);
	(void)cut;
	(void)kept;
	return fault(j, code, e);
}

int journal_reserve(struct journal *j, size_t body, struct error *e)
{
	j->record = JOURNAL_RECORD + body;
	return room_for(j, j->record, e);
}

/* Reserves more space before the reserved space runs out; called by the thread that flushes. It holds `writer`,
 * because otherwise the new space might be cut off between its reservation and the change of `room`. */
static void reserve_ahead(struct journal *j)
{
	pthread_mutex_lock(&j->writer);
	uint64_t size = j->record, end = journal_bytes(j);
	if (size && !j->bad && AHEAD * size <= AHEAD_MOST && end + AHEAD / 2 * size > j->room)
		reserve(j, end, AHEAD * size);
	pthread_mutex_unlock(&j->writer);
}

static struct journal_record record_of(const struct journal *j, enum journal_kind kind, const struct lease_key *lease,
				       double elapsed, size_t size)
{
	return (struct journal_record){.size = (uint32_t)size,
				       .kind = kind,
				       .elapsed = elapsed,
				       .lease = lease ? *lease : (struct lease_key){0},
				       .salt = j->salt};
}

int journal_append(struct journal *j, enum journal_kind kind, const struct lease_key *lease, double elapsed,
		   const void *a, size_t a_size, struct buf *b, struct error *e)
{
	size_t b_size = b ? b->size : 0;
	if (a_size > UINT32_MAX || b_size > UINT32_MAX - a_size)
		return error_set(e, EFBIG, "%s: a record of %zu bytes", j->path, a_size + b_size);
	/* Records other than results and fingerprints are optional: without disk space they are refused here, since a
	 * failed write would make the journal bad. */
	if (kind != JOURNAL_BATCH && kind != JOURNAL_AGAIN && kind != JOURNAL_PINNED && !j->bad) {
		int rc = room_for(j, JOURNAL_RECORD + a_size + b_size, e);
		if (rc)
			return rc;
	}
	struct unwritten *n = mem_alloc(1, sizeof *n);
	if (n)
		*n = (struct unwritten){.record = record_of(j, kind, lease, elapsed, a_size + b_size),
					.a.limit = a_size};
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
	n->record.number = j->number++;
	*j->last = n;
	j->last = &n->next;
	j->waiting += size;
	pthread_mutex_unlock(&j->list);
	if (bytes > UNWRITTEN_MOST && !j->bad)
		write_waiting(j); /* an error makes the journal bad, and is reported by the next operation */
	return 0;
}

bool journal_is_bad(const struct journal *j)
{
	return j->bad;
}

bool journal_is_gone(const struct journal *j)
{
	struct stat ours, there;
	if (j->fd < 0 || disk_fstat(j->fd, &ours))
		return false;
	if (disk_stat(j->path, &there))
		return errno == ENOENT || errno == ENOTDIR;
	return ours.st_ino != there.st_ino || ours.st_dev != there.st_dev;
}

void journal_distrust(struct journal *j)
{
	j->bad = ENOENT;
}

void journal_settle(struct journal *j)
{
	j->settled = true;
}

static int copy_bytes(struct journal *j, int to, uint64_t from, uint64_t end, struct error *e)
{
	unsigned char bytes[4096];
	while (from < end) {
		size_t n = end - from < sizeof bytes ? (size_t)(end - from) : sizeof bytes;
		int rc = journal_read_at(j->fd, bytes, n, from);
		if (!rc)
			rc = disk_write_all(to, bytes, n);
		if (rc)
			return fault(j, -rc, e);
		from += n;
	}
	return 0;
}

/* Copies all records of the file to the same offsets in another file, checking each one again, and appends the queued
 * records. Damaged records are copied as they are, so that it stays known what is missing. */
static int copy_records(struct journal *j, int to, struct error *e)
{
	struct journal_scan s;
	struct journal_piece p;
	uint64_t damaged = 0;
	int rc;
	journal_scan_begin(&s, j->fd, j->written, j->salt);
	while ((rc = journal_scan_next(&s, &p)) > 0) {
		damaged += p.what == JOURNAL_WHOLE ? 0 : p.count;
		if (p.what == JOURNAL_WHOLE)
			mem_free(p.body);
		int failed = copy_bytes(j, to, p.from, p.to, e);
		if (failed) {
			journal_scan_end(&s);
			return failed;
		}
	}
	uint64_t at = s.at;
	journal_scan_end(&s);
	if (rc || damaged != j->damaged || at != j->written)
		return fault(j, rc ? -rc : EIO, e);
	for (struct unwritten *n = j->first; !rc && n; at += size_of(&n->record), n = n->next)
		if ((rc = write_one(j, to, at, n)))
			rc = fault(j, -rc, e);
	return rc;
}

int journal_renew(struct journal *j, struct error *e)
{
	char path[PATH_MOST + 8], folder[PATH_MOST];
	unsigned char head[JOURNAL_HEAD];
	snprintf(path, sizeof path, "%s.new", j->path);
	snprintf(folder, sizeof folder, "%s", j->path);
	*strrchr(folder, '/') = 0;
	if (j->flushes)
		return error_set(e, EAGAIN, "%s: is being flushed", j->path);
	pack_head(j, head);
	int fd = disk_open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int rc = fd < 0 ? -errno : disk_write_all(fd, head, sizeof head);
	rc = rc ? fault(j, -rc, e) : copy_records(j, fd, e);
	if (!rc && (disk_fsync(fd) || disk_rename(path, j->path)))
		rc = fault(j, errno, e);
	if (!rc)
		rc = disk_sync_folder(folder, e);
	if (rc) { /* even if the rename cannot be undone, the new file contains everything acknowledged */
		if (fd >= 0)
			disk_close(fd);
		disk_unlink(path);
		return rc;
	}
	disk_close(j->fd);
	j->fd = fd;
	drop_all(j);
	j->synced = j->written;
	j->stored = atomic_load(&j->in_file);
	j->room = 0;
	j->bad = 0;
	return 0;
}

uint64_t journal_generation(const struct journal *j)
{
	return j->generation;
}

int journal_write(struct journal *j, struct error *e)
{
	int rc = j->settled ? 0 : j->bad ? -j->bad : write_waiting(j);
	return rc ? fault(j, -rc, e) : 0;
}

int journal_sync(struct journal *j, struct error *e)
{
	if (j->settled)
		return 0;
	/* Counted before `bad` is checked: a bad journal may be renewed at any time. */
	atomic_fetch_add(&j->flushes, 1);
	int rc = j->bad ? -j->bad : write_waiting(j);
	uint64_t written = j->written, in_file = j->in_file;
	if (!rc && j->bad) {
		rc = -j->bad;
	} else if (!rc && written != j->synced) {
		if (disk_fdatasync(j->fd)) {
			rc = -errno;
			j->bad = -rc;
		} else {
			j->synced = written;
			j->stored = in_file;
			disk_forget(j->fd);
			reserve_ahead(j);
		}
	}
	atomic_fetch_sub(&j->flushes, 1);
	return rc && !j->settled ? fault(j, -rc, e) : 0;
}
