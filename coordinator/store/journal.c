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

enum { PATH_SIZE = 4200 };
/* Space is reserved for several records at once, because a file system that is writing back delays each reservation. */
enum { RESERVE_AHEAD_RECORDS = 8, RESERVE_AHEAD_BYTES_MAX = 1 << 28 };
/* Limit on the queued bytes of all journals together. Beyond it journal_append also writes, so it runs at the speed
 * of the disk. */
enum { UNWRITTEN_BYTES_MAX = 1 << 28 };
static _Atomic uint64_t unwritten_bytes;

struct queued_record {
	struct queued_record *next;
	struct journal_record record;
	struct buf copied, owned; /* the body of the record is `copied` followed by `owned` */
};

struct journal {
	int fd;
	uint64_t job, generation, salt;
	atomic_uint reference_count;
	pthread_mutex_t write_lock; /* held while the file is written or truncated; taken before `queue_lock` */
	pthread_mutex_t queue_lock; /* held briefly; protects queue_head, queue_tail, queued_bytes and next_number */
	struct queued_record *queue_head, **queue_tail;
	/* bytes in the queue; with `written_bytes`, the size of the file once the queue is empty */
	uint64_t queued_bytes;
	uint64_t next_number;				   /* number of the next record */
	uint64_t damaged_count;				   /* records of the file that were damaged when it was read */
	_Atomic uint64_t written_records, durable_records; /* records in the file, and those that are durable */
	_Atomic uint64_t written_bytes, synced_bytes; /* bytes of the file that are written, and that are flushed */
	_Atomic uint64_t reserved_end;		      /* space is reserved up to this offset */
	_Atomic uint64_t reserved_record_bytes;	      /* bytes of the record last reserved */
	/* 0, or the errno of the operation on the file that failed: the file is neither written nor trusted any more.
	 */
	atomic_int failure_errno;
	atomic_bool is_settled;	 /* all its records are also stored elsewhere */
	atomic_uint flush_count; /* number of running flushes, during which the journal must not be renewed */
	char path[PATH_SIZE];
};

static int set_file_error(const struct journal *j, int code, struct error *e)
{
	return error_set(e, code, "%s: %s", j->path, strerror(code));
}

static struct journal *new_journal(const char *folder, uint64_t job, uint64_t generation, int flags, struct error *e)
{
	struct journal *j = mem_alloc(1, sizeof *j);
	if (!j) {
		error_set(e, ENOMEM, "no memory for a journal");
		return NULL;
	}
	j->job = job;
	j->generation = generation;
	j->queue_tail = &j->queue_head;
	pthread_mutex_init(&j->write_lock, NULL);
	pthread_mutex_init(&j->queue_lock, NULL);
	atomic_init(&j->reference_count, 1);
	snprintf(j->path, sizeof j->path, "%s/journal.%llu", folder, (unsigned long long)generation);
	j->fd = disk_open(j->path, flags | O_CLOEXEC, 0600);
	return j;
}

static void pack_file_head(const struct journal *j, unsigned char bytes[JOURNAL_HEAD_SIZE])
{
	journal_head_pack(&(struct journal_head){j->job, j->generation, j->salt}, bytes);
}

void journal_hold(struct journal *j)
{
	atomic_fetch_add(&j->reference_count, 1);
}

static struct queued_record *first_queued(struct journal *j)
{
	pthread_mutex_lock(&j->queue_lock);
	struct queued_record *n = j->queue_head;
	pthread_mutex_unlock(&j->queue_lock);
	return n;
}

static uint64_t record_size(const struct journal_record *r)
{
	return JOURNAL_RECORD_HEAD_SIZE + r->body_size;
}

static void pop_written(struct journal *j)
{
	pthread_mutex_lock(&j->queue_lock);
	struct queued_record *n = j->queue_head;
	j->queue_head = n->next;
	if (!j->queue_head)
		j->queue_tail = &j->queue_head;
	j->queued_bytes -= record_size(&n->record);
	j->written_bytes += record_size(&n->record);
	j->written_records = n->record.number + 1;
	pthread_mutex_unlock(&j->queue_lock);
	unwritten_bytes -= record_size(&n->record);
	buf_fini(&n->copied);
	buf_fini(&n->owned);
	mem_free(n);
}

static void drop_queue(struct journal *j)
{
	while (j->queue_head)
		pop_written(j);
}

static int write_parts(int fd, off_t offset, struct iovec *part, int count)
{
	while (count) {
		ssize_t n = disk_pwritev(fd, part, count, offset);
		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return n < 0 ? -errno : -ENOSPC;
		offset += n;
		for (; count && (size_t)n >= part->iov_len; part++, count--)
			n -= (ssize_t)part->iov_len;
		if (count) {
			part->iov_base = (char *)part->iov_base + n;
			part->iov_len -= (size_t)n;
		}
	}
	return 0;
}

