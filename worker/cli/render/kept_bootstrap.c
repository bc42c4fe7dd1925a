/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file consists of a mark and a text, which identify the command that it belongs to, and the data of
 * bootstrap_save. The whole file is read and checked before anything in it is used (checked_file.h). It is written
 * under another name and renamed when it is complete.
 *
 * No failure here ends the render: a file that does not match or is damaged is not used, and a failure to write is
 * reported.
 */
#include "worker/cli/render/kept_bootstrap.h"

#include "common/base/bytes.h"
#include "common/base/crc.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char magic[8] = "HSLTBOO1";
enum { MARK = 24, AT_LENGTH = 20 };

static int marking_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct kept_bootstrap *k = user;
	int rc = k->inner->open(k->inner->user, name, out, e);
	if (rc)
		return rc;
	k->crc = crc32c(crc32c(k->crc, name, strlen(name) + 1), out->bytes, out->size);
	k->bytes += out->size;
	return 0;
}

static void marking_close(void *user, struct asset *a)
{
	struct kept_bootstrap *k = user;
	k->inner->close(k->inner->user, a);
}

struct asset_source kept_bootstrap_source(struct kept_bootstrap *k, const struct asset_source *inner)
{
	k->inner = inner;
	return (struct asset_source){
		.user = k, .open = marking_open, .close = marking_close, .decoded = inner->decoded};
}

static void add_text(struct kept_bootstrap *k, const char *text, const char *end)
{
	size_t n = strlen(k->text);
	if ((size_t)snprintf(k->text + n, sizeof k->text - n, "%s%s", text, end) >= sizeof k->text - n)
		k->path[0] = 0; /* the text does not fit, so nothing is kept */
}

void kept_bootstrap_begin(struct kept_bootstrap *k, const char *image, const char *fingerprint, const struct plan *p,
			  const struct render_arguments *a)
{
	char options[PLAN_TEXT], counts[128];
	bool is_file = image && strncmp(image, "/dev/", 5) != 0;
	int n = is_file ? snprintf(k->path, sizeof k->path, "%s.bootstrap", image) : -1;
	if (n < 0 || (size_t)n >= sizeof k->path - sizeof ".new")
		k->path[0] = 0;
	plan_options(p, 1, options, sizeof options);
	snprintf(counts, sizeof counts, "%u groups of %u parts, %llu samples", p->groups, p->parts,
		 (unsigned long long)p->bootstrap);
	k->text[0] = 0;
	add_text(k, fingerprint, "\n");
	add_text(k, options, "\n");
	add_text(k, counts, "\n");
	for (size_t i = 0; i < a->define_count; i++) {
		add_text(k, a->defines[i].name, "=");
		add_text(k, a->defines[i].value, "\n");
	}
}

/* Writes the part of the file before the text. */
static void pack_mark(const struct kept_bootstrap *k, unsigned char bytes[MARK])
{
	memcpy(bytes, magic, sizeof magic);
	put32(bytes + 8, k->crc);
	put64(bytes + 12, k->bytes);
	put32(bytes + AT_LENGTH, (uint32_t)strlen(k->text));
}

static int read_mark(const struct kept_bootstrap *k, struct checked_file *f, struct error *e)
{
	unsigned char mark[MARK], want[MARK];
	char text[KEPT_TEXT];
	pack_mark(k, want);
	int rc = checked_file_read(f, mark, sizeof mark, e);
	if (rc)
		return rc;
	uint32_t length = get32(mark + AT_LENGTH);
	if (memcmp(mark, magic, sizeof magic) != 0 || length > sizeof text)
		return error_set(e, EBADMSG, "not a kept bootstrap");
	rc = checked_file_read(f, text, length, e);
	if (!rc && (memcmp(mark, want, MARK) != 0 || memcmp(text, k->text, length) != 0))
		rc = error_set(e, ESTALE, "it is of another plan, scene, program or machine");
	return rc;
}

