/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The bytes of a journal: its head, its records, and how records are found again among damaged bytes.
 *
 * journal_scan_next returns one piece after the other: a whole record, a record of which only the head is valid, or a
 * stretch in which not even heads are valid. A record is recognised by its mark, the salt of its file and a checksum;
 * after a stretch of invalid bytes the file is searched for the next mark. The number in each head tells how many
 * records are missing before it.
 *
 * Damage is reported as a piece, not as an error. An I/O error is -errno and says nothing about the contents of the
 * file; -ENOMEM: no memory for a body.
 */
#include "coordinator/store/journal_file.h"

#include "common/base/bytes.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "coordinator/store/spool.h"

#include <stdio.h>
#include <string.h>

enum { PATH_SIZE = 4200 };
enum { WINDOW_SIZE = 1 << 20 /* bytes searched for a mark at a time */ };

/* The digits are the version. They change with every change of a record's format, including the formats of bodies
 * (enum journal_kind, and batches as packed by common/wire). */
static const char magic[8] = "hsltJ002";
static const char mark[4] = {'\xf1', 'h', 'j', '\x0d'};

void journal_head_pack(const struct journal_head *h, unsigned char bytes[JOURNAL_HEAD_SIZE])
{
	memset(bytes, 0, JOURNAL_HEAD_SIZE);
	memcpy(bytes, magic, sizeof magic);
	put64(bytes + 8, h->job);
	put64(bytes + 16, h->generation);
	put64(bytes + 24, h->salt);
	put32(bytes + 32, crc32c(0, bytes, 32));
}

int journal_head_unpack(const unsigned char bytes[JOURNAL_HEAD_SIZE], struct journal_head *h, const char *path,
			struct error *e)
{
	*h = (struct journal_head){get64(bytes + 8), get64(bytes + 16), get64(bytes + 24)};
	int rc = spool_check_version((const char *)bytes, magic, path, e);
	return rc || get32(bytes + 32) == crc32c(0, bytes, 32) ? rc : error_set(e, EBADMSG, "%s: damaged", path);
}

void journal_record_pack(struct journal_record *r, unsigned char bytes[JOURNAL_RECORD_HEAD_SIZE], const struct buf *a,
			 const struct buf *b)
{
	r->body_size = (uint32_t)(a->size + b->size);
	r->body_crc = crc32c(crc32c(0, a->bytes, a->size), b->bytes, b->size);
	memset(bytes, 0, JOURNAL_RECORD_HEAD_SIZE);
	memcpy(bytes, mark, sizeof mark);
	put32(bytes + 4, r->body_size);
	put32(bytes + 8, r->body_crc);
	put32(bytes + 12, r->kind);
	put64(bytes + 16, r->number);
	put64(bytes + 24, r->durable_count_before);
	put_double(bytes + 32, r->elapsed);
	put32(bytes + 40, r->lease.kind);
	put32(bytes + 44, r->lease.group);
	put32(bytes + 48, r->lease.part);
	put64(bytes + 56, r->lease.epoch);
	put64(bytes + 64, r->salt);
	put32(bytes + 76, crc32c(0, bytes, 76));
}

/* Returns whether the head of the record is valid. */
static bool unpack_record_head(const unsigned char bytes[JOURNAL_RECORD_HEAD_SIZE], struct journal_record *r)
{
	*r = (struct journal_record){.body_size = get32(bytes + 4),
				     .body_crc = get32(bytes + 8),
				     .kind = get32(bytes + 12),
				     .number = get64(bytes + 16),
				     .durable_count_before = get64(bytes + 24),
				     .elapsed = get_double(bytes + 32),
				     .lease = {.kind = (enum lease_kind)get32(bytes + 40),
					       .group = get32(bytes + 44),
					       .part = get32(bytes + 48),
					       .epoch = get64(bytes + 56)},
				     .salt = get64(bytes + 64)};
	return memcmp(bytes, mark, sizeof mark) == 0 && get32(bytes + 76) == crc32c(0, bytes, 76);
}

int journal_read_at(int fd, void *bytes, size_t size, uint64_t offset)
{
	unsigned char *p = bytes;
	while (size) {
		ssize_t n = disk_pread(fd, p, size, (off_t)offset);
		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return n < 0 ? -errno : -ENODATA;
		p += n;
		offset += (uint64_t)n;
		size -= (size_t)n;
	}
	return 0;
}

