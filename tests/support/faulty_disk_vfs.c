/* SPDX-License-Identifier: Apache-2.0 */
/* SQLite on the simulated disk of faulty_disk.h: a VFS around the system's. */
#include "tests/support/faulty_disk.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

struct vfs_file {
	sqlite3_file base;
	struct faulty_disk_node *node;
	char *name;
	bool flushes_folder; /* its first flush also flushes its name, as the system's VFS does for journals */
	sqlite3_file *system_file;
};

static sqlite3_vfs *system_vfs;
static sqlite3_vfs faulty_vfs;

static struct vfs_file *to_vfs_file(sqlite3_file *f)
{
	return (struct vfs_file *)f;
}

static int end_call_with(int rc)
{
	faulty_disk_end_call();
	return rc;
}

static int x_close(sqlite3_file *f)
{
	int rc = to_vfs_file(f)->system_file->pMethods->xClose(to_vfs_file(f)->system_file);
	free(to_vfs_file(f)->name);
	free(to_vfs_file(f)->system_file);
	return rc;
}

static int x_read(sqlite3_file *f, void *bytes, int size, sqlite3_int64 at)
{
	if (faulty_disk_begin_call(FAULTY_DISK_READ))
		return end_call_with(SQLITE_IOERR_READ);
	return end_call_with(
		to_vfs_file(f)->system_file->pMethods->xRead(to_vfs_file(f)->system_file, bytes, size, at));
}

static int x_write(sqlite3_file *f, const void *bytes, int size, sqlite3_int64 at)
{
	int code = faulty_disk_begin_call(FAULTY_DISK_WRITE);
	int rc = code == ENOSPC ? SQLITE_FULL
		 : code		? SQLITE_IOERR_WRITE
			: to_vfs_file(f)->system_file->pMethods->xWrite(to_vfs_file(f)->system_file, bytes, size, at);
	if (rc == SQLITE_OK)
		faulty_disk_record_write(to_vfs_file(f)->node, bytes, (size_t)size, (uint64_t)at);
	return end_call_with(rc);
}

static int x_truncate(sqlite3_file *f, sqlite3_int64 size)
{
	int rc = faulty_disk_begin_call(FAULTY_DISK_REMOVE)
			 ? SQLITE_IOERR_TRUNCATE
			 : to_vfs_file(f)->system_file->pMethods->xTruncate(to_vfs_file(f)->system_file, size);
	if (rc == SQLITE_OK)
		faulty_disk_record_truncate(to_vfs_file(f)->node, (uint64_t)size);
	return end_call_with(rc);
}

static int x_sync(sqlite3_file *f, int flags)
{
	(void)flags;
	if (faulty_disk_begin_call(FAULTY_DISK_FLUSH)) {
		faulty_disk_record_failed_flush(to_vfs_file(f)->node);
		return end_call_with(SQLITE_IOERR_FSYNC);
	}
	faulty_disk_record_flush(to_vfs_file(f)->node, true);
	if (to_vfs_file(f)->flushes_folder)
		faulty_disk_record_folder_flush(to_vfs_file(f)->name);
	to_vfs_file(f)->flushes_folder = false;
	return end_call_with(SQLITE_OK);
}

static int x_size(sqlite3_file *f, sqlite3_int64 *size)
{
	return to_vfs_file(f)->system_file->pMethods->xFileSize(to_vfs_file(f)->system_file, size);
}

static int x_lock(sqlite3_file *f, int what)
{
	return to_vfs_file(f)->system_file->pMethods->xLock(to_vfs_file(f)->system_file, what);
}

static int x_unlock(sqlite3_file *f, int what)
{
	return to_vfs_file(f)->system_file->pMethods->xUnlock(to_vfs_file(f)->system_file, what);
}

static int x_check(sqlite3_file *f, int *is_reserved)
{
	return to_vfs_file(f)->system_file->pMethods->xCheckReservedLock(to_vfs_file(f)->system_file, is_reserved);
}

static int x_control(sqlite3_file *f, int operation, void *argument)
{
	return to_vfs_file(f)->system_file->pMethods->xFileControl(to_vfs_file(f)->system_file, operation, argument);
}

static int x_sector(sqlite3_file *f)
{
	return to_vfs_file(f)->system_file->pMethods->xSectorSize(to_vfs_file(f)->system_file);
}

static int x_characteristics(sqlite3_file *f)
{
	return to_vfs_file(f)->system_file->pMethods->xDeviceCharacteristics(to_vfs_file(f)->system_file);
}

/* Version 1: no mapping of files, no shared memory. */
static const sqlite3_io_methods io_methods = {
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
	struct vfs_file *opened = to_vfs_file(f);
	*opened = (struct vfs_file){.system_file = NULL};
	int code = faulty_disk_begin_call(flags & SQLITE_OPEN_CREATE ? FAULTY_DISK_OPEN : FAULTY_DISK_READ);
	bool existed = name && faulty_disk_find_node(name, false);
	if (code)
		return end_call_with(SQLITE_CANTOPEN);
	opened->system_file = calloc(1, (size_t)system_vfs->szOsFile);
	int rc = opened->system_file ? system_vfs->xOpen(system_vfs, name, opened->system_file, flags, out_flags)
				     : SQLITE_NOMEM;
	if (rc != SQLITE_OK) {
		free(opened->system_file);
		return end_call_with(rc);
	}
	opened->base.pMethods = &io_methods;
	opened->node = name ? faulty_disk_find_node(name, true) : NULL;
	opened->name = strdup(name ? name : "");
	opened->flushes_folder =
		!existed && (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_SUPER_JOURNAL));
	return end_call_with(SQLITE_OK);
}

static int x_delete(sqlite3_vfs *v, const char *name, int sync_folder)
{
	(void)v;
	if (faulty_disk_begin_call(FAULTY_DISK_REMOVE))
		return end_call_with(SQLITE_IOERR_DELETE);
	int rc = system_vfs->xDelete(system_vfs, name, 0);
	if (rc == SQLITE_OK)
		faulty_disk_record_removal(name);
	if (rc == SQLITE_OK && sync_folder)
		faulty_disk_record_folder_flush(name);
	return end_call_with(rc);
}

void faulty_disk_register_vfs(void)
{
	system_vfs = sqlite3_vfs_find(NULL);
	faulty_vfs = *system_vfs; /* calls that do not concern files stay the system's */
	faulty_vfs.zName = "faulty_disk";
	faulty_vfs.szOsFile = sizeof(struct vfs_file);
	faulty_vfs.xOpen = x_open;
	faulty_vfs.xDelete = x_delete;
	sqlite3_vfs_register(&faulty_vfs, 1);
}