static int write_record(const struct journal *j, int fd, uint64_t offset, struct queued_record *n)
{
	unsigned char head[JOURNAL_RECORD_HEAD_SIZE];
	n->record.durable_count_before = j->durable_records;
	journal_record_pack(&n->record, head, &n->copied, &n->owned);
	struct iovec parts[3] = {
		{head, sizeof head}, {n->copied.bytes, n->copied.size}, {n->owned.bytes, n->owned.size}};
	return write_parts(fd, (off_t)offset, parts, 3);
}

/* Frees reserved space that was not used. The caller holds `write_lock`. */
static int truncate_reserved(struct journal *j)
{
	j->reserved_end = 0;
	return disk_ftruncate(j->fd, (off_t)j->written_bytes);
}

uint64_t journal_bytes(struct journal *j)
{
	pthread_mutex_lock(&j->queue_lock);
	uint64_t bytes = j->written_bytes + j->queued_bytes;
	pthread_mutex_unlock(&j->queue_lock);
	return bytes;
}

/* Writes the records that were in the queue at the start, and no more: on a slow disk the queue might never become
 * empty, and the first record would never be acknowledged. */
static int write_queue(struct journal *j)
{
	int rc = 0;
	pthread_mutex_lock(&j->write_lock);
	uint64_t end = journal_bytes(j);
	while (!rc && !j->failure_errno && j->written_bytes < end) {
		struct queued_record *n = first_queued(j);
		rc = write_record(j, j->fd, j->written_bytes, n);
		if (!rc) {
			pop_written(j);
			continue;
		}
		/* A torn record that is left there would be cut off by the next reader, together with everything
		 * behind it. */
		int cut = truncate_reserved(j);
		(void)cut;
		j->failure_errno = -rc;
	}
	pthread_mutex_unlock(&j->write_lock);
	return rc;
}

void journal_release(struct journal *j)
{
	if (!j || atomic_fetch_sub(&j->reference_count, 1) > 1)
		return;
	if (j->fd >= 0 && !j->failure_errno) {
		/* Without a flush these records were never acknowledged, so an error is of no consequence. */
		int rc = j->is_settled ? 0 : write_queue(j);
		if (!rc && j->reserved_end > j->written_bytes)
			rc = truncate_reserved(j); /* if this fails, the space is freed when the file is deleted */
		(void)rc;
	}
	drop_queue(j);
	if (j->fd >= 0)
		disk_close(j->fd);
	pthread_mutex_destroy(&j->queue_lock);
	pthread_mutex_destroy(&j->write_lock);
	mem_free(j);
}

static int write_head(int fd, const unsigned char head[JOURNAL_HEAD_SIZE])
{
	int rc = disk_write_all(fd, head, JOURNAL_HEAD_SIZE);
	return rc ? rc : disk_fsync(fd) ? -errno : 0;
}

int journal_create(struct journal **out, const char *folder, uint64_t job, uint64_t generation, struct error *e)
{
	struct journal *j = new_journal(folder, job, generation, O_RDWR | O_CREAT | O_TRUNC, e);
	if (!j)
		return -ENOMEM;
	unsigned char head[JOURNAL_HEAD_SIZE];
	int rc = 0;
	if (getentropy(&j->salt, sizeof j->salt))
		rc = set_file_error(j, errno, e);
	pack_file_head(j, head);
	if (!rc && j->fd < 0)
		rc = set_file_error(j, errno, e);
	else if (!rc && (rc = write_head(j->fd, head)))
		rc = set_file_error(j, -rc, e);
	if (!rc)
		rc = disk_sync_folder(folder, e);
	if (rc) {
		journal_release(j);
		return rc;
	}
	j->written_bytes = j->synced_bytes = sizeof head;
	*out = j;
	return 0;
}

static int visit_segment(struct journal *j, const struct journal_segment *p, journal_visitor *visit, void *user,
			 struct error *e)
{
	struct journal_item item = {.journal = j,
				    .offset = p->begin,
				    .damaged_count = p->kind == JOURNAL_SEGMENT_VALID ? 0 : p->record_count};
	if (p->kind != JOURNAL_SEGMENT_UNKNOWN) {
		item.kind = (enum journal_kind)p->record.kind;
		item.elapsed = p->record.elapsed;
		item.lease = p->record.lease;
		item.lease.job = j->job;
		item.body = p->body;
		item.body_size = p->record.body_size;
	}
	j->written_bytes = p->end; /* journal_read_body can read up to here */
	return visit(user, &item, e);
}

