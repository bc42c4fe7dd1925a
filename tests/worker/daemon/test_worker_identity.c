/* SPDX-License-Identifier: Apache-2.0 */
/* Starts are counted, whatever the file contains; the home's name remains the same as long as its file exists. */
#include "worker/daemon/worker_identity.h"

#include "common/base/disk.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/hslt-identity.XXXXXX";

static struct worker_identity begin_identity(const char *name)
{
	struct worker_identity l;
	struct error e;
	assert_int_equal(worker_identity_count_start(&l, folder, name, &e), 0);
	assert_int_equal(strlen(l.home), WORKER_IDENTITY_HOME_SIZE - 1);
	assert_int_equal(strspn(l.home, "0123456789abcdef"), WORKER_IDENTITY_HOME_SIZE - 1);
	return l;
}

static void write_text(const char *name, const char *text)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fputs(text, f);
	fclose(f);
}

static void starts_are_counted(void **state)
{
	(void)state;
	struct worker_identity first = begin_identity("a");
	assert_int_equal(first.restarts, 1);
	for (uint64_t i = 2; i < 20; i++) {
		struct worker_identity l = begin_identity("a");
		assert_int_equal(l.restarts, i);
		assert_string_equal(l.home, first.home);
	}
	assert_string_not_equal(begin_identity("b").home, first.home);
}

static void damaged_identity_is_replaced(void **state)
{
	(void)state;
	static const char *const texts[] = {"",
					    "\n",
					    "7",
					    "zz 3\n",
					    "0123456789abcdef 3\n",
					    "0123456789abcdef0123456789abcdef",
					    "0123456789abcdef0123456789abcdef -1\n",
					    "0123456789abcdef0123456789abcdef 18446744073709551615\n"};
	struct worker_identity first = begin_identity("c");
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		write_text("c", texts[i]);
		struct worker_identity l = begin_identity("c");
		assert_int_equal(l.restarts, 1);
		assert_string_not_equal(l.home, first.home);
	}
	write_text("c", "0123456789abcdef0123456789abcdef 41\n");
	assert_int_equal(begin_identity("c").restarts, 42);
}

static int fail_fsync(int fd)
{
	(void)fd;
	errno = ENOSPC;
	return -1;
}

/* With a full disk the start is not counted, and the file remains unchanged. */
static void full_disk_leaves_the_identity_unchanged(void **state)
{
	(void)state;
	struct disk bad = disk_system;
	struct worker_identity before = begin_identity("d"), l;
	struct error e;
	bad.fsync = fail_fsync;
	disk_set_calls(&bad);
	int rc = worker_identity_count_start(&l, folder, "d", &e);
	disk_set_calls(NULL);
	assert_int_equal(rc, -ENOSPC);
	assert_string_equal(l.home, "");
	l = begin_identity("d");
	assert_int_equal(l.restarts, 2);
	assert_string_equal(l.home, before.home);
}

static int set_up(void **state)
{
	(void)state;
	return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state)
{
	(void)state;
	char command[64];
	snprintf(command, sizeof command, "rm -r %s", folder);
	return system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(starts_are_counted),
					   cmocka_unit_test(damaged_identity_is_replaced),
					   cmocka_unit_test(full_disk_leaves_the_identity_unchanged)};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