/* Reads the head of a record. Returns 1 if it is valid and fits, 0 if not, or -errno. */
static int read_record_head(const struct journal_scan *s, uint64_t offset, struct journal_record *r)
{
	unsigned char bytes[JOURNAL_RECORD_HEAD_SIZE];
	if (offset > s->end || s->end - offset < sizeof bytes)
		return 0;
	int rc = journal_read_at(s->fd, bytes, sizeof bytes, offset);
	if (rc)
		return rc == -ENODATA ? 0 : rc;
	return unpack_record_head(bytes, r) && r->salt == s->salt && r->number >= s->next_number &&
	       r->body_size <= s->end - offset - sizeof bytes;
}

/* Reads the body of a record. Returns 1 if it is valid (*body is mem_alloc'd), 0 if not, or -errno. */
static int read_body(const struct journal_scan *s, uint64_t offset, const struct journal_record *r,
		     unsigned char **body)
{
	*body = mem_alloc(r->body_size, 1);
	if (!*body)
		return -ENOMEM;
	int rc = journal_read_at(s->fd, *body, r->body_size, offset + JOURNAL_RECORD_HEAD_SIZE);
	if (!rc && r->body_crc == crc32c(0, *body, r->body_size))
		return 1;
	mem_free(*body);
	*body = NULL;
	return rc == -ENODATA ? 0 : rc;
}

/* Moves *offset to the first mark at or after it. Returns 1, 0 if there is none, or -errno. */
static int find_mark(const struct journal_scan *s, uint64_t *offset)
{
	unsigned char *window = mem_alloc(WINDOW_SIZE, 1);
	int rc = window ? 0 : -ENOMEM;
	while (!rc && s->end - *offset >= JOURNAL_RECORD_HEAD_SIZE) {
		size_t size = s->end - *offset < WINDOW_SIZE ? (size_t)(s->end - *offset) : WINDOW_SIZE;
		rc = journal_read_at(s->fd, window, size, *offset);
		const unsigned char *found = rc ? NULL : memmem(window, size, mark, sizeof mark);
		if (found) {
			*offset += (uint64_t)(found - window);
			rc = 1;
		} else if (!rc) {
			/* A mark may lie across the edge of the window. */
			*offset += size < WINDOW_SIZE ? size : size - (sizeof mark - 1);
		}
	}
	mem_free(window);
	return rc == -ENODATA ? 0 : rc;
}

void journal_scan_begin(struct journal_scan *s, int fd, uint64_t end, uint64_t salt)
{
	*s = (struct journal_scan){.fd = fd, .offset = JOURNAL_HEAD_SIZE, .end = end, .salt = salt};
}

void journal_scan_end(struct journal_scan *s)
{
	mem_free(s->next.body);
	*s = (struct journal_scan){.fd = -1};
}

/* Finds the first valid record at or after s->offset and stores it in s->next. Returns 1, 0 if there is none, or
 * -errno.
 */
static int find_next_valid(struct journal_scan *s)
{
	struct journal_segment *p = &s->next;
	uint64_t offset = s->offset;
	for (;;) {
		*p = (struct journal_segment){.kind = JOURNAL_SEGMENT_VALID, .begin = offset, .record_count = 1};
		int rc = read_record_head(s, offset, &p->record);
		if (rc > 0) {
			p->end = offset + JOURNAL_RECORD_HEAD_SIZE + p->record.body_size;
			rc = read_body(s, offset, &p->record, &p->body);
			if (rc > 0)
				s->has_next = true;
			if (rc)
				return rc;
			offset = p->end;
			continue;
		}
		offset++;
		if (!rc)
			rc = s->end > offset ? find_mark(s, &offset) : 0;
		if (rc <= 0)
			return rc;
	}
}

/* Returns the first piece before the record found: a damaged record whose head is valid, or a stretch without valid
 * heads. */
static int next_damage(struct journal_scan *s, struct journal_segment *p)
{
	uint64_t to = s->next.begin, number = s->next.record.number;
	*p = (struct journal_segment){.kind = JOURNAL_SEGMENT_UNKNOWN, .begin = s->offset};
	struct journal_record r;
	int rc = s->offset < to ? read_record_head(s, s->offset, &r) : 0;
	if (rc < 0)
		return rc;
	if (rc > 0 && r.number < number && r.body_size <= to - s->offset - JOURNAL_RECORD_HEAD_SIZE) {
		p->record_count = r.number - s->next_number;
		if (p->record_count == 0) {
			*p = (struct journal_segment){.kind = JOURNAL_SEGMENT_DAMAGED,
						      .begin = s->offset,
						      .end = s->offset + JOURNAL_RECORD_HEAD_SIZE + r.body_size,
						      .record_count = 1,
						      .record = r};
			s->offset = p->end;
			s->next_number++;
			return 1;
		}
		to = s->offset;
		number = r.number;
	}
	p->end = to;
	p->record_count = number - s->next_number;
	s->offset = to;
	s->next_number = number;
	return 1;
}