static int read_records(struct journal *j, uint64_t end, struct journal_gaps *gaps, journal_visitor *visit, void *user,
			struct journal_damage *damage, struct error *e)
{
	struct journal_scan s;
	struct journal_segment p;
	int rc;
	journal_scan_begin(&s, j->fd, end, j->salt);
	while ((rc = journal_scan_next(&s, &p)) > 0) {
		if (p.kind != JOURNAL_SEGMENT_VALID && p.record_count)
			rc = journal_gaps_add(gaps, s.next_number - p.record_count, p.record_count, e);
		if (rc >= 0 && (p.kind == JOURNAL_SEGMENT_VALID || p.record_count))
			rc = visit_segment(j, &p, visit, user, e);
		if (p.kind == JOURNAL_SEGMENT_VALID)
			mem_free(p.body);
		if (rc < 0) {
			journal_scan_end(&s);
			return rc;
		}
	}
	if (rc < 0)
		set_file_error(j, -rc, e);
	journal_gaps_count_records(gaps, s.durable_count, &damage->damaged_count, &damage->lost_count);
	damage->cut_bytes = end - s.offset;
	j->written_bytes = s.offset;
	j->next_number = s.next_number;
	atomic_store(&j->written_records, s.next_number);
	atomic_store(&j->durable_records, s.next_number);
	j->damaged_count = damage->damaged_count;
	journal_scan_end(&s);
	return rc;
}

/* Reads the head of the file. If the head is damaged, takes the salt from the first record instead and sets
 * *rewrite_head, so that the head is written again. */
static int read_file_head(struct journal *j, uint64_t end, bool *rewrite_head, struct error *e)
{
	unsigned char head[JOURNAL_HEAD_SIZE];
	struct journal_head h;
	int rc = end < sizeof head ? -ENODATA : journal_read_at(j->fd, head, sizeof head, 0);
	if (rc && rc != -ENODATA)
		return set_file_error(j, -rc, e);
	int damaged = rc ? rc : journal_head_unpack(head, &h, j->path, e);
	if (damaged == -EPROTO)
		return damaged;
	if (!damaged && h.job == j->job && h.generation == j->generation) {
		j->salt = h.salt;
		return 0;
	}
	rc = damaged ? journal_scan_salt(j->fd, end, &j->salt) : -EBADMSG;
	*rewrite_head = !rc;
	if (rc == -EBADMSG)
		return error_set(e, EBADMSG, "%s: not the journal of j%llu", j->path, (unsigned long long)j->job);
	return rc ? set_file_error(j, -rc, e) : 0;
}

static int read_file(struct journal *j, journal_visitor *visit, void *user, struct journal_damage *damage,
		     struct error *e)
{
	struct stat st;
	unsigned char head[JOURNAL_HEAD_SIZE];
	struct journal_gaps gaps = {NULL, 0};
	bool rewrite_head = false;
	if (disk_fstat(j->fd, &st))
		return set_file_error(j, errno, e);
	int rc = read_file_head(j, (uint64_t)st.st_size, &rewrite_head, e);
	if (!rc)
		rc = read_records(j, (uint64_t)st.st_size, &gaps, visit, user, damage, e);
	mem_free(gaps.items);
	if (rc)
		return rc;
	pack_file_head(j, head);
	struct iovec part = {head, sizeof head};
	if (rewrite_head && (rc = write_parts(j->fd, 0, &part, 1)))
		return set_file_error(j, -rc, e);
	if (damage->cut_bytes && disk_ftruncate(j->fd, (off_t)j->written_bytes))
		return set_file_error(j, errno, e);
	return disk_fsync(j->fd) ? set_file_error(j, errno, e) : 0;
}

int journal_open(struct journal **out, const char *folder, uint64_t job, uint64_t generation, journal_visitor *visit,
		 void *user, struct journal_damage *damage, struct error *e)
{
	*damage = (struct journal_damage){0};
	struct journal *j = new_journal(folder, job, generation, O_RDWR, e);
	if (!j)
		return -ENOMEM;
	int rc = j->fd < 0 ? set_file_error(j, errno, e) : 0;
	if (!rc) {
		disk_prefetch(j->fd);
		rc = read_file(j, visit, user, damage, e);
	}
	if (rc) {
		*damage = (struct journal_damage){0};
		journal_release(j);
		return rc;
	}
	atomic_store(&j->synced_bytes, atomic_load(&j->written_bytes));
	*out = j;
	return 0;
}

