/* SPDX-License-Identifier: Apache-2.0 */
/* A file that cannot be replaced stays as it was, whichever call fails, and the error is that call's. A file that
 * already has the name of the temporary file is not written to, and its mode is not copied. */
#include "common/base/disk.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char path[200], temporary[210];
static struct error e;

static int fail_open(const char *name, int flags, mode_t mode)
{
	(void)name, (void)flags, (void)mode;
	errno = EMFILE;
	return -1;
}

static ssize_t fail_write(int fd, const void *bytes, size_t size)
{
	(void)fd, (void)bytes, (void)size;
	errno = 0; /* the answer of a full disk */
	return 0;
}

static int fail_fsync(int fd)
{
	(void)fd;
	errno = EIO;
	return -1;
}

static int fail_close(int fd)
{
	disk_system.close(fd);
	errno = EDQUOT;
	return -1;
}

static int fail_rename(const char *from, const char *to)
{
	(void)from, (void)to;
	errno = EACCES;
	return -1;
}

static void check_replace(struct disk failing_disk, int expected_rc)
{
	char text[8] = "";
	e.text[0] = 0;
	disk_set_calls(&failing_disk);
	int rc = disk_replace(path, "new", 3, 0600, &e);
	disk_set_calls(NULL);
	assert_int_equal(rc, expected_rc);
	assert_true(!expected_rc || strstr(e.text, strerror(-expected_rc)));
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	assert_int_equal(fread(text, 1, sizeof text, f), 3);
	fclose(f);
	assert_string_equal(text, expected_rc ? "old" : "new");
	assert_int_not_equal(access(temporary, F_OK), 0);
}

static void failed_replace_keeps_the_old_file(void **state)
{
	(void)state;
	snprintf(path, sizeof path, "%s/file", temporary_folder);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	assert_int_equal(disk_replace(path, "old", 3, 0600, &e), 0);
	struct disk bad[5] = {disk_system, disk_system, disk_system, disk_system, disk_system};
	bad[0].open = fail_open;
	bad[1].write = fail_write;
	bad[2].fsync = fail_fsync;
	bad[3].close = fail_close;
	bad[4].rename = fail_rename;
	const int codes[5] = {-EMFILE, -ENOSPC, -EIO, -EDQUOT, -EACCES};
	for (int i = 0; i < 5; i++)
		check_replace(bad[i], codes[i]);
	check_replace(disk_system, 0);
}

static void replace_with_mode(mode_t mode)
{
	struct stat st;
	assert_int_equal(disk_replace(path, "new", 3, mode, &e), 0);
	assert_int_equal(lstat(path, &st), 0);
	assert_int_equal(st.st_mode, S_IFREG | mode);
}

static void existing_temporary_file_is_not_written_to(void **state)
{
	(void)state;
	char other[200];
	struct stat st;
	snprintf(path, sizeof path, "%s/file", temporary_folder);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	snprintf(other, sizeof other, "%s/other", temporary_folder);
	const mode_t before = umask(077);
	replace_with_mode(0644); /* others may read the file, as requested */
	umask(before);
	fclose(fopen(temporary, "w"));
	assert_int_equal(chmod(temporary, 0666), 0);
	replace_with_mode(0600);
	fclose(fopen(other, "w"));
	assert_int_equal(symlink(other, temporary), 0);
	replace_with_mode(0600);
	assert_true(stat(other, &st) == 0 && st.st_size == 0);
}

/* A list that fails after any number of names reports the failure instead of the end; the names before it are seen. */
static void failed_listing_reports_its_error(void **state)
{
	(void)state;
	enum { FILES = 4 };
	struct disk_list l;
	char inside[200];
	for (int i = 0; i < FILES; i++) {
		snprintf(inside, sizeof inside, "%s/%d", temporary_folder, i);
		fclose(fopen(inside, "w"));
	}
	for (int readable_count = 0; readable_count <= FILES + 1; readable_count++) {
		int seen_count = 0;
		failing_list_begin(temporary_folder, readable_count, ESTALE);
		disk_list_begin(&l, temporary_folder);
		for (const char *name; (name = disk_list_next(&l));) {
			assert_true(name[0] >= '0' && name[0] < '0' + FILES && !name[1]);
			seen_count++;
		}
		assert_true(readable_count > FILES || !disk_list_next(&l)); /* and returns no more names */
		assert_int_equal(disk_list_end(&l, 0, &e), readable_count > FILES ? 0 : -ESTALE);
		assert_int_equal(seen_count, readable_count > FILES ? FILES : readable_count);
		assert_true(readable_count > FILES || strstr(e.text, temporary_folder));
		failing_list_end();
	}
	snprintf(inside, sizeof inside, "%s/none", temporary_folder);
	disk_list_begin(&l, inside);
	assert_null(disk_list_next(&l));
	assert_int_equal(disk_list_end(&l, 0, NULL), -ENOENT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(failed_replace_keeps_the_old_file, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(existing_temporary_file_is_not_written_to, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(failed_listing_reports_its_error, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
