/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the files of a scene that is not trusted: every name must stay below the scene's folder or below a folder that
 * the user added with --path.
 *
 * Happy path: search_open tries the folders in order. open_below opens the folder and lets the kernel resolve the name
 * beneath it (openat2, RESOLVE_BENEATH); read_regular_file then reads the file into memory. A name that is absolute or
 * leads out of the scene's folder (asset_name_levels_up) is resolved textually, and opened if the result lies below one
 * of the folders.
 *
 * Failures are one sentence in struct error: a name that leads out of the folders (-EINVAL, with the --path that would
 * allow it), a file that does not exist (-ENOENT, with the --path that would find it, or a similar name), anything but
 * a regular file, a file above 4 GB or one that shrinks while it is read. On kernels without openat2, symbolic links
 * are not followed at all.
 */
#include "worker/render/asset/asset.h"

#include "common/base/io.h"
#include "common/base/mem.h"
#include "common/base/spelling.h"
#include "worker/render/asset/asset_name.h"

#include <dirent.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/openat2.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { NAME_BYTES_MAX = 4096 };
#define ASSET_SIZE_MAX ((off_t)1 << 32)

static bool is_below(const char *name)
{
	if (!*name || *name == '/' || strlen(name) >= NAME_BYTES_MAX)
		return false;
	for (const char *part = name; *part; part += strspn(part, "/")) {
		size_t n = strcspn(part, "/");
		if (n == 2 && part[0] == '.' && part[1] == '.')
			return false;
		part += n;
	}
	return true;
}

/* For kernels that cannot confine the look-up to the folder: follows no symbolic links at all. */
static int open_step_by_step(int folder, const char *name)
{
	int folder_fd = dup(folder);
	while (folder_fd >= 0) {
		char part[256];
		name += strspn(name, "/");
		size_t n = strcspn(name, "/");
		const char *rest = name + n + strspn(name + n, "/");
		int next = -1;
		if (n < sizeof part) {
			memcpy(part, name, n);
			part[n] = 0;
			next = openat(folder_fd, part,
				      O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW | (*rest ? O_DIRECTORY : 0));
		} else {
			errno = ENAMETOOLONG;
		}
		int saved_errno = errno;
		close(folder_fd);
		errno = saved_errno;
		if (next < 0 || !*rest)
			return next;
		folder_fd = next;
		name = rest;
	}
	return -1;
}

static int open_below(const char *folder, const char *name)
{
	int folder_fd = open(*folder ? folder : ".", O_PATH | O_DIRECTORY | O_CLOEXEC);
	if (folder_fd < 0)
		return -1;
	struct open_how how = {.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK,
			       .resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS};
	int fd = (int)syscall(SYS_openat2, folder_fd, name, &how, sizeof how);
	if (fd < 0 && (errno == ENOSYS || errno == EPERM || errno == EINVAL))
		fd = open_step_by_step(folder_fd, name);
	int saved_errno = errno;
	close(folder_fd);
	errno = saved_errno;
	return fd;
}

/* Reads the file rather than mapping it: a mapped file that another process truncates would kill this one. */
static int read_regular_file(int fd, const char *name, struct asset *out, struct error *e)
{
	struct stat st;
	if (fstat(fd, &st) != 0)
		return error_set(e, errno, "%s: %s", name, strerror(errno));
	if (!S_ISREG(st.st_mode))
		return error_set(e, EINVAL, "%s: not a regular file", name);
	if (st.st_size > ASSET_SIZE_MAX)
		return error_set(e, EFBIG, "%s: larger than %lld MB", name, (long long)(ASSET_SIZE_MAX >> 20));
	size_t size = (size_t)st.st_size;
	unsigned char *bytes = mem_alloc(size, 1);
	if (!bytes)
		return error_set(e, ENOMEM, "%s: out of memory", name);
	ssize_t n = io_read_all(fd, bytes, size);
	if (n != st.st_size) {
		int code = n < 0 ? (int)-n : EIO;
		mem_free(bytes);
		return error_set(e, code, "%s: %s", name, n < 0 ? strerror(code) : "became shorter while it was read");
	}
	*out = (struct asset){.bytes = bytes, .size = size, .handle = bytes, .device = st.st_dev, .inode = st.st_ino};
	return 0;
}

/* `display_name` is the name for messages, as the user wrote it: it differs from `name` if the written name leads out
 * of the scene's folder. */
