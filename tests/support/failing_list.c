/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/failing_list.h"

#include "common/base/disk.h"

#include <errno.h>
#include <string.h>

static const char *failing_path_part;
static int listed_names, names_before_failure, failure_errno;
static DIR *failing_folder;

static DIR *failing_opendir(const char *path)
{
	DIR *d = disk_system.opendir(path);
	if (d && strstr(path, failing_path_part)) {
		failing_folder = d;
		listed_names = 0;
	}
	return d;
}

static struct dirent *failing_readdir(DIR *d)
{
	struct dirent *f = disk_system.readdir(d);
	if (d != failing_folder || (f && f->d_name[0] == '.') || listed_names++ < names_before_failure)
		return f;
	errno = failure_errno;
	return NULL;
}

void failing_list_begin(const char *part, int names, int error)
{
	static struct disk failing_disk;
	failing_disk = disk_system;
	failing_disk.opendir = failing_opendir;
	failing_disk.readdir = failing_readdir;
	failing_path_part = part;
	names_before_failure = names;
	failure_errno = error;
	failing_folder = NULL;
	disk_set_calls(&failing_disk);
}

void failing_list_end(void)
{
	disk_set_calls(NULL);
}
