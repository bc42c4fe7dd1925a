/* SPDX-License-Identifier: Apache-2.0 */
/* Addresses are parsed strictly, and those beyond this machine need TLS or --insecure. */
#include "common/net/addr.h"
#include "tests/support/first_address.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void addresses_are_parsed_strictly(void **state)
{
	(void)state;
	struct net_addr a;
	struct error e;
	static const char *const bad[] = {
		"",	  "localhost",	  ":1",		  "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536",
		"::1:80", "127.0.0.1:-1", "127.0.0.1:1 ", "[]:1"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(first_address_resolve(&a, bad[i], &e), -EINVAL);
	assert_int_equal(first_address_resolve(&a, "127.3.2.1:80", &e), 0);
	assert_true(net_addr_is_loopback(&a) && net_addr_port(&a) == 80);
	assert_int_equal(first_address_resolve(&a, "[::1]:7700", &e), 0);
	assert_true(net_addr_is_loopback(&a) && net_addr_port(&a) == 7700);
	assert_int_equal(net_addr_check_allowed(&a, "[::1]:7700", false, &e), 0);
	static const char *const remote[] = {"0.0.0.0:1", "192.0.2.1:1", "[::]:1", "[2001:db8::1]:1"};
	for (size_t i = 0; i < sizeof remote / sizeof *remote; i++) {
		char text[80];
		assert_int_equal(first_address_resolve(&a, remote[i], &e), 0);
		assert_int_equal(net_addr_check_allowed(&a, remote[i], false, &e), -EPERM);
		assert_non_null(strstr(e.text, "--insecure"));
		assert_int_equal(net_addr_check_allowed(&a, remote[i], true, &e), 0);
		net_addr_format(&a, text, sizeof text);
		assert_string_equal(text, remote[i]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(addresses_are_parsed_strictly)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
