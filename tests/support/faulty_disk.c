/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A tree of names and files in memory that holds what a loss of power would leave (faulty_disk.h). Calls are
 * carried out on the real disk and recorded here: writes go into a list of changes, which a flush applies to the safe
 * bytes; names go into a list of renamings, which a flush of their folder applies. When power is lost, the safe state
 * and a random part of the rest are written to the other folder.
 *
 * The hooks are in faulty_disk_calls.c and, for SQLite, in faulty_disk_vfs.c. Running out of memory ends the process.
 */
#include "tests/support/faulty_disk.h"

#include "common/base/disk.h"

#include <assert.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SECTOR_BYTES = 512, PATH_SIZE_MAX = 4400 };

/* A change to a file since its last flush. */
struct change {
	struct change *next;
	uint64_t offset, size;
	unsigned char *bytes; /* NULL: the file was cut to `safe_size` */
};

struct entry {
	struct entry *next;
	char *text;
	struct faulty_disk_node *node;
};

/* A change to a folder since its last flush: `old_name` was removed, `new_name` was added (either may be NULL). */
struct renaming {
	struct renaming *next;
	char *old_name, *new_name;
	struct faulty_disk_node *node;
};

struct faulty_disk_node {
	bool is_folder;
	char last_component[64];   /* of its first name */
	unsigned char *safe_bytes; /* for a file */
	uint64_t safe_size;
	struct change *changes, **changes_tail;
	struct entry *current_names, *safe_names; /* for a folder: its names */
	struct renaming *renamings, **renamings_tail;
};

static struct faulty_disk_options disk_options;
static struct faulty_disk_node *root_node;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static uint64_t call_count, modifying_calls, calls_since_failure, random_state;
static atomic_bool has_failed;
static _Atomic uint64_t unused_counts[FAULTY_DISK_COUNTS];

static void *check_allocated(void *p)
{
	if (!p)
		abort();
	return p;
}

