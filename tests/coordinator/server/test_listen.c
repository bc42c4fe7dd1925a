/* SPDX-License-Identifier: Apache-2.0 */
/* A coordinator listens at all addresses that its host name has, or at none if one of them needs TLS. */
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/first_address.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

int __real_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found);
int __wrap_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found);

static const char *addresses[2]; /* addresses of the host name "two" */

int __wrap_getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **found)
{
	if (strcmp(host, "two") != 0)
		return __real_getaddrinfo(host, port, hints, found);
	int rc = __real_getaddrinfo(addresses[0], port, hints, found);
	return rc ? rc : __real_getaddrinfo(addresses[1], port, hints, &(*found)->ai_next);
}

static char spool[100], port_file[100];

static int open_at_two_addresses(struct server **s, const char *first, const char *second, bool insecure,
				 struct error *e)
{
	struct server_config c;
	server_config_init(&c);
	c.listen_address = "two:0";
	c.spool_folder = spool;
	c.port_file = port_file;
	c.insecure = insecure;
	addresses[0] = first;
	addresses[1] = second;
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	snprintf(port_file, sizeof port_file, "%s/port", temporary_folder);
	return server_open(s, &c, e);
}

/* Connects to this address, and waits until the server has accepted it. */
static int connect_to(struct server *s, const char *host)
{
	struct net_addr a;
	struct error e;
	char port[16] = "", address[40];
	unsigned before = s->peers.session_count;
	FILE *f = fopen(port_file, "r");
	assert_true(f && fgets(port, sizeof port, f));
	fclose(f);
	port[strcspn(port, "\n")] = 0;
	snprintf(address, sizeof address, "%s:%s", host, port);
	assert_int_equal(first_address_resolve(&a, address, &e), 0);
	int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_true(fd >= 0);
	if (connect(fd, (struct sockaddr *)&a.storage, sizeof(struct sockaddr_in)))
		fail_msg("%s: %s", address, strerror(errno));
	while (s->peers.session_count == before)
		uv_run(&s->loop, UV_RUN_ONCE);
	return fd;
}

static void server_listens_at_all_addresses(void **state)
{
	(void)state;
	struct server *s;
	struct error e;
	assert_int_equal(open_at_two_addresses(&s, "127.0.0.2", "127.0.0.1", false, &e), 0);
	int first = connect_to(s, "127.0.0.2"), second = connect_to(s, "127.0.0.1");
	server_close(s);
	close(first);
	close(second);
}

/* One address belongs to no interface, like ::1 in the hosts file of a machine without IPv6. */
static void address_of_no_interface_is_skipped(void **state)
{
	(void)state;
	struct server *s;
	struct error e;
	assert_int_equal(open_at_two_addresses(&s, "192.0.2.1", "127.0.0.1", true, &e), 0);
	int fd = connect_to(s, "127.0.0.1");
	server_close(s);
	close(fd);
}

static void address_that_needs_tls_stops_the_start(void **state)
{
	(void)state;
	struct server *s;
	struct error e;
	assert_int_equal(open_at_two_addresses(&s, "127.0.0.1", "192.0.2.1", false, &e), -EPERM);
	assert_non_null(strstr(e.text, "--insecure"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(server_listens_at_all_addresses, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(address_of_no_interface_is_skipped, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(address_that_needs_tls_stops_the_start, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
