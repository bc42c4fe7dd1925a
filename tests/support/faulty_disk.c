/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A tree of names and files in memory that holds what a loss of power would leave (faulty_disk.h). Calls are carried
 * out on the real disk and recorded here: writes go into a list of changes, which a flush applies to the safe bytes;
 * names go into a list of renamings, which a flush of their folder applies. When power is lost, the safe state and a
 * random part of the rest are written to the other folder.
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

enum { SECTOR = 512, PATH_MOST = 4400 };

/* A change to a file since its last flush. */
struct change {
	struct change *next;
	uint64_t at, size;
	unsigned char *bytes; /* NULL: the file was cut to `size` */
};

struct name {
	struct name *next;
	char *text;
	struct faulty_disk_node *node;
};

/* A change to a folder since its last flush: the name `gone` was removed, the name `made` was added (either may be
 * NULL). */
struct renaming {
	struct renaming *next;
	char *gone, *made;
	struct faulty_disk_node *node;
};

struct faulty_disk_node {
	bool folder;
	char last[64];	      /* last component of its first name */
	unsigned char *bytes; /* for a file: the safe bytes */
	uint64_t size;
	struct change *changes, **changes_last;
	struct name *live, *safe; /* for a folder: its names */
	struct renaming *renamings, **renamings_last;
};

static struct faulty_disk setup;
static struct faulty_disk_node *root;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static uint64_t calls, changing_calls, since_failure, dice;
static atomic_bool failed;
static _Atomic uint64_t unasked[FAULTY_DISK_COUNTS];

static void *not_null(void *p)
{
	if (!p)
		abort();
	return p;
}

