/* SPDX-License-Identifier: Apache-2.0 */
/* SQLite on the simulated disk of faulty_disk.h: a VFS around the system's. */
#include "tests/support/faulty_disk.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

struct file {
	sqlite3_file base;
	struct faulty_disk_node *node;
	char *name;
	bool tell_folder; /* its first flush also flushes its name, as the system's VFS does for journals */
	sqlite3_file *real;
};

static sqlite3_vfs *system_vfs;
static sqlite3_vfs vfs;

static struct file *file_of(sqlite3_file *f)
{
	return (struct file *)f;
}

static int leave_with(int rc)
{
	faulty_disk_leave();
	return rc;
}

static int x_close(sqlite3_file *f)
{
	int rc = file_of(f)->real->pMethods->xClose(file_of(f)->real);
	free(file_of(f)->name);
	free(file_of(f)->real);
	return rc;
}

static int x_read(sqlite3_file *f, void *bytes, int size, sqlite3_int64 at)
{
	if (faulty_disk_enter(FAULTY_DISK_READS))
		return leave_with(SQLITE_IOERR_READ);
	return leave_with(file_of(f)->real->pMethods->xRead(file_of(f)->real, bytes, size, at));
}

static int x_write(sqlite3_file *f, const void *bytes, int size, sqlite3_int64 at)
{
	int code = faulty_disk_enter(FAULTY_DISK_WRITES);
	int rc = code == ENOSPC ? SQLITE_FULL
		 : code		? SQLITE_IOERR_WRITE
				: file_of(f)->real->pMethods->xWrite(file_of(f)->real, bytes, size, at);
	if (rc == SQLITE_OK)
		faulty_disk_wrote(file_of(f)->node, bytes, (size_t)size, (uint64_t)at);
	return leave_with(rc);
}

static int x_truncate(sqlite3_file *f, sqlite3_int64 size)
{
	int rc = faulty_disk_enter(FAULTY_DISK_REMOVES) ? SQLITE_IOERR_TRUNCATE
							: file_of(f)->real->pMethods->xTruncate(file_of(f)->real, size);
	if (rc == SQLITE_OK)
		faulty_disk_cut(file_of(f)->node, (uint64_t)size);
	return leave_with(rc);
}

static int x_sync(sqlite3_file *f, int flags)
{
	(void)flags;
	if (faulty_disk_enter(FAULTY_DISK_FLUSHES)) {
		faulty_disk_failed(file_of(f)->node);
		return leave_with(SQLITE_IOERR_FSYNC);
	}
	faulty_disk_flushed(file_of(f)->node, true);
	if (file_of(f)->tell_folder)
		faulty_disk_flushed_folder_of(file_of(f)->name);
	file_of(f)->tell_folder = false;
	return leave_with(SQLITE_OK);
}

static int x_size(sqlite3_file *f, sqlite3_int64 *size)
{
	return file_of(f)->real->pMethods->xFileSize(file_of(f)->real, size);
}

static int x_lock(sqlite3_file *f, int what)
{
	return file_of(f)->real->pMethods->xLock(file_of(f)->real, what);
}

static int x_unlock(sqlite3_file *f, int what)
{
	return file_of(f)->real->pMethods->xUnlock(file_of(f)->real, what);
}

static int x_check(sqlite3_file *f, int *is)
{
	return file_of(f)->real->pMethods->xCheckReservedLock(file_of(f)->real, is);
}

static int x_control(sqlite3_file *f, int what, void *with)
{
	return file_of(f)->real->pMethods->xFileControl(file_of(f)->real, what, with);
}

static int x_sector(sqlite3_file *f)
{
	return file_of(f)->real->pMethods->xSectorSize(file_of(f)->real);
}

static int x_characteristics(sqlite3_file *f)
{
	return file_of(f)->real->pMethods->xDeviceCharacteristics(file_of(f)->real);
}

/* Version 1: no mapping of files, no shared memory. */
static const sqlite3_io_methods methods = {
	.iVersion = 1,
	.xClose = x_close,
	.xRead = x_read,
	.xWrite = x_write,
	.xTruncate = x_truncate,
	.xSync = x_sync,
	.xFileSize = x_size,
	.xLock = x_lock,
	.xUnlock = x_unlock,
	.xCheckReservedLock = x_check,
	.xFileControl = x_control,
	.xSectorSize = x_sector,
	.xDeviceCharacteristics = x_characteristics,
};

static int x_open(sqlite3_vfs *v, const char *name, sqlite3_file *f, int flags, int *out_flags)
{
	(void)v;
	struct file *n = file_of(f);
	*n = (struct file){.real = NULL};
	int code = faulty_disk_enter(flags & SQLITE_OPEN_CREATE ? FAULTY_DISK_OPENS : FAULTY_DISK_READS);
	bool there = name && faulty_disk_node_of(name, false);
	if (code)
		return leave_with(SQLITE_CANTOPEN);
	n->real = calloc(1, (size_t)system_vfs->szOsFile);
	int rc = n->real ? system_vfs->xOpen(system_vfs, name, n->real, flags, out_flags) : SQLITE_NOMEM;
	if (rc != SQLITE_OK) {
		free(n->real);
		return leave_with(rc);
	}
	n->base.pMethods = &methods;
	n->node = name ? faulty_disk_node_of(name, true) : NULL;
	n->name = strdup(name ? name : "");
	n->tell_folder = !there && (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL));
	return leave_with(SQLITE_OK);
}

static int x_delete(sqlite3_vfs *v, const char *name, int and_folder)
{
	(void)v;
	if (faulty_disk_enter(FAULTY_DISK_REMOVES))
		return leave_with(SQLITE_IOERR_DELETE);
	int rc = system_vfs->xDelete(system_vfs, name, 0);
	if (rc == SQLITE_OK)
		faulty_disk_removed(name);
	if (rc == SQLITE_OK && and_folder)
		faulty_disk_flushed_folder_of(name);
	return leave_with(rc);
}

void faulty_disk_vfs_begin(void)
{
	system_vfs = sqlite3_vfs_find(NULL);
	vfs = *system_vfs; /* calls that do not concern files stay the system's */
	vfs.zName = "faulty_disk";
	vfs.szOsFile = sizeof(struct file);
	vfs.xOpen = x_open;
	vfs.xDelete = x_delete;
	sqlite3_vfs_register(&vfs, 1);
}