int journal_read_body(struct journal *j, uint64_t offset, unsigned char **body, size_t *size, struct error *e)
{
	struct journal_record r;
	int rc = journal_read_record(j->fd, j->written_bytes, j->salt, offset, &r, body);
	*size = r.body_size;
	if (rc < 0)
		return set_file_error(j, -rc, e);
	return rc ? 0 : error_set(e, EBADMSG, "%s: a record has been damaged", j->path);
}

static bool reserve_space(struct journal *j, uint64_t from, uint64_t size)
{
	if (disk_fallocate(j->fd, FALLOC_FL_KEEP_SIZE, (off_t)from, (off_t)size))
		return false;
	j->reserved_end = from + size;
	return true;
}

static int ensure_space(struct journal *j, uint64_t size, struct error *e)
{
	uint64_t end = journal_bytes(j);
	if (j->failure_errno) {
		set_file_error(j, j->failure_errno, e);
		return -EIO;
	}
	if (end + size <= j->reserved_end ||
	    (RESERVE_AHEAD_RECORDS * size <= RESERVE_AHEAD_BYTES_MAX &&
	     reserve_space(j, end, RESERVE_AHEAD_RECORDS * size)) ||
	    reserve_space(j, end, size) || errno == EOPNOTSUPP || errno == ENOSYS)
		return 0;
	int code = errno;
	pthread_mutex_lock(&j->write_lock);
	int cut = truncate_reserved(j);
	/* Queued records need the space they had reserved. */
	bool kept = j->written_bytes == end || reserve_space(j, j->written_bytes, end - j->written_bytes);
	pthread_mutex_unlock(&j->write_lock);
	(void)cut;
	(void)kept;
	return set_file_error(j, code, e);
}

int journal_reserve(struct journal *j, size_t body, struct error *e)
{
	j->reserved_record_bytes = JOURNAL_RECORD_HEAD_SIZE + body;
	return ensure_space(j, j->reserved_record_bytes, e);
}

/* Reserves more space before the reserved space runs out; called by the thread that flushes. It holds `write_lock`,
 * because otherwise the new space might be cut off between its reservation and the change of `reserved_end`. */
static void reserve_ahead(struct journal *j)
{
	pthread_mutex_lock(&j->write_lock);
	uint64_t size = j->reserved_record_bytes, end = journal_bytes(j);
	if (size && !j->failure_errno && RESERVE_AHEAD_RECORDS * size <= RESERVE_AHEAD_BYTES_MAX &&
	    end + RESERVE_AHEAD_RECORDS / 2 * size > j->reserved_end)
		reserve_space(j, end, RESERVE_AHEAD_RECORDS * size);
	pthread_mutex_unlock(&j->write_lock);
}

static struct journal_record make_record(const struct journal *j, enum journal_kind kind, const struct lease_key *lease,
					 double elapsed, size_t size)
{
	return (struct journal_record){.body_size = (uint32_t)size,
				       .kind = kind,
				       .elapsed = elapsed,
				       .lease = lease ? *lease : (struct lease_key){0},
				       .salt = j->salt};
}

int journal_append(struct journal *j, enum journal_kind kind, const struct lease_key *lease, double elapsed,
		   const void *copied, size_t copied_size, struct buf *owned, struct error *e)
{
	size_t owned_size = owned ? owned->size : 0;
	if (copied_size > UINT32_MAX || owned_size > UINT32_MAX - copied_size)
		return error_set(e, EFBIG, "%s: a record of %zu bytes", j->path, copied_size + owned_size);
	/* Records other than results and fingerprints are optional: without disk space they are refused here, since a
	 * failed write would make the journal bad. */
	if (kind != JOURNAL_BATCH && kind != JOURNAL_BATCH_REPLACEMENT && kind != JOURNAL_FINGERPRINT &&
	    !j->failure_errno) {
		int rc = ensure_space(j, JOURNAL_RECORD_HEAD_SIZE + copied_size + owned_size, e);
		if (rc)
			return rc;
	}
	struct queued_record *n = mem_alloc(1, sizeof *n);
	if (n)
		*n = (struct queued_record){.record = make_record(j, kind, lease, elapsed, copied_size + owned_size),
					    .copied.limit = copied_size};
	if (!n || !buf_append(&n->copied, copied, copied_size)) {
		mem_free(n);
		return error_set(e, ENOMEM, "no memory for a record of %zu bytes", copied_size + owned_size);
	}
	if (owned) {
		n->owned = *owned;
		memset(owned, 0, sizeof *owned);
	}
	uint64_t size = record_size(&n->record), bytes = atomic_fetch_add(&unwritten_bytes, size) + size;
	pthread_mutex_lock(&j->queue_lock);
	n->record.number = j->next_number++;
	*j->queue_tail = n;
	j->queue_tail = &n->next;
	j->queued_bytes += size;
	pthread_mutex_unlock(&j->queue_lock);
	if (bytes > UNWRITTEN_BYTES_MAX && !j->failure_errno)
		write_queue(j); /* an error makes the journal bad, and is reported by the next operation */
	return 0;
}