int journal_scan_next(struct journal_scan *s, struct journal_segment *p)
{
	int rc = s->has_next ? 1 : find_next_valid(s);
	if (rc <= 0)
		return rc;
	if (s->offset < s->next.begin || s->next_number < s->next.record.number)
		return next_damage(s, p);
	*p = s->next;
	s->next.body = NULL;
	s->has_next = false;
	s->offset = p->end;
	s->next_number++;
	s->durable_count =
		p->record.durable_count_before > s->durable_count ? p->record.durable_count_before : s->durable_count;
	return 1;
}

int journal_scan_salt(int fd, uint64_t end, uint64_t *salt)
{
	unsigned char bytes[JOURNAL_RECORD_HEAD_SIZE];
	struct journal_record r;
	int rc = end < JOURNAL_HEAD_SIZE + JOURNAL_RECORD_HEAD_SIZE
			 ? -ENODATA
			 : journal_read_at(fd, bytes, sizeof bytes, JOURNAL_HEAD_SIZE);
	if (!rc && (!unpack_record_head(bytes, &r) || r.number != 0))
		rc = -ENODATA;
	*salt = rc ? 0 : r.salt;
	return rc == -ENODATA ? -EBADMSG : rc;
}

int journal_read_record(int fd, uint64_t end, uint64_t salt, uint64_t offset, struct journal_record *r,
			unsigned char **body)
{
	struct journal_scan s = {.fd = fd, .end = end, .salt = salt};
	int rc = read_record_head(&s, offset, r);
	return rc > 0 ? read_body(&s, offset, r, body) : rc;
}

int journal_gaps_add(struct journal_gaps *g, uint64_t number, uint64_t count, struct error *e)
{
	struct journal_gap *first = list_grow_array(g->items, g->count, sizeof *first);
	if (!first)
		return error_set(e, ENOMEM, "no memory for a journal");
	g->items = first;
	g->items[g->count++] = (struct journal_gap){number, count};
	return 0;
}

void journal_gaps_count_records(const struct journal_gaps *g, uint64_t stored, uint64_t *damaged, uint64_t *lost)
{
	*damaged = *lost = 0;
	for (size_t i = 0; i < g->count; i++) {
		const struct journal_gap *n = &g->items[i];
		uint64_t durable = stored > n->number ? stored - n->number : 0;
		*damaged += n->count;
		*lost += durable < n->count ? durable : n->count;
	}
}

/* Whether this is the name of a journal, or of one that was being renewed (journal.G.new). Returns the generation. */
static bool parse_journal_name(const char *name, uint64_t *generation)
{
	unsigned long long n;
	char canonical[64];
	if (sscanf(name, "journal.%llu", &n) != 1)
		return false;
	int length = snprintf(canonical, sizeof canonical, "journal.%llu", n);
	*generation = n;
	return strncmp(canonical, name, (size_t)length) == 0 && (!name[length] || strcmp(name + length, ".new") == 0);
}

/* A file that cannot be deleted takes up space until the next call. If the folder does not exist, there is nothing to
 * delete. */
void journal_delete_others(const char *folder, uint64_t keep)
{
	char path[PATH_SIZE];
	uint64_t generation;
	struct disk_list l;
	struct error e;
	disk_list_begin(&l, folder);
	for (const char *name; (name = disk_list_next(&l));) {
		if (!parse_journal_name(name, &generation) || generation == keep)
			continue;
		snprintf(path, sizeof path, "%s/%s", folder, name);
		disk_unlink(path);
	}
	int rc = disk_list_end(&l, 0, &e);
	if (rc && rc != -ENOENT)
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"some old journals may not have been deleted\"",
			  log_quote(e.text).text);
}

int journal_rename_damaged(const char *folder, struct error *e)
{
	char from[PATH_SIZE], to[PATH_SIZE + 16];
	uint64_t generation;
	struct disk_list l;
	disk_list_begin(&l, folder);
	for (const char *name; (name = disk_list_next(&l));) {
		if (!parse_journal_name(name, &generation))
			continue;
		snprintf(from, sizeof from, "%s/%s", folder, name);
		snprintf(to, sizeof to, "%s.damaged", from);
		disk_rename(from, to);
	}
	return disk_list_end(&l, 0, e);
}
