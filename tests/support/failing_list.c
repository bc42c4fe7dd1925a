/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/failing_list.h"

#include "common/base/disk.h"

#include <errno.h>
#include <string.h>

static const char *failing;
static int listed, most, fault;
static DIR *failing_folder;

static DIR *own_opendir(const char *path)
{
	DIR *d = disk_system.opendir(path);
	if (d && strstr(path, failing)) {
		failing_folder = d;
		listed = 0;
	}
	return d;
}

static struct dirent *own_readdir(DIR *d)
{
	struct dirent *f = disk_system.readdir(d);
	if (d != failing_folder || (f && f->d_name[0] == '.') || listed++ < most)
		return f;
	errno = fault;
	return NULL;
}

void failing_list_begin(const char *part, int names, int error)
{
	static struct disk own;
	own = disk_system;
	own.opendir = own_opendir;
	own.readdir = own_readdir;
	failing = part;
	most = names;
	fault = error;
	failing_folder = NULL;
	disk_use(&own);
}

void failing_list_end(void)
{
	disk_use(NULL);
}