bool journal_is_bad(const struct journal *j)
{
	return j->failure_errno;
}

bool journal_file_is_missing(const struct journal *j)
{
	struct stat opened, current;
	if (j->fd < 0 || disk_fstat(j->fd, &opened))
		return false;
	if (disk_stat(j->path, &current))
		return errno == ENOENT || errno == ENOTDIR;
	return opened.st_ino != current.st_ino || opened.st_dev != current.st_dev;
}

void journal_mark_bad(struct journal *j)
{
	j->failure_errno = ENOENT;
}

void journal_mark_settled(struct journal *j)
{
	j->is_settled = true;
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
			return set_file_error(j, -rc, e);
		from += n;
	}
	return 0;
}

/* Copies all records of the file to the same offsets in another file, checking each one again, and appends the queued
 * records. Damaged records are copied as they are, so that it stays known what is missing. */
static int copy_records(struct journal *j, int to, struct error *e)
{
	struct journal_scan s;
	struct journal_segment p;
	uint64_t damaged = 0;
	int rc;
	journal_scan_begin(&s, j->fd, j->written_bytes, j->salt);
	while ((rc = journal_scan_next(&s, &p)) > 0) {
		damaged += p.kind == JOURNAL_SEGMENT_VALID ? 0 : p.record_count;
		if (p.kind == JOURNAL_SEGMENT_VALID)
			mem_free(p.body);
		int failed = copy_bytes(j, to, p.begin, p.end, e);
		if (failed) {
			journal_scan_end(&s);
			return failed;
		}
	}
	uint64_t offset = s.offset;
	journal_scan_end(&s);
	if (rc || damaged != j->damaged_count || offset != j->written_bytes)
		return set_file_error(j, rc ? -rc : EIO, e);
	for (struct queued_record *n = j->queue_head; !rc && n; offset += record_size(&n->record), n = n->next)
		if ((rc = write_record(j, to, offset, n)))
			rc = set_file_error(j, -rc, e);
	return rc;
}

int journal_renew(struct journal *j, struct error *e)
{
	char path[PATH_SIZE + 8], folder[PATH_SIZE];
	unsigned char head[JOURNAL_HEAD_SIZE];
	snprintf(path, sizeof path, "%s.new", j->path);
	snprintf(folder, sizeof folder, "%s", j->path);
	*strrchr(folder, '/') = 0;
	if (j->flush_count)
		return error_set(e, EAGAIN, "%s: is being flushed", j->path);
	pack_file_head(j, head);
	int fd = disk_open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int rc = fd < 0 ? -errno : disk_write_all(fd, head, sizeof head);
	rc = rc ? set_file_error(j, -rc, e) : copy_records(j, fd, e);
	if (!rc && (disk_fsync(fd) || disk_rename(path, j->path)))
		rc = set_file_error(j, errno, e);
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
	drop_queue(j);
	j->synced_bytes = j->written_bytes;
	j->durable_records = atomic_load(&j->written_records);
	j->reserved_end = 0;
	j->failure_errno = 0;
	return 0;
}

uint64_t journal_generation(const struct journal *j)
{
	return j->generation;
}

int journal_write(struct journal *j, struct error *e)
{
	int rc = j->is_settled ? 0 : j->failure_errno ? -j->failure_errno : write_queue(j);
	return rc ? set_file_error(j, -rc, e) : 0;
}

int journal_sync(struct journal *j, struct error *e)
{
	if (j->is_settled)
		return 0;
	/* Counted before `failure_errno` is checked: a bad journal may be renewed at any time. */
	atomic_fetch_add(&j->flush_count, 1);
	int rc = j->failure_errno ? -j->failure_errno : write_queue(j);
	uint64_t written = j->written_bytes, in_file = j->written_records;
	if (!rc && j->failure_errno) {
		rc = -j->failure_errno;
	} else if (!rc && written != j->synced_bytes) {
		if (disk_fdatasync(j->fd)) {
			rc = -errno;
			j->failure_errno = -rc;
		} else {
			j->synced_bytes = written;
			j->durable_records = in_file;
			disk_drop_cache(j->fd);
			reserve_ahead(j);
		}
	}
	atomic_fetch_sub(&j->flush_count, 1);
	return rc && !j->is_settled ? set_file_error(j, -rc, e) : 0;
}
