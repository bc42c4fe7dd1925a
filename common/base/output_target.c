/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/output_target.h"

#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LINKS_MAX = 40 };

const char *output_target_from_arg(const char *arg)
{
	return strcmp(arg, "-") == 0 ? TARGET_STDOUT : arg;
}

const char *output_target_to_arg(const char *path)
{
	return strcmp(path, TARGET_STDOUT) == 0 ? "-" : path;
}

const char *output_target_display_name(const char *path)
{
	return strcmp(path, TARGET_STDOUT) == 0 ? "stdout" : path;
}

/* Returns the program's own descriptor that a path such as /dev/fd/3 or /proc/self/fd/1 names; negative if it names
 * none. Such a path must not be opened again, because writing would then start at the file's beginning. */
static int own_descriptor(const char *path)
{
	char folder[OUTPUT_TARGET_PATH_MAX], real[PATH_MAX], own_folder[64];
	const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
	size_t digits = strspn(name, "0123456789");
	if (!slash || !digits || digits > 9 || name[digits])
		return -1;
	snprintf(folder, sizeof folder, "%.*s", (int)(slash - path), path);
	snprintf(own_folder, sizeof own_folder, "/proc/%ld/fd", (long)getpid());
	return realpath(folder, real) && strcmp(real, own_folder) == 0 ? atoi(name) : -1;
}

/* Replaces `path`, a link, by the path that it points to. */
static int follow_link(char path[OUTPUT_TARGET_PATH_MAX], struct error *e)
{
	char link_target[OUTPUT_TARGET_PATH_MAX], next[OUTPUT_TARGET_PATH_MAX];
	ssize_t n = readlink(path, link_target, sizeof link_target - 1);
	if (n < 0)
		return error_file(e, errno, path);
	link_target[n] = 0;
	const char *slash = strrchr(path, '/');
	int folder = *link_target == '/' || !slash ? 0 : (int)(slash - path) + 1;
	int size = snprintf(next, sizeof next, "%.*s%s", folder, path, link_target);
	if (size < 0 || (size_t)size >= sizeof next)
		return error_set(e, ENAMETOOLONG, "%s: the name that the link leads to is too long", path);
	memcpy(path, next, (size_t)size + 1);
	return 0;
}

int output_target_resolve(struct output_target *t, const char *path, struct error *e)
{
	*t = (struct output_target){.fd = -1};
	if (strlen(path) >= sizeof t->path)
		return error_set(e, ENAMETOOLONG, "%.100s...: the name is too long", path);
	strcpy(t->path, path);
	for (int links = 0; links < LINKS_MAX; links++) {
		struct stat st;
		t->fd = own_descriptor(t->path);
		if (t->fd >= 0) {
			t->writes_directly = true;
			return 0;
		}
		if (lstat(t->path, &st))
			return 0; /* the caller reports it when writing fails */
		if (S_ISDIR(st.st_mode))
			return error_set(e, EISDIR, "%s: is a folder", path);
		t->writes_directly = !S_ISREG(st.st_mode);
		if (!S_ISLNK(st.st_mode))
			return 0;
		int rc = follow_link(t->path, e);
		if (rc)
			return rc;
		t->writes_directly = false;
	}
	return error_set(e, ELOOP, "%s: a loop of links", path);
}

int output_target_open(const struct output_target *t, struct error *e)
{
	int fd = t->fd >= 0 ? fcntl(t->fd, F_DUPFD_CLOEXEC, 0) : open(t->path, O_WRONLY | O_NOCTTY | O_CLOEXEC);
	return fd < 0 ? error_set(e, errno, "%s: cannot write there: %s", output_target_display_name(t->path),
				  strerror(errno))
		      : fd;
}
