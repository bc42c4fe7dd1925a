/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Encodes an image (colours, errors and R-hat as planes) and writes image files. The bytes go to a temporary file
 * beside the target, which is flushed and renamed, so that the target is either the old file or the complete new one.
 * Targets that are not regular files (pipes, devices, descriptors) are written directly.
 *
 * Failures are sentences that name the path: a missing folder, no space, no permission. The temporary file is removed.
 */
#include "common/exr/image_file.h"

#include "common/base/io.h"
#include "common/base/mem.h"
#include "common/base/output_target.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };
#define FILE_SIZE_MAX (INT64_C(1) << 32)

static int add_planes(struct exr_image *out, const float *rgb, const char *prefix)
{
	size_t pixels = (size_t)out->width * out->height;
	for (size_t c = 0; c < 3; c++) {
		float *plane = mem_alloc(pixels, sizeof *plane);
		if (!plane)
			return -ENOMEM;
		for (size_t i = 0; i < pixels; i++)
			plane[i] = rgb[i * 3 + c];
		snprintf(out->channel_names[out->channel_count], sizeof out->channel_names[0], "%s%c", prefix,
			 "RGB"[c]);
		out->planes[out->channel_count++] = plane;
	}
	return 0;
}

static int add_r_hat(struct exr_image *out, const struct canvas_image *img)
{
	float *plane = mem_alloc((size_t)out->width * out->height, sizeof *plane);
	if (!plane)
		return -ENOMEM;
	for (size_t y = 0; y < out->height; y++)
		for (size_t x = 0; x < out->width; x++) {
			float r_hat = img->r_hat[y / TILE_SIZE * img->tiles_across + x / TILE_SIZE];
			plane[y * out->width + x] = isnan(r_hat) ? 0 : r_hat;
		}
	snprintf(out->channel_names[out->channel_count], sizeof out->channel_names[0], "rhat.Y");
	out->planes[out->channel_count++] = plane;
	return 0;
}

int image_file_encode(const struct canvas_image *img, const struct plan *p, const struct header_extra *x,
		      unsigned char **bytes, size_t *size, struct error *e)
{
	struct exr_image out = {.width = img->width,
				.height = img->height,
				.full_width = p->width,
				.full_height = p->height,
				.x = p->crop_x,
				.y = p->crop_y};
	struct header *h = mem_alloc(1, sizeof *h);
	int rc = h ? add_planes(&out, img->rgb, "") : -ENOMEM;
	if (rc == 0 && img->error)
		rc = add_planes(&out, img->error, "error.");
	if (rc == 0 && img->r_hat)
		rc = add_r_hat(&out, img);
	if (rc) {
		error_set(e, ENOMEM, "no memory for the image's file");
	} else {
		header_fill(h, img, p, x);
		out.attributes = h->attributes;
		out.attribute_count = h->count;
		rc = exr_write(&out, bytes, size, e);
	}
	out.attributes = NULL; /* part of h, so exr_image_fini must not free them */
	exr_image_fini(&out);
	mem_free(h);
	return rc;
}

static int set_file_error(struct error *e, const char *path, const char *action)
{
	int code = errno;
	return error_set(e, code, "%s: cannot %s: %s", output_target_display_name(path), action, strerror(code));
}

/* Flushes the folder of `path`, so that a new name survives a crash. Failures are ignored: the image is written. */
static void sync_folder(const char *path)
{
	char folder[PATH_SIZE];
	const char *slash = strrchr(path, '/');
	int n = slash ? snprintf(folder, sizeof folder, "%.*s/", (int)(slash - path), path)
		      : snprintf(folder, sizeof folder, ".");
	int fd = n > 0 ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
	if (fd < 0)
		return;
	fsync(fd);
	close(fd);
}

/* Creates a temporary file beside `path`. Returns its descriptor or -errno. */
static int create_temporary(const char *path, char temporary[PATH_SIZE], struct error *e)
{
	int n = snprintf(temporary, PATH_SIZE, "%s.XXXXXX", path);
	if (n < 0 || n >= PATH_SIZE)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", path);
	int fd = mkostemp(temporary, O_CLOEXEC);
	return fd < 0 ? set_file_error(e, path, "write there") : fd;
}

