/* SPDX-License-Identifier: Apache-2.0 */
/* Which file a program's output path leads to, and what is there afterwards: files are replaced, links and devices
 * stay. */
#include "common/base/output_target.h"
#include "common/exr/image_file.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

static char folder[64];

static int enter_folder(void **state)
{
	(void)state;
	snprintf(folder, sizeof folder, "/tmp/hslt-target.XXXXXX");
	return mkdtemp(folder) && chdir(folder) == 0 && mkdir("a", 0700) == 0 && mkdir("b", 0700) == 0 ? 0 : -1;
}

static int leave_folder(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return chdir("/") || system(command);
}

static void expect_write_succeeds(const char *path, const char *text)
{
	struct error e;
	assert_int_equal(image_file_probe(path, &e), 0);
	int rc = image_file_write(path, (const unsigned char *)text, strlen(text), &e);
	if (rc)
		fail_msg("%s", e.text);
}

static void expect_content(const char *path, const char *text)
{
	char got[64] = "";
	int fd = open(path, O_RDONLY);
	assert_true(fd >= 0);
	assert_int_equal(read(fd, got, sizeof got - 1), strlen(text));
	assert_string_equal(got, text);
	close(fd);
}

static mode_t file_type(const char *path)
{
	struct stat st;
	assert_int_equal(lstat(path, &st), 0);
	return st.st_mode & S_IFMT;
}

static void files_are_replaced(void **state)
{
	(void)state;
	expect_write_succeeds("a/file", "one");
	int before = open("a/file", O_RDONLY);
	expect_write_succeeds("a/file", "two");
	char got[8] = "";
	assert_int_equal(read(before, got, 7), 3); /* a process that has the file open still sees the whole old file */
	assert_string_equal(got, "one");
	close(before);
	expect_content("a/file", "two");
}

static void links_are_followed_and_kept(void **state)
{
	(void)state;
	struct error e;
	expect_write_succeeds("b/real", "old");
	assert_int_equal(symlink("../b/real", "a/link"), 0);
	assert_int_equal(symlink("link", "a/second"), 0);
	expect_write_succeeds("a/second", "new");
	assert_int_equal(file_type("a/second"), S_IFLNK);
	assert_int_equal(file_type("a/link"), S_IFLNK);
	assert_int_equal(file_type("b/real"), S_IFREG);
	expect_content("b/real", "new");
	assert_int_equal(symlink("../b/none", "a/dangling"), 0);
	expect_write_succeeds("a/dangling", "made");
	assert_int_equal(file_type("a/dangling"), S_IFLNK);
	expect_content("b/none", "made");
	assert_int_equal(symlink("round", "a/round"), 0);
	assert_int_equal(image_file_write("a/round", (const unsigned char *)"x", 1, &e), -ELOOP);
	assert_int_equal(image_file_write("a", (const unsigned char *)"x", 1, &e), -EISDIR);
}

static void pipes_and_devices_stay(void **state)
{
	(void)state;
	char got[8] = "", name[32];
	assert_int_equal(mkfifo("a/pipe", 0600), 0);
	int reader = open("a/pipe", O_RDONLY | O_NONBLOCK);
	expect_write_succeeds("a/pipe", "said");
	assert_int_equal(read(reader, got, 7), 4);
	assert_string_equal(got, "said");
	assert_int_equal(file_type("a/pipe"), S_IFIFO);
	close(reader);
	/* A device made by this test, and a link to it, like /dev/stdout. */
	if (mknod("a/null", S_IFCHR | 0600, makedev(1, 3)) == 0) {
		int fd = open("a/null", O_WRONLY);
		if (fd >= 0) { /* skipped where devices do not work */
			expect_write_succeeds("a/null", "gone");
			assert_int_equal(symlink("null", "a/to-null"), 0);
			expect_write_succeeds("a/to-null", "gone");
			assert_int_equal(file_type("a/to-null"), S_IFLNK);
			close(fd);
		}
		assert_int_equal(file_type("a/null"), S_IFCHR);
	}
	/* A descriptor: output is appended to what was written there before. */
	int fd = open("a/log", O_RDWR | O_CREAT, 0600);
	assert_int_equal(write(fd, "1,", 2), 2);
	snprintf(name, sizeof name, "/dev/fd/%d", fd);
	expect_write_succeeds(name, "2");
	expect_content("a/log", "1,2");
	close(fd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(files_are_replaced, enter_folder, leave_folder),
		cmocka_unit_test_setup_teardown(links_are_followed_and_kept, enter_folder, leave_folder),
		cmocka_unit_test_setup_teardown(pipes_and_devices_stay, enter_folder, leave_folder),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
