/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/status/socket_file.h"

#include <fcntl.h>
#include <grp.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

/* Removes a socket left over from an earlier run, on which nobody listens. Anything else at the path is in use, and
 * an error. */
static int remove_stale(const char *path, const struct sockaddr_un *a, struct error *e)
{
	struct stat st;
	if (lstat(path, &st))
		return 0;
	if (!S_ISSOCK(st.st_mode))
		return error_set(e, EEXIST, "%s: exists and is not a socket", path);
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd < 0)
		return error_file(e, errno, path);
	int fault = connect(fd, (const struct sockaddr *)a, sizeof *a) ? errno : 0;
	close(fd);
	if (fault == ENOENT)
		return 0;
	if (fault == EACCES || fault == EPROTOTYPE)
		return error_set(e, fault, "%s: the socket of another user: %s", path, strerror(fault));
	if (fault != ECONNREFUSED) /* includes EAGAIN: its backlog is full */
		return error_set(e, EADDRINUSE, "%s: another program answers there", path);
	return unlink(path) ? error_file(e, errno, path) : 0;
}

/* Gives the socket to the group, through a descriptor of the file that we created, because the name may refer to
 * another file by now. */
static int set_group(const char *path, gid_t group, struct error *e)
{
	char fd_path[64];
	struct stat st;
	int fd = open(path, O_PATH | O_NOFOLLOW | O_CLOEXEC);
	snprintf(fd_path, sizeof fd_path, "/proc/self/fd/%d", fd);
	bool is_ours = fd >= 0 && fstat(fd, &st) == 0 && S_ISSOCK(st.st_mode) && st.st_uid == geteuid();
	int rc = 0;
	if (!is_ours)
		rc = error_set(e, fd < 0 ? errno : EEXIST, "%s: is not the socket that was created there", path);
	else if (fchownat(fd, "", (uid_t)-1, group, AT_EMPTY_PATH) || chmod(fd_path, 0660))
		rc = error_set(e, errno, "%s: the group cannot be set: %s", path, strerror(errno));
	if (fd >= 0)
		close(fd);
	return rc;
}

static int find_group(const char *name, gid_t *group, struct error *e)
{
	errno = 0;
	const struct group *g = getgrnam(name);
	if (!g)
		return error_set(e, EINVAL, "--status-group: there is no group '%s'%s%s", name, errno ? ": " : "",
				 errno ? strerror(errno) : "");
	*group = g->gr_gid;
	return 0;
}

/* The socket is bound here and not by libuv, which would remove the file when it closes, when it may already be
 * another's. The file gets its mode from the descriptor and not from the umask, which belongs to the whole process,
 * whose other threads create files. */
int socket_file_open(struct socket_file *f, struct error *e)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	struct stat st = {0};
	gid_t gid = 0;
	if (strlen(f->path) >= sizeof a.sun_path)
		return error_set(e, ENAMETOOLONG, "%s: at most %zu bytes for a socket's path", f->path,
				 sizeof a.sun_path - 1);
	memcpy(a.sun_path, f->path, strlen(f->path));
	int rc = f->group ? find_group(f->group, &gid, e) : 0;
	if (!rc)
		rc = remove_stale(f->path, &a, e);
	if (rc)
		return rc;
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd < 0 || fchmod(fd, 0600) || bind(fd, (struct sockaddr *)&a, sizeof a))
		rc = error_file(e, errno, f->path);
	if (!rc && lstat(f->path, &st) == 0) {
		f->device = st.st_dev;
		f->inode = st.st_ino;
	}
	if (!rc && f->group)
		rc = set_group(f->path, gid, e);
	if (rc && fd >= 0)
		close(fd);
	return rc ? rc : fd;
}

enum socket_file_state socket_file_check(const struct socket_file *f)
{
	struct stat st;
	if (lstat(f->path, &st))
		return errno == ENOENT ? SOCKET_FILE_MISSING : SOCKET_FILE_UNKNOWN;
	return f->inode && st.st_dev == f->device && st.st_ino == f->inode ? SOCKET_FILE_INTACT : SOCKET_FILE_REPLACED;
}

void socket_file_remove(const struct socket_file *f)
{
	if (socket_file_check(f) == SOCKET_FILE_INTACT)
		unlink(f->path);
}
