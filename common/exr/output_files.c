/* SPDX-License-Identifier: Apache-2.0 */
/*
 * For each output, in order: its path is resolved through links to a device and inode or, if there is no such file yet,
 * to a path without links (identify_file); it must differ from the inputs and from the outputs before it; an existing
 * file must have the output's format, judged by its first bytes; the extension must suit the format; and a file must be
 * possible to create there.
 *
 * The first violation is the error. Nothing has been written by then.
 */
#include "common/exr/output_files.h"

#include "common/base/picture_name.h"
#include "common/base/spelling.h"
#include "common/base/output_target.h"
#include "common/exr/image_file.h"

#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BEGINNING_SIZE = 1024 };

static bool is_exr(const char *begin)
{
	return memcmp(begin, "\x76\x2f\x31\x01", 4) == 0;
}

static bool is_png(const char *begin)
{
	return memcmp(begin, "\x89PNG\r\n\x1a\n", 8) == 0;
}

static bool is_svg(const char *begin)
{
	return strstr(begin, "<svg") != NULL;
}

static bool is_html(const char *begin)
{
	return strncasecmp(begin, "<!doctype html", 14) == 0;
}

/* hslt-accuracy's tables begin with the title of their first column. */
static bool is_csv(const char *begin)
{
	return strncmp(begin, "setting,", 8) == 0;
}

static bool is_json(const char *begin)
{
	return *begin == '{' && strncmp(begin + 1 + strspn(begin + 1, " \t\r\n"), "\"schema\"", 8) == 0;
}

static const struct {
	const char *noun, *extension;
	/* BEGINNING_SIZE bytes, zeros after the end of the file, and a final zero */
	bool (*has_format)(const char *begin);
} formats[] = {
	[OUTPUT_EXR] = {"an OpenEXR file", ".exr", is_exr},
	[OUTPUT_PNG] = {"a PNG file", ".png", is_png},
	[OUTPUT_SVG] = {"an SVG file", ".svg", is_svg},
	[OUTPUT_HTML] = {"an HTML file", ".html", is_html},
	[OUTPUT_CSV] = {"a table of hslt-accuracy", ".csv", is_csv},
	[OUTPUT_JSON] = {"a file of statistics", ".json", is_json},
};

/* Identifies a file: by device and inode if it exists, otherwise by its path without links. */
struct file_identity {
	bool exists, is_regular,
		is_stream; /* is_stream: bytes of two outputs would be mixed in it: a pipe, or a descriptor */
	dev_t device;
	ino_t inode;
	char path[PATH_MAX + OUTPUT_TARGET_PATH_MAX];
};

/* Sets the path of a file that does not exist: its folder without links, then its name. If the folder does not exist
 * either, the path stays as it is; image_file_probe will report that. */
static void identify_new_file(struct file_identity *p, const char *path)
{
	char folder[OUTPUT_TARGET_PATH_MAX], real[PATH_MAX];
	const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
	snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
	snprintf(p->path, sizeof p->path, "%s/%s", realpath(folder, real) ? real : folder, name);
}

static int identify_file(struct file_identity *p, const char *path, struct error *e)
{
	struct stat st;
	struct output_target t;
	*p = (struct file_identity){0};
	int rc = output_target_resolve(&t, path, e);
	if (rc)
		return rc;
	if (t.fd >= 0 ? fstat(t.fd, &st) : stat(t.path, &st)) {
		identify_new_file(p, t.path);
		return 0;
	}
	p->exists = true;
	p->is_regular = S_ISREG(st.st_mode);
	p->is_stream = S_ISFIFO(st.st_mode) || S_ISSOCK(st.st_mode) || (t.fd >= 0 && !S_ISCHR(st.st_mode));
	p->device = st.st_dev;
	p->inode = st.st_ino;
	return 0;
}

static bool is_same_file(const struct file_identity *a, const struct file_identity *b)
{
	if (a->exists != b->exists)
		return false;
	if (!a->exists)
		return strcmp(a->path, b->path) == 0;
	bool mixes = (a->is_regular && b->is_regular) || (a->is_stream && b->is_stream);
	return mixes && a->device == b->device && a->inode == b->inode;
}

/* Two outputs on one pipe would be mixed up, although pipes are not regular files and pass is_same_file. */
static bool are_both_stdout(const char *a, const char *b)
{
	return strcmp(a, TARGET_STDOUT) == 0 && strcmp(b, TARGET_STDOUT) == 0;
}