/* Whether the file begins like a kept bootstrap. */
static bool is_ours(const char *path)
{
	char begin[sizeof magic];
	FILE *f = fopen(path, "rb");
	bool ours = f && fread(begin, sizeof begin, 1, f) == 1 && memcmp(begin, magic, sizeof magic) == 0;
	if (f)
		fclose(f);
	return ours;
}

/* Returns the error's sentence without the path at its beginning. */
static const char *without_path(const struct error *e, const char *path)
{
	size_t n = strlen(path);
	return strncmp(e->text, path, n) == 0 && strncmp(e->text + n, ": ", 2) == 0 ? e->text + n + 2 : e->text;
}

/* Leases that bootstrap_load has added before it fails stay in the bootstrap: each was checked. */
void kept_bootstrap_resume(struct kept_bootstrap *k, struct bootstrap *b, char *text, size_t size)
{
	struct checked_file f;
	struct error e;
	uint32_t all = bootstrap_missing(b);
	text[0] = 0;
	if (!k->path[0])
		return;
	int rc = checked_file_open(&f, k->path, &e);
	if (rc == -ENOENT)
		return;
	if (!rc) {
		rc = read_mark(k, &f, &e);
		if (!rc)
			rc = bootstrap_load(b, &f, &e);
		if (!rc)
			rc = checked_file_end(&f, &e);
		checked_file_close(&f);
	}
	k->resumed = bootstrap_missing(b) < all;
	k->damaged = rc == -EBADMSG && is_ours(k->path);
	if (rc)
		snprintf(text, size, "%.300s is not used: %.128s", k->path, without_path(&e, k->path));
	else
		snprintf(text, size, "continues from %u of %u leases of the bootstrap, kept in %.300s",
			 all - bootstrap_missing(b), all, k->path);
}

static int write_file(const struct kept_bootstrap *k, const char *path, const struct bootstrap *b, struct error *e)
{
	struct checked_file f;
	unsigned char mark[MARK];
	int rc = checked_file_create(&f, path, e);
	if (rc)
		return rc;
	pack_mark(k, mark);
	rc = checked_file_write(&f, mark, sizeof mark, e);
	if (!rc)
		rc = checked_file_write(&f, k->text, strlen(k->text), e);
	if (!rc)
		rc = bootstrap_save(b, &f, e);
	if (!rc)
		rc = checked_file_finish(&f, e);
	checked_file_close(&f);
	if (!rc && rename(path, k->path))
		rc = error_set(e, errno, "%.300s: %s", k->path, strerror(errno));
	if (rc)
		unlink(path);
	return rc;
}

void kept_bootstrap_write(struct kept_bootstrap *k, const struct bootstrap *b)
{
	char path[KEPT_PATH];
	struct error e;
	uint32_t done = bootstrap_done(b);
	if (done == 0)
		snprintf(
			k->said, sizeof k->said,
			"; nothing is kept: of the %u leases of the bootstrap none was finished, which smaller ones are "
			"sooner (more --parts, or a smaller --bootstrap)",
			bootstrap_missing(b));
	else if (!k->path[0])
		snprintf(k->said, sizeof k->said,
			 "; nothing is kept: the bootstrap can be only beside an image in a file (-o)");
	if (done == 0 || !k->path[0])
		return;
	snprintf(path, sizeof path, "%.*s.new", KEPT_PATH - 8, k->path);
	if (write_file(k, path, b, &e))
		snprintf(k->said, sizeof k->said, "; the bootstrap could not be kept: %.300s", e.text);
	else
		snprintf(k->said, sizeof k->said,
			 "; %u of %u leases of the bootstrap are kept in %s, and the same command continues from them",
			 done, done + bootstrap_missing(b), k->path);
}

void kept_bootstrap_end(const struct kept_bootstrap *k)
{
	if (k->resumed || k->damaged)
		unlink(k->path);
}
