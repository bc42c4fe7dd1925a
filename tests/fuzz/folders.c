/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/fuzz/folders.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char base[64];

void folders_remove(const char *path)
{
	struct dirent *d;
	DIR *dir = opendir(path);
	while (dir && (d = readdir(dir))) {
		char below[1024];
		if (strcmp(d->d_name, ".") == 0 || strcmp(d->d_name, "..") == 0)
			continue;
		snprintf(below, sizeof below, "%s/%s", path, d->d_name);
		if (unlink(below))
			folders_remove(below);
	}
	if (dir)
		closedir(dir);
	rmdir(path);
}

static void copy_file(const char *from, const char *to)
{
	char bytes[1 << 15];
	ssize_t n;
	int in = open(from, O_RDONLY | O_CLOEXEC), out = open(to, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	if (in < 0 || out < 0)
		abort();
	while ((n = read(in, bytes, sizeof bytes)) > 0)
		if (write(out, bytes, (size_t)n) != n)
			abort();
	close(in);
	close(out);
}

void folders_copy(const char *from, const char *to)
{
	struct dirent *d;
	DIR *dir = opendir(from);
	mkdir(to, 0700);
	while (dir && (d = readdir(dir))) {
		char source[1024], target[1024];
		struct stat st;
		if (strcmp(d->d_name, ".") == 0 || strcmp(d->d_name, "..") == 0)
			continue;
		snprintf(source, sizeof source, "%s/%s", from, d->d_name);
		snprintf(target, sizeof target, "%s/%s", to, d->d_name);
		if (lstat(source, &st) == 0 && S_ISDIR(st.st_mode))
			folders_copy(source, target);
		else if (S_ISREG(st.st_mode))
			copy_file(source, target);
	}
	if (dir)
		closedir(dir);
}

static void remove_base(void)
{
	folders_remove(base);
}

const char *folders_base(void)
{
	if (*base)
		return base;
	strcpy(base, access("/dev/shm", W_OK) ? "/tmp/hslt-fuzz.XXXXXX" : "/dev/shm/hslt-fuzz.XXXXXX");
	if (!mkdtemp(base))
		abort();
	atexit(remove_base);
	return base;
}