static double random_unit(void)
{
	uint64_t z = dice += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

/* ---- names ---- */

static struct faulty_disk_node *node_new(bool folder, const char *last)
{
	struct faulty_disk_node *n = not_null(calloc(1, sizeof *n));
	n->folder = folder;
	memcpy(n->last, last, strnlen(last, sizeof n->last - 1));
	n->changes_last = &n->changes;
	n->renamings_last = &n->renamings;
	return n;
}

static struct name **find(struct name **list, const char *text)
{
	while (*list && strcmp((*list)->text, text) != 0)
		list = &(*list)->next;
	return list;
}

static void forget_name(struct name **list, const char *text)
{
	struct name **at = find(list, text), *gone = *at;
	if (!gone)
		return;
	*at = gone->next;
	free(gone->text);
	free(gone);
}

static void set_name(struct name **list, const char *text, struct faulty_disk_node *node)
{
	forget_name(list, text);
	struct name *n = not_null(malloc(sizeof *n));
	*n = (struct name){*list, not_null(strdup(text)), node};
	*list = n;
}

static struct name *copy_names(const struct name *from)
{
	struct name *list = NULL;
	for (; from; from = from->next)
		set_name(&list, from->text, from->node);
	return list;
}

static void apply_renaming(struct name **list, const struct renaming *r)
{
	if (r->gone)
		forget_name(list, r->gone);
	if (r->made)
		set_name(list, r->made, r->node);
}

static void rename_in(struct faulty_disk_node *folder, const char *gone, const char *made,
		      struct faulty_disk_node *node)
{
	struct renaming *r = not_null(calloc(1, sizeof *r));
	*r = (struct renaming){NULL, gone ? not_null(strdup(gone)) : NULL, made ? not_null(strdup(made)) : NULL, node};
	apply_renaming(&folder->live, r);
	*folder->renamings_last = r;
	folder->renamings_last = &r->next;
}

/* Returns the folder that contains the path's last component; NULL: the path is not below the root, or there is no
 * such folder. */
static struct faulty_disk_node *parent_of(const char *path, const char **last)
{
	size_t n = strlen(setup.root);
	if (strncmp(path, setup.root, n) != 0 || (path[n] && path[n] != '/'))
		return NULL;
	struct faulty_disk_node *at = root;
	const char *part = path + n;
	for (;;) {
		char text[256];
		while (*part == '/')
			part++;
		size_t size = strcspn(part, "/");
		if (!part[size] || !part[size + strspn(part + size, "/")]) {
			*last = part;
			return at;
		}
		assert(size < sizeof text);
		memcpy(text, part, size);
		text[size] = 0;
		struct name *next = *find(&at->live, text);
		if (!next || !next->node->folder)
			return NULL;
		at = next->node;
		part += size;
	}
}

static struct faulty_disk_node *node_at(const char *path, bool create, bool folder)
{
	const char *last;
	struct faulty_disk_node *in = parent_of(path, &last);
	if (!in || !*last)
		return in;
	struct name *n = *find(&in->live, last);
	if (n || !create)
		return n ? n->node : NULL;
	struct faulty_disk_node *made = node_new(folder, last);
	rename_in(in, NULL, last, made);
	return made;
}

struct faulty_disk_node *faulty_disk_node_of(const char *path, bool create)
{
	return node_at(path, create, false);
}

void faulty_disk_made_folder(const char *path)
{
	node_at(path, true, true);
}

void faulty_disk_renamed(const char *from, const char *to)
{
	const char *gone, *made;
	struct faulty_disk_node *a = parent_of(from, &gone), *b = parent_of(to, &made);
	if (!a)
		return;
	struct name *n = *find(&a->live, gone);
	assert(n && b);
	if (a != b) { /* the folders are separate: one of them may keep its change while the other does not */
		rename_in(b, NULL, made, n->node);
		rename_in(a, gone, NULL, NULL);
	} else {
		rename_in(a, gone, made, n->node);
	}
}

/* ---- what a flush makes safe ---- */

static void resize(unsigned char **bytes, uint64_t *size, uint64_t want)
{
	*bytes = not_null(realloc(*bytes, want + 1));
	if (want > *size)
		memset(*bytes + *size, 0, want - *size);
	*size = want;
}

static void write_at(unsigned char **bytes, uint64_t *size, const void *from, uint64_t n, uint64_t at)
{
	if (at + n > *size)
		resize(bytes, size, at + n);
	if (n)
		memcpy(*bytes + at, from, n);
}

static bool is_forgotten(const struct faulty_disk_node *n, enum faulty_disk_forget kind)
{
	return (setup.forget & kind) &&
	       (!setup.forget_name || strncmp(n->last, setup.forget_name, strlen(setup.forget_name)) == 0);
}

void faulty_disk_flushed(struct faulty_disk_node *n, bool database)
{
	if (!n || is_forgotten(n, database    ? FAULTY_DISK_FORGET_DATABASE
				  : n->folder ? FAULTY_DISK_FORGET_FOLDERS
					      : FAULTY_DISK_FORGET_FILES))
		return;
	for (struct change *c; (c = n->changes);) {
		n->changes = c->next;
		if (c->bytes)
			write_at(&n->bytes, &n->size, c->bytes, c->size, c->at);
		else
			resize(&n->bytes, &n->size, c->size);
		free(c->bytes);
		free(c);
	}
	n->changes_last = &n->changes;
	for (struct renaming *r; (r = n->renamings);) {
		n->renamings = r->next;
		apply_renaming(&n->safe, r);
		free(r->gone);
		free(r->made);
		free(r);
	}
	n->renamings_last = &n->renamings;
}

void faulty_disk_failed(struct faulty_disk_node *n)
{
	while (n && !n->folder && n->changes) {
		struct change *c = n->changes;
		n->changes = c->next;
		free(c->bytes);
		free(c);
	}
	if (n && !n->folder)
		n->changes_last = &n->changes;
}

void faulty_disk_flushed_folder_of(const char *path)
{
	const char *last;
	faulty_disk_flushed(parent_of(path, &last), true);
}

static void add_change(struct faulty_disk_node *n, const void *bytes, uint64_t size, uint64_t at)
{
	struct change *c = not_null(calloc(1, sizeof *c));
	c->at = at;
	c->size = size;
	if (bytes) {
		c->bytes = not_null(malloc(size + 1));
		memcpy(c->bytes, bytes, size);
	}
	*n->changes_last = c;
	n->changes_last = &c->next;
}

void faulty_disk_wrote(struct faulty_disk_node *n, const void *bytes, size_t size, uint64_t at)
{
	if (n && size)
		add_change(n, bytes, size, at);
}

void faulty_disk_cut(struct faulty_disk_node *n, uint64_t size)
{
	if (n)
		add_change(n, NULL, size, 0);
}

void faulty_disk_removed(const char *path)
{
	const char *last;
	struct faulty_disk_node *in = parent_of(path, &last);
	if (in)
		rename_in(in, last, NULL, NULL);
}

/* ---- loss of power ---- */

struct odds {
	double bytes, lengths, names; /* probabilities that unflushed changes survive */
};

static void write_out(const struct faulty_disk_node *n, const char *path, const struct odds *p, uint64_t *lost)
{
	unsigned char *bytes = NULL;
	uint64_t size = 0;
	write_at(&bytes, &size, n->bytes ? n->bytes : (const unsigned char *)"", n->size, 0);
	for (const struct change *c = n->changes; c; c = c->next) {
		if (!c->bytes) {
			if (random_unit() < p->lengths)
				resize(&bytes, &size, c->size);
			continue;
		}
		if (random_unit() < p->lengths && c->at + c->size > size)
			resize(&bytes, &size, c->at + c->size);
		for (uint64_t at = c->at, end; at < c->at + c->size; at = end) {
			end = at / SECTOR * SECTOR + SECTOR;
			end = end < c->at + c->size ? end : c->at + c->size;
			if (random_unit() < p->bytes)
				write_at(&bytes, &size, c->bytes + (at - c->at), end - at, at);
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

static void write_folder(const struct faulty_disk_node *n, const char *path, const struct odds *p, uint64_t *lost)
{
	struct name *names = copy_names(n->safe);
	if (mkdir(path, 0700))
		abort();
	for (const struct renaming *r = n->renamings; r; r = r->next) {
		if (random_unit() < p->names)
			apply_renaming(&names, r);
		else
			++*lost;
	}
	for (const struct name *m = names; m; m = m->next) {
		char below[PATH_MOST];
		snprintf(below, sizeof below, "%s/%s", path, m->text);
		if (m->node->folder)
			write_folder(m->node, below, p, lost);
		else
			write_out(m->node, below, p, lost);
	}
}

static void lose_power(void)
{
	static const double shares[] = {0, 0.1, 0.5, 0.9, 1};
	uint64_t lost = 0;
	struct odds p;
	p.bytes = shares[(int)(5 * random_unit())];
	p.lengths = shares[(int)(5 * random_unit())];
	p.names = shares[(int)(5 * random_unit())];
	write_folder(root, setup.after, &p, &lost);
	atomic_fetch_add(&setup.counts[3], lost);
	_exit(FAULTY_DISK_EXIT);
}

void faulty_disk_power_off(void)
{
	pthread_mutex_lock(&mutex);
	lose_power();
}

int faulty_disk_enter(enum faulty_disk_call what)
{
	pthread_mutex_lock(&mutex);
	atomic_store(&setup.counts[1], ++calls);
	if (what != FAULTY_DISK_READS) {
		atomic_store(&setup.counts[0], ++changing_calls);
		since_failure += setup.lose_after && atomic_load(&failed);
		if (changing_calls == setup.lose_at || (setup.lose_after && since_failure == setup.lose_after) ||
		    atomic_load(&setup.counts[4]))
			lose_power();
	}
	if (!setup.fail_from || calls < setup.fail_from || calls - setup.fail_from >= setup.fail_count)
		return 0;
	if (setup.fail_writes_only && what != FAULTY_DISK_WRITES && what != FAULTY_DISK_FLUSHES)
		return 0;
	atomic_fetch_add(&setup.counts[2], 1);
	atomic_store(&failed, true);
	return setup.fail_with;
}

void faulty_disk_leave(void)
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
		write_at(&n->bytes, &n->size, part, (uint64_t)got, n->size);
	if (fd < 0 || close(fd))
		abort();
}

static void load_folder(struct faulty_disk_node *n, const char *path)
{
	DIR *d = not_null(opendir(path));
	for (struct dirent *f; (f = readdir(d));) {
		char below[PATH_MOST];
		struct stat st;
		if (strcmp(f->d_name, ".") == 0 || strcmp(f->d_name, "..") == 0)
			continue;
		snprintf(below, sizeof below, "%s/%s", path, f->d_name);
		if (lstat(below, &st))
			abort();
		struct faulty_disk_node *m = node_new(S_ISDIR(st.st_mode), f->d_name);
		set_name(&n->live, f->d_name, m);
		set_name(&n->safe, f->d_name, m);
		if (m->folder)
			load_folder(m, below);
		else
			load_file(m, below);
	}
	closedir(d);
}

void faulty_disk_begin(const struct faulty_disk *l)
{
	setup = *l;
	if (!setup.counts)
		setup.counts = unasked;
	dice = setup.seed;
	root = node_new(true, "");
	load_folder(root, setup.root);
	disk_use(&faulty_disk_calls);
	faulty_disk_vfs_begin();
}