int image_file_probe(const char *path, struct error *e)
{
	char temporary[PATH_SIZE];
	struct output_target t;
	int rc = output_target_resolve(&t, path, e);
	if (rc)
		return rc;
	if (t.writes_directly)
		return t.fd < 0 && access(t.path, W_OK) ? set_file_error(e, path, "write there") : 0;
	int fd = create_temporary(t.path, temporary, e);
	if (fd < 0)
		return fd;
	close(fd);
	unlink(temporary);
	return 0;
}

static int write_directly(const struct output_target *t, const char *path, const unsigned char *bytes, size_t size,
			  struct error *e)
{
	int fd = output_target_open(t, e);
	if (fd < 0)
		return fd;
	int rc = io_write_all(fd, bytes, size) ? set_file_error(e, path, "write") : 0;
	if (close(fd) && !rc)
		rc = set_file_error(e, path, "write");
	return rc;
}

static int replace_file(const char *path, const unsigned char *bytes, size_t size, struct error *e)
{
	char temporary[PATH_SIZE];
	int fd = create_temporary(path, temporary, e);
	if (fd < 0)
		return fd;
	mode_t mask = umask(0);
	umask(mask);
	int rc = io_write_all(fd, bytes, size) != 0 || fsync(fd) != 0 || fchmod(fd, 0666 & ~mask) != 0
			 ? set_file_error(e, path, "write")
			 : 0;
	if (close(fd) != 0 && rc == 0)
		rc = set_file_error(e, path, "write");
	if (rc == 0 && rename(temporary, path) != 0)
		rc = set_file_error(e, path, "put the file in place");
	if (rc)
		unlink(temporary);
	else
		sync_folder(path);
	return rc;
}

int image_file_write(const char *path, const unsigned char *bytes, size_t size, struct error *e)
{
	struct output_target t;
	int rc = output_target_resolve(&t, path, e);
	if (rc)
		return rc;
	return t.writes_directly ? write_directly(&t, path, bytes, size, e) : replace_file(t.path, bytes, size, e);
}

/* Reads a pipe to its end. *bytes is to be freed also after a failure. */
static int read_stream(int fd, const char *path, unsigned char **bytes, size_t *size, struct error *e)
{
	size_t capacity = 0;
	*bytes = NULL;
	*size = 0;
	for (;;) {
		if (*size == capacity) {
			size_t new_capacity = capacity ? 2 * capacity : 1 << 16;
			unsigned char *grown =
				new_capacity <= (size_t)FILE_SIZE_MAX ? mem_grow(*bytes, capacity, new_capacity) : NULL;
			if (!grown)
				return error_set(e, ENOMEM, "%s: no memory for it, or more than 4 GiB", path);
			*bytes = grown;
			capacity = new_capacity;
		}
		ssize_t n = io_read_all(fd, *bytes + *size, capacity - *size);
		if (n < 0)
			return set_file_error(e, path, "read");
		*size += (size_t)n;
		if (*size < capacity)
			return 0;
	}
}

static int read_regular(int fd, const struct stat *st, const char *path, unsigned char **bytes, size_t *size,
			struct error *e)
{
	*bytes = mem_alloc((size_t)st->st_size, 1);
	if (!*bytes)
		return error_set(e, ENOMEM, "%s: no memory for it", path);
	ssize_t n = io_read_all(fd, *bytes, (size_t)st->st_size);
	if (n < 0)
		return set_file_error(e, path, "read");
	*size = (size_t)n;
	return 0;
}

int image_file_read(const char *path, unsigned char **bytes, size_t *size, struct error *e)
{
	struct stat st;
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return set_file_error(e, path, "open");
	int rc;
	*bytes = NULL;
	if (fstat(fd, &st) != 0)
		rc = set_file_error(e, path, "read");
	else if (S_ISFIFO(st.st_mode) || S_ISSOCK(st.st_mode))
		rc = read_stream(fd, path, bytes, size, e);
	else if (!S_ISREG(st.st_mode) || st.st_size > FILE_SIZE_MAX)
		rc = error_set(e, EINVAL, "%s: not a pipe, and not a regular file of at most 4 GiB", path);
	else
		rc = read_regular(fd, &st, path, bytes, size, e);
	close(fd);
	if (rc) {
		mem_free(*bytes);
		*bytes = NULL;
	}
	return rc;
}
