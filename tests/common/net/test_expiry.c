/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Warnings about certificates that expire soon: they come in time, repeat every day, and do not come without need; the
 * clock is an argument here. New certificates are loaded, if not at once, then later, and must be for the same party as
 * the old ones.
 */
#include "common/net/authority.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

enum { DAY = 86400 };

static char root[64];

static int make_folder(void **state)
{
	(void)state;
	snprintf(root, sizeof root, "/tmp/hslt-expiry.XXXXXX");
	return mkdtemp(root) ? 0 : -1;
}

static int remove_folder(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", root);
	return system(command);
}

/* Makes an authority that is valid for `authority_days` days and a worker's certificate by it that is valid for
 * `certificate_days` days. */
static struct tls *open_party(const char *name, double authority_days, double certificate_days)
{
	char ca[128], folder[160];
	struct error e = {""};
	struct tls *t = NULL;
	snprintf(ca, sizeof ca, "%s/%s", root, name);
	snprintf(folder, sizeof folder, "%s/node", ca);
	if (authority_create(ca, "test", authority_days, &e) ||
	    authority_issue(ca, "node", TLS_WORKER, certificate_days, false, &e) || tls_open(&t, folder, &e))
		fail_msg("%s", e.text);
	return t;
}

static void warning_comes_two_weeks_before_expiry(void **state)
{
	(void)state;
	char text[384];
	struct tls *t = open_party("long", 100, 50);
	time_t now = time(NULL);
	assert_in_range(tls_own_certificate(t)->expiry_time, now + 50 * DAY - 60, now + 50 * DAY + 60);
	assert_in_range(tls_authority_expiry(t), now + 100 * DAY - 60, now + 100 * DAY + 60);
	assert_false(tls_expiry_warning_due(t, now, text, sizeof text));
	assert_false(tls_expiry_warning(t, now + 35 * DAY, text, sizeof text));
	assert_string_equal(text, "");
	assert_true(tls_expiry_warning(t, now + 37 * DAY, text, sizeof text));
	assert_non_null(strstr(text, "the certificate of node expires in 13 days, at 20"));
	assert_null(strstr(text, "authority"));
	assert_true(tls_expiry_warning(t, now + 51 * DAY, text, sizeof text));
	assert_non_null(strstr(text, "the certificate of node has expired, at 20"));
	tls_close(t);
}

static void warning_repeats_daily_and_after_a_reload(void **state)
{
	(void)state;
	char text[384], ca[128];
	struct error e;
	struct tls *t = open_party("daily", 400, 10);
	time_t now = time(NULL);
	assert_true(tls_expiry_warning_due(t, now, text, sizeof text));
	assert_false(tls_expiry_warning_due(t, now + 1, text, sizeof text));
	assert_false(tls_expiry_warning_due(t, now + DAY - 1, text, sizeof text));
	assert_true(tls_expiry_warning_due(t, now + DAY, text, sizeof text));
	assert_non_null(strstr(text, "expires in 9 days"));
	assert_false(tls_expiry_warning_due(t, now + 2 * DAY - 1, text, sizeof text));
	snprintf(ca, sizeof ca, "%s/daily", root);
	assert_int_equal(authority_issue(ca, "node", TLS_WORKER, 5, true, &e), 0);
	assert_int_equal(tls_refresh(t, &e), 1);
	assert_true(tls_expiry_warning_due(t, now + DAY + 2, text, sizeof text));
	assert_int_equal(authority_issue(ca, "node", TLS_WORKER, 300, true, &e), 0);
	assert_int_equal(tls_refresh(t, &e), 1);
	assert_false(tls_expiry_warning_due(t, now + DAY + 3, text, sizeof text));
	tls_close(t);
}

/* A certificate is not valid longer than its authority: both are named. Another authority in ca.pem does not matter. */
static void expiry_of_the_authority_is_named(void **state)
{
	(void)state;
	char text[384], command[512];
	struct error e;
	struct tls *t = open_party("old", 7, 825);
	time_t now = time(NULL);
	assert_true(tls_expiry_warning(t, now, text, sizeof text));
	assert_non_null(strstr(text, "the certificate of node expires in 7 days"));
	assert_non_null(strstr(text, "; the authority's certificate expires in 7 days"));
	tls_close(t);
	t = open_party("new", 3650, 825);
	snprintf(command, sizeof command, "cat %s/old/ca.pem >>%s/new/node/ca.pem", root, root);
	assert_int_equal(system(command), 0);
	assert_int_equal(tls_refresh(t, &e), 1);
	assert_in_range(tls_authority_expiry(t), now + 3600 * DAY, now + 3651 * DAY);
	assert_false(tls_expiry_warning(t, now, text, sizeof text));
	tls_close(t);
}

static void unreadable_certificate_is_loaded_later(void **state)
{
	(void)state;
	char ca[128];
	struct error e;
	struct rlimit limit, none;
	struct tls *t = open_party("later", 400, 10);
	time_t before = tls_own_certificate(t)->expiry_time;
	snprintf(ca, sizeof ca, "%s/later", root);
	assert_int_equal(authority_issue(ca, "node", TLS_WORKER, 300, true, &e), 0);
	assert_int_equal(getrlimit(RLIMIT_NOFILE, &limit), 0);
	none = (struct rlimit){0, limit.rlim_max};
	assert_int_equal(setrlimit(RLIMIT_NOFILE, &none), 0);
	int first = tls_refresh(t, &e), second = tls_refresh(t, &e);
	assert_int_equal(setrlimit(RLIMIT_NOFILE, &limit), 0);
	assert_true(first < 0 && second == 0); /* the failure is reported once */
	assert_true(tls_own_certificate(t)->expiry_time == before);
	assert_int_equal(tls_refresh(t, &e), 1);
	assert_true(tls_own_certificate(t)->expiry_time > before);
	assert_int_equal(tls_refresh(t, &e), 0);
	tls_close(t);
}

/* A folder must stay that of the same party. */
static void renewal_cannot_change_the_role(void **state)
{
	(void)state;
	char ca[128], old_path[160], new_path[160];
	struct error e;
	tls_close(open_party("kept", 100, 50));
	snprintf(ca, sizeof ca, "%s/kept", root);
	for (enum tls_role r = TLS_COORDINATOR; r < TLS_ROLES; r++)
		assert_int_equal(authority_issue(ca, "node", r, 5, true, &e), r == TLS_WORKER ? 0 : -EEXIST);
	assert_non_null(strstr(
		e.text, "/node/cert.pem belongs to the worker node: --renew cannot change the role to operator"));
	snprintf(old_path, sizeof old_path, "%s/node", ca);
	snprintf(new_path, sizeof new_path, "%s/moved", ca);
	assert_int_equal(rename(old_path, new_path), 0);
	assert_int_equal(authority_issue(ca, "moved", TLS_WORKER, 5, true, &e), -EEXIST);
	assert_int_equal(authority_issue(ca, "node", TLS_CLIENT, 5, true, &e), 0); /* the folder is gone */
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(warning_comes_two_weeks_before_expiry),
		cmocka_unit_test(warning_repeats_daily_and_after_a_reload),
		cmocka_unit_test(expiry_of_the_authority_is_named),
		cmocka_unit_test(unreadable_certificate_is_loaded_later),
		cmocka_unit_test(renewal_cannot_change_the_role),
	};
	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
