/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A Unix socket's file: who may connect, and whose it is. What lies at the path is never followed, and only a socket on
 * which nobody listens any more is taken away. One thread; nothing is allocated.
 */
#ifndef COORDINATOR_STATUS_SOCKET_FILE_H
#define COORDINATOR_STATUS_SOCKET_FILE_H

#include "common/base/error.h"

#include <sys/types.h>

struct socket_file {
	const char *path, *group; /* group: that may connect, too; NULL: the user alone */
	dev_t device;		  /* of the file that was made; inode 0: none was, or it was gone at once */
	ino_t inode;
};

/* Binds a socket to the path, with mode 0600 from the start, or 0660 once it is the group's. Returns the descriptor,
 * or -errno: -EADDRINUSE: another program answers there; -EEXIST: it is not a socket. */
int socket_file_open(struct socket_file *f, struct error *e);
enum socket_file_state {
	SOCKET_FILE_OURS,
	SOCKET_FILE_GONE,
	SOCKET_FILE_OTHERS, /* another file is there */
	SOCKET_FILE_UNKNOWN /* the folder cannot be searched */
} socket_file_look(const struct socket_file *f);
void socket_file_remove(const struct socket_file *f); /* if it is still ours */

#endif
