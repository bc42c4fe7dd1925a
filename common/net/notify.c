/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/notify.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { FIRST_FD = 3, FDS_MAX = 64 };

bool notify_send(const char *state)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	const char *path = getenv("NOTIFY_SOCKET");
	size_t length = path ? strlen(path) : 0;
	if (length < 2 || length >= sizeof a.sun_path || (*path != '/' && *path != '@'))
		return false;
	memcpy(a.sun_path, path, length);
	if (*path == '@') /* an abstract name, which begins with a zero byte and ends with the address */
		a.sun_path[0] = 0;
	int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return false;
	size_t size = strlen(state);
	ssize_t sent = sendto(fd, state, size, MSG_DONTWAIT | MSG_NOSIGNAL, (struct sockaddr *)&a,
			      (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length));
	close(fd);
	return sent == (ssize_t)size;
}

/* Returns a whole number from an environment variable; -1 if it is not set or not such a number. */
static long long env_number(const char *name)
{
	char *end;
	const char *text = getenv(name);
	if (!text || *text < '0' || *text > '9')
		return -1;
	errno = 0;
	long long n = strtoll(text, &end, 10);
	return *end || errno ? -1 : n;
}

double notify_watchdog_seconds(void)
{
	long long us = env_number("WATCHDOG_USEC");
	if (us <= 0 || (getenv("WATCHDOG_PID") && env_number("WATCHDOG_PID") != getpid()))
		return 0;
	return 1e-6 * (double)us;
}

static int socket_option(int fd, int name)
{
	int value = -1;
	socklen_t size = sizeof value;
	return getsockopt(fd, SOL_SOCKET, name, &value, &size) ? -1 : value;
}

int notify_inherited_socket(void)
{
	long long count = env_number("LISTEN_FDS");
	if (count <= 0 || env_number("LISTEN_PID") != getpid())
		return -1;
	for (int fd = FIRST_FD; fd < FIRST_FD + (count < FDS_MAX ? (int)count : FDS_MAX); fd++) {
		if (socket_option(fd, SO_DOMAIN) != AF_UNIX || socket_option(fd, SO_TYPE) != SOCK_STREAM ||
		    socket_option(fd, SO_ACCEPTCONN) != 1)
			continue;
		return fcntl(fd, F_SETFD, FD_CLOEXEC) ? -1 : fd;
	}
	return -1;
}
