/* SPDX-License-Identifier: Apache-2.0 */
/* Service managers are notified at the socket that they name, by path or by abstract name; the sockets that they pass
 * are used, and those passed to other processes are not. */
#include "common/net/notify.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

/* Returns a bound socket of the type at an abstract name of this process; name becomes "@...". */
static int bind_abstract(int type, char name[64], const char *what)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	int fd = socket(AF_UNIX, type | SOCK_CLOEXEC, 0);
	assert_true(fd >= 0);
	int n = snprintf(name, 64, "@hslt-test-%ld-%s", (long)getpid(), what);
	memcpy(a.sun_path + 1, name + 1, (size_t)n - 1);
	assert_int_equal(
		bind(fd, (struct sockaddr *)&a, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + (size_t)n)), 0);
	return fd;
}

static void expect_datagram(int fd, const char *what)
{
	char text[64];
	ssize_t n = recv(fd, text, sizeof text - 1, MSG_DONTWAIT);
	assert_true(n >= 0);
	text[n] = 0;
	assert_string_equal(text, what);
}

static void notices_reach_the_service_manager(void **state)
{
	(void)state;
	char name[64], path[64];
	unsetenv("NOTIFY_SOCKET");
	assert_false(notify_send("READY=1"));
	int manager = bind_abstract(SOCK_DGRAM, name, "manager");
	setenv("NOTIFY_SOCKET", name, 1);
	assert_true(notify_send("READY=1"));
	assert_true(notify_send("WATCHDOG=1"));
	expect_datagram(manager, "READY=1");
	expect_datagram(manager, "WATCHDOG=1");
	/* A manager that does not listen, or no longer listens, does not delay the program. */
	int sent = 0;
	while (sent < 100000 && notify_send("WATCHDOG=1"))
		sent++;
	assert_in_range(sent, 1, 99999);
	close(manager);
	assert_false(notify_send("WATCHDOG=1"));

	struct sockaddr_un a = {.sun_family = AF_UNIX};
	int n = snprintf(path, sizeof path, "/tmp/hslt-test-notify-%ld", (long)getpid());
	memcpy(a.sun_path, path, (size_t)n);
	manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	assert_int_equal(bind(manager, (struct sockaddr *)&a, sizeof a), 0);
	setenv("NOTIFY_SOCKET", path, 1);
	assert_true(notify_send("STOPPING=1"));
	expect_datagram(manager, "STOPPING=1");
	unlink(path);
	close(manager);

	static const char *const bad[] = {"", "@", "/", "relative", "vsock:2:1234"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		setenv("NOTIFY_SOCKET", bad[i], 1);
		assert_false(notify_send("READY=1"));
	}
	char longest[200];
	memset(longest, 'x', sizeof longest - 1);
	longest[0] = '/';
	longest[sizeof longest - 1] = 0;
	setenv("NOTIFY_SOCKET", longest, 1);
	assert_false(notify_send("READY=1"));
	unsetenv("NOTIFY_SOCKET");
}

static void expect_watchdog(const char *us, const char *pid, double seconds)
{
	us ? setenv("WATCHDOG_USEC", us, 1) : unsetenv("WATCHDOG_USEC");
	pid ? setenv("WATCHDOG_PID", pid, 1) : unsetenv("WATCHDOG_PID");
	assert_true(notify_watchdog_seconds() >= seconds && notify_watchdog_seconds() <= seconds);
}

static void watchdog_period_is_read_from_the_environment(void **state)
{
	(void)state;
	char me[32];
	snprintf(me, sizeof me, "%ld", (long)getpid());
	expect_watchdog(NULL, NULL, 0);
	expect_watchdog("30000000", NULL, 30);
	expect_watchdog("30000000", me, 30);
	expect_watchdog("30000000", "1", 0);
	expect_watchdog("30000000", "x", 0);
	expect_watchdog("0", me, 0);
	expect_watchdog("-1", me, 0);
	expect_watchdog("1s", me, 0);
	expect_watchdog("99999999999999999999", me, 0);
	expect_watchdog(NULL, NULL, 0);
}

static int exit_code_of(pid_t child)
{
	int status;
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

/* Runs a child whose descriptors from 3 on are these; returns the one that the child takes (3...), 0 for none, or 99 if
 * it would be inherited by programs that the child starts. */
static int inherited_socket(const int *fds, int count, const char *announced, bool other_pid)
{
	pid_t child = fork();
	assert_true(child >= 0);
	if (child)
		return exit_code_of(child);
	char me[32];
	int copies[8];
	for (int i = 0; i < count; i++)
		copies[i] = fcntl(fds[i], F_DUPFD, 100);
	for (int i = 0; i < count; i++)
		dup2(copies[i], 3 + i);
	snprintf(me, sizeof me, "%ld", (long)(other_pid ? getppid() : getpid()));
	setenv("LISTEN_PID", me, 1);
	announced ? setenv("LISTEN_FDS", announced, 1) : unsetenv("LISTEN_FDS");
	int fd = notify_inherited_socket();
	if (fd >= 0 && !(fcntl(fd, F_GETFD) & FD_CLOEXEC))
		_exit(99);
	_exit(fd < 0 ? 0 : fd);
}

static void only_a_listening_unix_socket_is_inherited(void **state)
{
	(void)state;
	char name[64];
	int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
	int datagrams = bind_abstract(SOCK_DGRAM, name, "datagrams");
	int idle = bind_abstract(SOCK_STREAM, name, "idle");
	int listening = bind_abstract(SOCK_STREAM, name, "listening");
	int tcp = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(listen(listening, 1), 0);
	assert_int_equal(listen(tcp, 1), 0); /* an unbound socket gets a free port */
	const int all[] = {null, datagrams, idle, tcp, listening};
	assert_int_equal(inherited_socket(all, 5, "5", false), 7);
	assert_int_equal(inherited_socket(all + 4, 1, "1", false), 3);
	assert_int_equal(inherited_socket(all, 5, "4", false), 0);
	assert_int_equal(inherited_socket(all + 4, 1, "1", true), 0);
	assert_int_equal(inherited_socket(all + 4, 1, NULL, false), 0);
	assert_int_equal(inherited_socket(all + 4, 1, "0", false), 0);
	assert_int_equal(inherited_socket(all + 4, 1, "-1", false), 0);
	assert_int_equal(inherited_socket(all + 4, 1, "1x", false), 0);
	assert_int_equal(inherited_socket(all, 4, "2000000000", false), 0);
	for (int i = 0; i < 5; i++)
		close(all[i]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(notices_reach_the_service_manager),
		cmocka_unit_test(watchdog_period_is_read_from_the_environment),
		cmocka_unit_test(only_a_listening_unix_socket_is_inherited),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