static int refuse_input(const struct output_file *f, const char *input, struct error *e)
{
	return error_set(e, EINVAL, "%s %s would replace %s, which is an input", f->option, f->path, input);
}

static int check_inputs(const struct output_file *f, const struct file_identity *p, const char *const *inputs,
			size_t count, struct error *e)
{
	for (size_t i = 0; p->is_regular && i < count; i++) {
		struct stat st;
		if (inputs[i] && stat(inputs[i], &st) == 0 && st.st_dev == p->device && st.st_ino == p->inode)
			return refuse_input(f, inputs[i], e);
	}
	return 0;
}

/* A plot's format is chosen by its extension, so there must be a known one. */
static int check_plot(const char *option, const char *path, struct error *e)
{
	char hint[40];
	const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
	struct spelling s = {.wanted_name = dot ? dot : ""};
	if (strcasecmp(s.wanted_name, ".svg") == 0)
		return 0;
	spelling_offer(&s, ".svg");
	spelling_offer(&s, ".png");
	return error_set(e, EINVAL, "%s %s: a plot is written as .svg or .png%s", option, path,
			 spelling_hint(&s, hint, sizeof hint));
}

static int check_name(const struct output_file *f, struct error *e)
{
	if (f->format == OUTPUT_SVG)
		return check_plot(f->option, f->path, e);
	const char *named_format = picture_name_format(f->path), *extension = formats[f->format].extension;
	if (!named_format || strcmp(named_format, extension) == 0)
		return 0;
	return error_set(e, EINVAL, "%s %s: %s is written, so the name should end in %s%s", f->option, f->path,
			 formats[f->format].noun, extension,
			 f->format == OUTPUT_EXR ? "; hslt-tonemap converts it to PNG" : "");
}

int output_files_check_names(const struct output_files *o, struct error *e)
{
	int rc = 0;
	for (size_t i = 0; !rc && i < OUTPUT_FILES_MAX; i++)
		rc = o->files[i].path ? check_name(&o->files[i], e) : 0;
	return rc;
}

/* Refuses an existing file of another format. A file that cannot be read passes: its format is not known. */
static int check_format(const struct output_file *f, struct error *e)
{
	char begin[BEGINNING_SIZE + 1] = "";
	struct output_target t;
	int rc = output_target_resolve(&t, f->path, e);
	if (rc || t.writes_directly)
		return rc;
	int fd = open(t.path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (fd < 0)
		return 0;
	ssize_t n = read(fd, begin, BEGINNING_SIZE);
	close(fd);
	if (n <= 0 || formats[f->format].has_format(begin))
		return 0;
	return error_set(e, EEXIST, "%s exists and is not %s; it is not replaced", f->path, formats[f->format].noun);
}

int output_files_check(const struct output_files *o, const char *const *inputs, size_t input_count, struct error *e)
{
	struct file_identity places[OUTPUT_FILES_MAX];
	const struct output_file *f = o->files;
	for (size_t i = 0; i < OUTPUT_FILES_MAX; i++) {
		if (!f[i].path)
			continue;
		int rc = identify_file(&places[i], f[i].path, e);
		if (!rc)
			rc = check_inputs(&f[i], &places[i], inputs, input_count, e);
		for (size_t j = 0; !rc && j < i; j++)
			if (f[j].path &&
			    (is_same_file(&places[i], &places[j]) || are_both_stdout(f[i].path, f[j].path)))
				rc = error_set(e, EINVAL, "%s and %s are the same file, %s", f[j].option, f[i].option,
					       output_target_display_name(f[i].path));
		if (!rc)
			rc = check_format(&f[i], e);
		if (!rc)
			rc = check_name(&f[i], e);
		if (!rc)
			rc = image_file_probe(f[i].path, e);
		if (rc)
			return rc;
	}
	return 0;
}

int output_files_check_read(const struct output_files *o, uint64_t device, uint64_t inode, const char *name,
			    struct error *e)
{
	for (size_t i = 0; i < OUTPUT_FILES_MAX; i++) {
		const struct output_file *f = &o->files[i];
		struct stat st;
		if (f->path && stat(f->path, &st) == 0 && S_ISREG(st.st_mode) && st.st_dev == device &&
		    st.st_ino == inode)
			return refuse_input(f, name, e);
	}
	return 0;
}

enum output_format output_plot_format(const char *path)
{
	const char *format = picture_name_format(path);
	return format && strcmp(format, ".png") == 0 ? OUTPUT_PNG : OUTPUT_SVG;
}