static double random_unit(void)
{
	uint64_t z = random_state += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

/* ---- names ---- */

static struct faulty_disk_node *node_new(bool folder, const char *last)
{
	struct faulty_disk_node *n = check_allocated(calloc(1, sizeof *n));
	n->is_folder = folder;
	memcpy(n->last_component, last, strnlen(last, sizeof n->last_component - 1));
	n->changes_tail = &n->changes;
	n->renamings_tail = &n->renamings;
	return n;
}

static struct entry **find_name(struct entry **list, const char *text)
{
	while (*list && strcmp((*list)->text, text) != 0)
		list = &(*list)->next;
	return list;
}

static void remove_name(struct entry **list, const char *text)
{
	struct entry **slot = find_name(list, text), *removed = *slot;
	if (!removed)
		return;
	*slot = removed->next;
	free(removed->text);
	free(removed);
}

static void set_name(struct entry **list, const char *text, struct faulty_disk_node *node)
{
	remove_name(list, text);
	struct entry *n = check_allocated(malloc(sizeof *n));
	*n = (struct entry){*list, check_allocated(strdup(text)), node};
	*list = n;
}

static struct entry *copy_names(const struct entry *from)
{
	struct entry *list = NULL;
	for (; from; from = from->next)
		set_name(&list, from->text, from->node);
	return list;
}

static void apply_renaming(struct entry **list, const struct renaming *r)
{
	if (r->old_name)
		remove_name(list, r->old_name);
	if (r->new_name)
		set_name(list, r->new_name, r->node);
}

static void record_renaming(struct faulty_disk_node *folder, const char *old_name, const char *new_name,
			    struct faulty_disk_node *node)
{
	struct renaming *r = check_allocated(calloc(1, sizeof *r));
	*r = (struct renaming){NULL, old_name ? check_allocated(strdup(old_name)) : NULL,
			       new_name ? check_allocated(strdup(new_name)) : NULL, node};
	apply_renaming(&folder->current_names, r);
	*folder->renamings_tail = r;
	folder->renamings_tail = &r->next;
}

/* Returns the folder that contains the path's last component; NULL: the path is not below the root, or there is no
 * such folder. */
static struct faulty_disk_node *find_parent(const char *path, const char **last)
{
	size_t n = strlen(disk_options.root);
	if (strncmp(path, disk_options.root, n) != 0 || (path[n] && path[n] != '/'))
		return NULL;
	struct faulty_disk_node *current = root_node;
	const char *part = path + n;
	for (;;) {
		char text[256];
		while (*part == '/')
			part++;
		size_t size = strcspn(part, "/");
		if (!part[size] || !part[size + strspn(part + size, "/")]) {
			*last = part;
			return current;
		}
		assert(size < sizeof text);
		memcpy(text, part, size);
		text[size] = 0;
		struct entry *next = *find_name(&current->current_names, text);
		if (!next || !next->node->is_folder)
			return NULL;
		current = next->node;
		part += size;
	}
}

static struct faulty_disk_node *find_node(const char *path, bool create, bool folder)
{
	const char *last;
	struct faulty_disk_node *parent = find_parent(path, &last);
	if (!parent || !*last)
		return parent;
	struct entry *n = *find_name(&parent->current_names, last);
	if (n || !create)
		return n ? n->node : NULL;
	struct faulty_disk_node *created = node_new(folder, last);
	record_renaming(parent, NULL, last, created);
	return created;
}

struct faulty_disk_node *faulty_disk_find_node(const char *path, bool create)
{
	return find_node(path, create, false);
}

void faulty_disk_record_new_folder(const char *path)
{
	find_node(path, true, true);
}

void faulty_disk_record_rename(const char *from, const char *to)
{
	const char *old_name, *new_name;
	struct faulty_disk_node *a = find_parent(from, &old_name), *b = find_parent(to, &new_name);
	if (!a)
		return;
	struct entry *n = *find_name(&a->current_names, old_name);
	assert(n && b);
	if (a != b) { /* the folders are separate: one of them may keep its change while the other does not */
		record_renaming(b, NULL, new_name, n->node);
		record_renaming(a, old_name, NULL, NULL);
	} else {
		record_renaming(a, old_name, new_name, n->node);
	}
}

/* ---- what a flush makes safe ---- */

static void resize_bytes(unsigned char **bytes, uint64_t *size, uint64_t new_size)
{
	*bytes = check_allocated(realloc(*bytes, new_size + 1));
	if (new_size > *size)
		memset(*bytes + *size, 0, new_size - *size);
	*size = new_size;
}

static void store_bytes(unsigned char **bytes, uint64_t *size, const void *from, uint64_t n, uint64_t offset)
{
	if (offset + n > *size)
		resize_bytes(bytes, size, offset + n);
	if (n)
		memcpy(*bytes + offset, from, n);
}

static bool is_flush_skipped(const struct faulty_disk_node *n, enum faulty_disk_forget kind)
{
	return (disk_options.forget & kind) &&
	       (!disk_options.forget_name ||
		strncmp(n->last_component, disk_options.forget_name, strlen(disk_options.forget_name)) == 0);
}

void faulty_disk_record_flush(struct faulty_disk_node *n, bool database)
{
	if (!n || is_flush_skipped(n, database	     ? FAULTY_DISK_FORGET_DATABASE
				      : n->is_folder ? FAULTY_DISK_FORGET_FOLDERS
						     : FAULTY_DISK_FORGET_FILES))
		return;
	for (struct change *c; (c = n->changes);) {
		n->changes = c->next;
		if (c->bytes)
			store_bytes(&n->safe_bytes, &n->safe_size, c->bytes, c->size, c->offset);
		else
			resize_bytes(&n->safe_bytes, &n->safe_size, c->size);
		free(c->bytes);
		free(c);
	}
	n->changes_tail = &n->changes;
	for (struct renaming *r; (r = n->renamings);) {
		n->renamings = r->next;
		apply_renaming(&n->safe_names, r);
		free(r->old_name);
		free(r->new_name);
		free(r);
	}
	n->renamings_tail = &n->renamings;
}

void faulty_disk_record_failed_flush(struct faulty_disk_node *n)
{
	while (n && !n->is_folder && n->changes) {
		struct change *c = n->changes;
		n->changes = c->next;
		free(c->bytes);
		free(c);
	}
	if (n && !n->is_folder)
		n->changes_tail = &n->changes;
}

void faulty_disk_record_folder_flush(const char *path)
{
	const char *last;
	faulty_disk_record_flush(find_parent(path, &last), true);
}

static void add_change(struct faulty_disk_node *n, const void *bytes, uint64_t size, uint64_t offset)
{
	struct change *c = check_allocated(calloc(1, sizeof *c));
	c->offset = offset;
	c->size = size;
	if (bytes) {
		c->bytes = check_allocated(malloc(size + 1));
		memcpy(c->bytes, bytes, size);
	}
	*n->changes_tail = c;
	n->changes_tail = &c->next;
}

void faulty_disk_record_write(struct faulty_disk_node *n, const void *bytes, size_t size, uint64_t offset)
{
	if (n && size)
		add_change(n, bytes, size, offset);
}

void faulty_disk_record_truncate(struct faulty_disk_node *n, uint64_t size)
{
	if (n)
		add_change(n, NULL, size, 0);
}

void faulty_disk_record_removal(const char *path)
{
	const char *last;
	struct faulty_disk_node *parent = find_parent(path, &last);
	if (parent)
		record_renaming(parent, last, NULL, NULL);
}

/* ---- loss of power ---- */

struct odds {
	double bytes, lengths, names; /* probabilities that unflushed changes survive */
};

static void write_surviving_file(const struct faulty_disk_node *n, const char *path, const struct odds *p,
				 uint64_t *lost)
{
	unsigned char *bytes = NULL;
	uint64_t size = 0;
	store_bytes(&bytes, &size, n->safe_bytes ? n->safe_bytes : (const unsigned char *)"", n->safe_size, 0);
	for (const struct change *c = n->changes; c; c = c->next) {
		if (!c->bytes) {
			if (random_unit() < p->lengths)
				resize_bytes(&bytes, &size, c->size);
			continue;
		}
		if (random_unit() < p->lengths && c->offset + c->size > size)
			resize_bytes(&bytes, &size, c->offset + c->size);
		for (uint64_t at = c->offset, end; at < c->offset + c->size; at = end) {
			end = at / SECTOR_BYTES * SECTOR_BYTES + SECTOR_BYTES;
			end = end < c->offset + c->size ? end : c->offset + c->size;
			if (random_unit() < p->bytes)
				store_bytes(&bytes, &size, c->bytes + (at - c->offset), end - at, at);
			else
				++*lost;
		}
	}
	int fd = open(path, O_WRONLY | O_CREAT | O_EXCL, 0600);
	for (uint64_t done = 0; fd >= 0 && done < size;) {
		ssize_t w = write(fd, bytes + done, size - done);
		if (w <= 0)
			abort();
		done += (uint64_t)w;
	}
	if (fd < 0 || close(fd))
		abort();
	free(bytes);
}

static void write_surviving_folder(const struct faulty_disk_node *n, const char *path, const struct odds *p,
				   uint64_t *lost)
{
	struct entry *names = copy_names(n->safe_names);
	if (mkdir(path, 0700))
		abort();
	for (const struct renaming *r = n->renamings; r; r = r->next) {
		if (random_unit() < p->names)
			apply_renaming(&names, r);
		else
			++*lost;
	}
	for (const struct entry *m = names; m; m = m->next) {
		char below[PATH_SIZE_MAX];
		snprintf(below, sizeof below, "%s/%s", path, m->text);
		if (m->node->is_folder)
			write_surviving_folder(m->node, below, p, lost);
		else
			write_surviving_file(m->node, below, p, lost);
	}
}

static void lose_power(void)
{
	static const double probabilities[] = {0, 0.1, 0.5, 0.9, 1};
	uint64_t lost = 0;
	struct odds p;
	p.bytes = probabilities[(int)(5 * random_unit())];
	p.lengths = probabilities[(int)(5 * random_unit())];
	p.names = probabilities[(int)(5 * random_unit())];
	write_surviving_folder(root_node, disk_options.remains, &p, &lost);
	atomic_fetch_add(&disk_options.counts[3], lost);
	_exit(FAULTY_DISK_EXIT_CODE);
}

void faulty_disk_power_off(void)
{
	pthread_mutex_lock(&mutex);
	lose_power();
}

int faulty_disk_begin_call(enum faulty_disk_call kind)
{
	pthread_mutex_lock(&mutex);
	atomic_store(&disk_options.counts[1], ++call_count);
	if (kind != FAULTY_DISK_READ) {
		atomic_store(&disk_options.counts[0], ++modifying_calls);
		calls_since_failure += disk_options.power_loss_after && atomic_load(&has_failed);
		if (modifying_calls == disk_options.power_loss_at ||
		    (disk_options.power_loss_after && calls_since_failure == disk_options.power_loss_after) ||
		    atomic_load(&disk_options.counts[4]))
			lose_power();
	}
	if (!disk_options.first_failing_call || call_count < disk_options.first_failing_call ||
	    call_count - disk_options.first_failing_call >= disk_options.failing_call_count)
		return 0;
	if (disk_options.fail_writes_only && kind != FAULTY_DISK_WRITE && kind != FAULTY_DISK_FLUSH)
		return 0;
	atomic_fetch_add(&disk_options.counts[2], 1);
	atomic_store(&has_failed, true);
	return disk_options.failure_errno;
}

void faulty_disk_end_call(void)
{
	pthread_mutex_unlock(&mutex);
}

/* ---- the start: everything that exists is safe */

static void load_file(struct faulty_disk_node *n, const char *path)
{
	unsigned char part[1 << 14];
	ssize_t got;
	int fd = open(path, O_RDONLY);
	while (fd >= 0 && (got = read(fd, part, sizeof part)) > 0)
		store_bytes(&n->safe_bytes, &n->safe_size, part, (uint64_t)got, n->safe_size);
	if (fd < 0 || close(fd))
		abort();
}

static void load_folder(struct faulty_disk_node *n, const char *path)
{
	DIR *d = check_allocated(opendir(path));
	for (struct dirent *f; (f = readdir(d));) {
		char below[PATH_SIZE_MAX];
		struct stat st;
		if (strcmp(f->d_name, ".") == 0 || strcmp(f->d_name, "..") == 0)
			continue;
		snprintf(below, sizeof below, "%s/%s", path, f->d_name);
		if (lstat(below, &st))
			abort();
		struct faulty_disk_node *m = node_new(S_ISDIR(st.st_mode), f->d_name);
		set_name(&n->current_names, f->d_name, m);
		set_name(&n->safe_names, f->d_name, m);
		if (m->is_folder)
			load_folder(m, below);
		else
			load_file(m, below);
	}
	closedir(d);
}

void faulty_disk_begin(const struct faulty_disk_options *options)
{
	disk_options = *options;
	if (!disk_options.counts)
		disk_options.counts = unused_counts;
	random_state = disk_options.seed;
	root_node = node_new(true, "");
	load_folder(root_node, disk_options.root);
	disk_set_calls(&faulty_disk_calls);
	faulty_disk_register_vfs();
}
