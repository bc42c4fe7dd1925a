/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file of a Unix socket: who may connect, and to whom the file belongs. A link at the path is never followed, and
 * only a socket on which nobody listens any more is removed. One thread; nothing is allocated.
 */
#ifndef COORDINATOR_STATUS_SOCKET_FILE_H
#define COORDINATOR_STATUS_SOCKET_FILE_H

#include "common/base/error.h"

#include <sys/types.h>

struct socket_file {
	const char *path, *group; /* group: may connect, too; NULL: only the user */
	/* Identify the file that was created; inode 0: none was created, or it was gone at once. */
	dev_t device;
	ino_t inode;
};

/* Binds a socket to the path, with mode 0600 from the start, or 0660 once it belongs to the group. Returns the
 * descriptor, or -errno: -EADDRINUSE if another program answers there, -EEXIST if something else is at the path. */
int socket_file_open(struct socket_file *f, struct error *e);
enum socket_file_state {
	SOCKET_FILE_INTACT,
	SOCKET_FILE_MISSING,
	SOCKET_FILE_REPLACED, /* another file is at the path */
	SOCKET_FILE_UNKNOWN   /* the folder cannot be searched */
} socket_file_check(const struct socket_file *f);
void socket_file_remove(const struct socket_file *f); /* only if it is still ours */

#endif