static int open_in_folder(const char *folder, const char *name, const char *display_name, struct asset *out,
			  struct error *e)
{
	*out = (struct asset){0};
	if (!is_below(name))
		return error_set(e, EINVAL, "%.256s: files must lie below the scene's folder, or one given with --path",
				 display_name);
	int fd = open_below(folder, name);
	if (fd < 0)
		return error_set(e, errno, "%.256s: %s", display_name,
				 errno == EXDEV ? "leads out of the scene's folder" : strerror(errno));
	int r = read_regular_file(fd, display_name, out, e);
	close(fd);
	return r;
}

static const char *path_after(const char *folder, const char *path)
{
	size_t n = strlen(folder);
	while (n > 0 && folder[n - 1] == '/')
		n--;
	return strncmp(path, folder, n) == 0 && path[n] == '/' ? path + n + 1 : NULL;
}

/* Returns the part of an absolute path after the folder, compared as written or with the folder's symbolic links
 * resolved; NULL if the path is not below the folder. */
static const char *path_below(const char *folder, const char *path)
{
	char real[PATH_MAX];
	const char *name = *folder == '/' ? path_after(folder, path) : NULL;
	return name || !realpath(*folder ? folder : ".", real) ? name : path_after(real, path);
}

/* Opens a name that leads `levels_up` folders out of the scene's own, or to the root, and from there to `rest`. */
static int open_outside(const struct asset_folders *f, const char *canonical, struct asset *out, struct error *e)
{
	char path[PATH_MAX + NAME_BYTES_MAX], display_name[NAME_BYTES_MAX];
	const char *rest;
	size_t levels_up = asset_name_levels_up(canonical, &rest);
	*out = (struct asset){0};
	if (strlen(canonical) >= sizeof display_name || !realpath(*f->folder[0] ? f->folder[0] : ".", path))
		return error_set(e, ENAMETOOLONG, "%.256s: the name is too long", rest);
	asset_name_display(canonical, display_name, sizeof display_name);
	size_t end = levels_up == ASSET_NAME_ABSOLUTE ? 0 : strlen(path);
	for (size_t i = 0; i < levels_up && end > 0; i++)
		while (end > 0 && path[--end] != '/')
			;
	size_t suggested_end = end; /* end of the folder that the ".." lead to, suggested for --path */
	snprintf(path + end, sizeof path - end, "/%s", rest);
	int rc = 0;
	for (size_t i = 0; i < f->count && (rc == 0 || rc == -ENOENT || rc == -ENOTDIR); i++) {
		const char *name = path_below(f->folder[i], path);
		if (name && !(rc = open_in_folder(f->folder[i], name, display_name, out, e)))
			return 0;
	}
	if (rc)
		return rc;
	if (levels_up == ASSET_NAME_ABSOLUTE && access(path, F_OK) != 0)
		return error_set(e, ENOENT, "%.256s: no such file on this machine", display_name);
	*(suggested_end > 0 ? path + suggested_end : strrchr(path, '/')) = 0;
	return error_set(e, EINVAL, "%.256s: leads out of the scene's folder; to allow that, give --path %.400s",
			 display_name, *path ? path : "/");
}

static int open_any(const struct asset_folders *f, const char *name, struct asset *out, struct error *e)
{
	const char *rest;
	int rc = -ENOENT;
	if (asset_name_levels_up(name, &rest) > 0 && is_below(rest))
		return open_outside(f, name, out, e);
	for (size_t i = 0; i < f->count && (rc == -ENOENT || rc == -ENOTDIR); i++)
		rc = open_in_folder(f->folder[i], name, name, out, e);
	return rc;
}

static bool has_file(const char *folder, const char *name)
{
	int fd = open_below(folder, name);
	if (fd >= 0)
		close(fd);
	return fd >= 0;
}

/* Returns a folder in which the file exists, to be suggested for --path: the current folder, relative to which the
 * scene may have been written, or one of those above the scene's. NULL if none has it. */
static const char *find_elsewhere(const char *scene_folder, const char *name, char path[PATH_MAX])
{
	enum { LEVELS_UP_MAX = 8 };
	if (!is_below(name))
		return NULL;
	if (has_file(".", name))
		return strcpy(path, ".");
	char *end = realpath(*scene_folder ? scene_folder : ".", path) ? strrchr(path, '/') : NULL;
	for (int i = 0; i < LEVELS_UP_MAX && end && end > path; i++, end = strrchr(path, '/')) {
		*end = 0;
		if (has_file(path, name))
			return path;
	}
	return NULL;
}

/* Where mesh_1.obj exists, it is not suggested for mesh_2.obj. */
static bool has_same_digits(const char *a, const char *b)
{
	for (;; a++, b++) {
		a += strcspn(a, "0123456789");
		b += strcspn(b, "0123456789");
		if (*a != *b)
			return false;
		if (!*a)
			return true;
	}
}

