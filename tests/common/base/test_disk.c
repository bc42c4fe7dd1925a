/* SPDX-License-Identifier: Apache-2.0 */
/* A file that cannot be replaced stays as it was, whichever call fails, and the error is that call's. A file that
 * already has the name of the temporary file is not written to, and its mode is not copied. */
#include "common/base/disk.h"
#include "tests/support/failing_list.h"
#include "tests/support/folder.h"

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

static int no_open(const char *name, int flags, mode_t mode)
{
	(void)name, (void)flags, (void)mode;
	errno = EMFILE;
	return -1;
}

static ssize_t no_room(int fd, const void *bytes, size_t size)
{
	(void)fd, (void)bytes, (void)size;
	errno = 0; /* the answer of a full disk */
	return 0;
}

static int no_flush(int fd)
{
	(void)fd;
	errno = EIO;
	return -1;
}

static int no_close(int fd)
{
	disk_system.close(fd);
	errno = EDQUOT;
	return -1;
}

static int no_rename(const char *from, const char *to)
{
	(void)from, (void)to;
	errno = EACCES;
	return -1;
}

static void check(struct disk own, int want)
{
	char text[8] = "";
	e.text[0] = 0;
	disk_use(&own);
	int rc = disk_replace(path, "new", 3, 0600, &e);
	disk_use(NULL);
	assert_int_equal(rc, want);
	assert_true(!want || strstr(e.text, strerror(-want)));
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	assert_int_equal(fread(text, 1, sizeof text, f), 3);
	fclose(f);
	assert_string_equal(text, want ? "old" : "new");
	assert_int_not_equal(access(temporary, F_OK), 0);
}

static void replaced_or_unchanged(void **state)
{
	(void)state;
	snprintf(path, sizeof path, "%s/file", folder);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	assert_int_equal(disk_replace(path, "old", 3, 0600, &e), 0);
	struct disk bad[5] = {disk_system, disk_system, disk_system, disk_system, disk_system};
	bad[0].open = no_open;
	bad[1].write = no_room;
	bad[2].fsync = no_flush;
	bad[3].close = no_close;
	bad[4].rename = no_rename;
	const int codes[5] = {-EMFILE, -ENOSPC, -EIO, -EDQUOT, -EACCES};
	for (int i = 0; i < 5; i++)
		check(bad[i], codes[i]);
	check(disk_system, 0);
}

static void replace_with_mode(mode_t mode)
{
	struct stat st;
	assert_int_equal(disk_replace(path, "new", 3, mode, &e), 0);
	assert_int_equal(lstat(path, &st), 0);
	assert_int_equal(st.st_mode, S_IFREG | mode);
}

static void another_file_in_its_way(void **state)
{
	(void)state;
	char other[200];
	struct stat st;
	snprintf(path, sizeof path, "%s/file", folder);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	snprintf(other, sizeof other, "%s/other", folder);
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
static void a_list_that_fails_midway(void **state)
{
	(void)state;
	enum { FILES = 4 };
	struct disk_list l;
	char inside[200];
	for (int i = 0; i < FILES; i++) {
		snprintf(inside, sizeof inside, "%s/%d", folder, i);
		fclose(fopen(inside, "w"));
	}
	for (int most = 0; most <= FILES + 1; most++) {
		int seen = 0;
		failing_list_begin(folder, most, ESTALE);
		disk_list_begin(&l, folder);
		for (const char *name; (name = disk_list_next(&l));) {
			assert_true(name[0] >= '0' && name[0] < '0' + FILES && !name[1]);
			seen++;
		}
		assert_true(most > FILES || !disk_list_next(&l)); /* and returns no more names */
		assert_int_equal(disk_list_end(&l, 0, &e), most > FILES ? 0 : -ESTALE);
		assert_int_equal(seen, most > FILES ? FILES : most);
		assert_true(most > FILES || strstr(e.text, folder));
		failing_list_end();
	}
	snprintf(inside, sizeof inside, "%s/none", folder);
	disk_list_begin(&l, inside);
	assert_null(disk_list_next(&l));
	assert_int_equal(disk_list_end(&l, 0, NULL), -ENOENT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(replaced_or_unchanged, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(another_file_in_its_way, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_list_that_fails_midway, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
