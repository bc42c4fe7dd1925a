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
enum { MARK_SIZE = 24, LENGTH_OFFSET = 20 };

static int checksum_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct kept_bootstrap *k = user;
	int rc = k->inner->open(k->inner->user, name, out, e);
	if (rc)
		return rc;
	k->files_crc = crc32c(crc32c(k->files_crc, name, strlen(name) + 1), out->bytes, out->size);
	k->files_bytes += out->size;
	return 0;
}

static void checksum_close(void *user, struct asset *a)
{
	struct kept_bootstrap *k = user;
	k->inner->close(k->inner->user, a);
}

struct asset_source kept_bootstrap_source(struct kept_bootstrap *k, const struct asset_source *inner)
{
	k->inner = inner;
	return (struct asset_source){
		.user = k, .open = checksum_open, .close = checksum_close, .picture_cache = inner->picture_cache};
}

static void add_text(struct kept_bootstrap *k, const char *text, const char *end)
{
	size_t n = strlen(k->identity_text);
	if ((size_t)snprintf(k->identity_text + n, sizeof k->identity_text - n, "%s%s", text, end) >=
	    sizeof k->identity_text - n)
		k->path[0] = 0; /* the text does not fit, so nothing is kept */
}

void kept_bootstrap_begin(struct kept_bootstrap *k, const char *image, const char *fingerprint, const struct plan *p,
			  const struct render_arguments *a)
{
	char options[PLAN_TEXT_MAX], counts[128];
	bool is_file = image && strncmp(image, "/dev/", 5) != 0;
	int n = is_file ? snprintf(k->path, sizeof k->path, "%s.bootstrap", image) : -1;
	if (n < 0 || (size_t)n >= sizeof k->path - sizeof ".new")
		k->path[0] = 0;
	plan_print_options(p, 1, options, sizeof options);
	snprintf(counts, sizeof counts, "%u groups of %u parts, %llu samples", p->groups, p->parts,
		 (unsigned long long)p->bootstrap);
	k->identity_text[0] = 0;
	add_text(k, fingerprint, "\n");
	add_text(k, options, "\n");
	add_text(k, counts, "\n");
	for (size_t i = 0; i < a->define_count; i++) {
		add_text(k, a->defines[i].name, "=");
		add_text(k, a->defines[i].value, "\n");
	}
}

/* Writes the part of the file before the identity text. */
static void pack_mark(const struct kept_bootstrap *k, unsigned char bytes[MARK_SIZE])
{
	memcpy(bytes, magic, sizeof magic);
	put32(bytes + 8, k->files_crc);
	put64(bytes + 12, k->files_bytes);
	put32(bytes + LENGTH_OFFSET, (uint32_t)strlen(k->identity_text));
}

static int read_mark(const struct kept_bootstrap *k, struct checked_file *f, struct error *e)
{
	unsigned char mark[MARK_SIZE], expected[MARK_SIZE];
	char text[KEPT_TEXT_SIZE];
	pack_mark(k, expected);
	int rc = checked_file_read(f, mark, sizeof mark, e);
	if (rc)
		return rc;
	uint32_t length = get32(mark + LENGTH_OFFSET);
	if (memcmp(mark, magic, sizeof magic) != 0 || length > sizeof text)
		return error_set(e, EBADMSG, "not a kept bootstrap");
	rc = checked_file_read(f, text, length, e);
	if (!rc && (memcmp(mark, expected, MARK_SIZE) != 0 || memcmp(text, k->identity_text, length) != 0))
		rc = error_set(e, ESTALE, "it is of another plan, scene, program or machine");
	return rc;
}

/* Whether the file begins like a kept bootstrap. */
static bool is_kept_bootstrap(const char *path)
{
	char begin[sizeof magic];
	FILE *f = fopen(path, "rb");
	bool matches = f && fread(begin, sizeof begin, 1, f) == 1 && memcmp(begin, magic, sizeof magic) == 0;
	if (f)
		fclose(f);
	return matches;
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
	uint32_t missing_before = bootstrap_missing_count(b);
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
			rc = checked_file_expect_end(&f, &e);
		checked_file_close(&f);
	}
	k->was_resumed = bootstrap_missing_count(b) < missing_before;
	k->is_damaged = rc == -EBADMSG && is_kept_bootstrap(k->path);
	if (rc)
		snprintf(text, size, "%.300s is not used: %.128s", k->path, without_path(&e, k->path));
	else
		snprintf(text, size, "continues from %u of %u leases of the bootstrap, kept in %.300s",
			 missing_before - bootstrap_missing_count(b), missing_before, k->path);
}

static int write_file(const struct kept_bootstrap *k, const char *path, const struct bootstrap *b, struct error *e)
{
	struct checked_file f;
	unsigned char mark[MARK_SIZE];
	int rc = checked_file_create(&f, path, e);
	if (rc)
		return rc;
	pack_mark(k, mark);
	rc = checked_file_write(&f, mark, sizeof mark, e);
	if (!rc)
		rc = checked_file_write(&f, k->identity_text, strlen(k->identity_text), e);
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
	char path[KEPT_PATH_SIZE];
	struct error e;
	uint32_t done = bootstrap_added_count(b);
	if (done == 0)
		snprintf(
			k->message, sizeof k->message,
			"; nothing is kept: of the %u leases of the bootstrap none was finished, which smaller ones are "
			"sooner (more --parts, or a smaller --bootstrap)",
			bootstrap_missing_count(b));
	else if (!k->path[0])
		snprintf(k->message, sizeof k->message,
			 "; nothing is kept: the bootstrap can be only beside an image in a file (-o)");
	if (done == 0 || !k->path[0])
		return;
	snprintf(path, sizeof path, "%.*s.new", KEPT_PATH_SIZE - 8, k->path);
	if (write_file(k, path, b, &e))
		snprintf(k->message, sizeof k->message, "; the bootstrap could not be kept: %.300s", e.text);
	else
		snprintf(k->message, sizeof k->message,
			 "; %u of %u leases of the bootstrap are kept in %s, and the same command continues from them",
			 done, done + bootstrap_missing_count(b), k->path);
}

void kept_bootstrap_end(const struct kept_bootstrap *k)
{
	if (k->was_resumed || k->is_damaged)
		unlink(k->path);
}