/* Finds the entry of that folder with the most similar name. Compares only the first entries of a large folder,
 * since thousands of files may be missing. */
static bool find_similar_entry(const char *folder, const char *subfolder, const char *wanted, char best[NAME_MAX + 1])
{
	enum { ENTRIES_COMPARED_MAX = 1024 };
	int fd = open_below(folder, *subfolder ? subfolder : ".");
	DIR *dir = fd < 0 ? NULL : fdopendir(fd);
	if (!dir) {
		if (fd >= 0)
			close(fd);
		return false;
	}
	struct spelling s = {.wanted_name = wanted};
	const struct dirent *entry;
	for (int i = 0; i < ENTRIES_COMPARED_MAX && (entry = readdir(dir)); i++) {
		if (entry->d_name[0] == '.' || !has_same_digits(entry->d_name, wanted))
			continue;
		spelling_offer(&s, entry->d_name);
	}
	closedir(dir);
	if (s.best_match)
		snprintf(best, NAME_MAX + 1, "%s", s.best_match);
	return s.best_match != NULL;
}

static bool is_file(const char *folder, const char *name)
{
	struct stat st;
	int fd = open_below(folder, name);
	bool is_regular = fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
	if (fd >= 0)
		close(fd);
	return is_regular;
}

/* Finds an existing file with a similar name: each part of the path that does not exist is replaced by the most
 * similar entry. Names from Windows often differ only in upper and lower case. */
static bool find_similar_file(const char *folder, const char *name, char similar[NAME_BYTES_MAX])
{
	size_t length = 0;
	similar[0] = 0;
	for (const char *part = name + strspn(name, "/"); *part; part += strspn(part, "/")) {
		char wanted[NAME_MAX + 1], best[NAME_MAX + 1];
		size_t n = strcspn(part, "/");
		if (n > NAME_MAX || length + NAME_MAX + 2 > NAME_BYTES_MAX)
			return false;
		memcpy(wanted, part, n);
		wanted[n] = 0;
		part += n;
		snprintf(similar + length, NAME_BYTES_MAX - length, "%s%s", length ? "/" : "", wanted);
		if (!has_file(folder, similar)) {
			similar[length] = 0;
			if (!find_similar_entry(folder, similar, wanted, best))
				return false;
			snprintf(similar + length, NAME_BYTES_MAX - length, "%s%s", length ? "/" : "", best);
		}
		length = strlen(similar);
	}
	return is_file(folder, similar);
}

/* Like open_any, but if the file is not found, the error says which --path would help. */
static int search_open(void *user, const char *name, struct asset *out, struct error *e)
{
	const struct asset_folders *f = user;
	const char *rest;
	int rc = open_any(f, name, out, e);
	if (rc != -ENOENT || asset_name_levels_up(name, &rest) > 0)
		return rc;
	char path[PATH_MAX];
	const char *suggested_folder = find_elsewhere(f->folder[0], name, path);
	char similar[NAME_BYTES_MAX];
	for (size_t i = 0; i < f->count && !suggested_folder && is_below(name); i++)
		if (find_similar_file(f->folder[i], name, similar))
			return error_set(e, ENOENT,
					 "%.256s: no such file in the scene's folder%s; did you mean `%.256s`?", name,
					 f->count > 1 ? " or those of --path" : "", similar);
	return error_set(e, ENOENT, "%.256s: no such file in the scene's folder%s%s%.400s%s", name,
			 f->count > 1 ? " or those of --path" : "", suggested_folder ? "; --path " : "",
			 suggested_folder ? suggested_folder : "",
			 suggested_folder ? " finds it"
			 : f->count > 1	  ? ""
					  : "; --path FOLDER searches there, too");
}

static int folder_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct asset_folders f = {.count = 1, .folder = {user}};
	return open_any(&f, name, out, e);
}

static void folder_close(void *user, struct asset *a)
{
	(void)user;
	mem_free(a->handle);
	*a = (struct asset){0};
}

struct asset_folders asset_folders_make(const char *scene_folder, const char *const *extra_folders, size_t count)
{
	struct asset_folders f = {.count = 1, .folder = {scene_folder}};
	for (size_t i = 0; i < count && f.count < ASSET_FOLDERS_MAX; i++)
		f.folder[f.count++] = extra_folders[i];
	return f;
}

struct asset_source asset_source_for_folders(const struct asset_folders *folders)
{
	return (struct asset_source){.user = (void *)(uintptr_t)folders, .open = search_open, .close = folder_close};
}

struct asset_source asset_source_for_folder(const char *folder)
{
	return (struct asset_source){.user = (void *)(uintptr_t)folder, .open = folder_open, .close = folder_close};
}
