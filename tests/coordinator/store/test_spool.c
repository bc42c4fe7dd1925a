/* SPDX-License-Identifier: Apache-2.0 */
/* A spool belongs to one coordinator, and has a folder for each job. */
#include "coordinator/store/spool.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void spool_belongs_to_one_coordinator(void **state)
{
	(void)state;
	struct spool *a, *b;
	struct error e;
	assert_int_equal(spool_open(&a, temporary_folder, &e), 0);
	assert_int_equal(spool_open(&b, temporary_folder, &e), -EBUSY);
	spool_close(a);
	assert_int_equal(spool_open(&b, temporary_folder, &e), 0);
	spool_close(b);
}

static void jobs_have_folders(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	char path[SPOOL_PATH_MAX];
	uint64_t *ids;
	size_t count;
	assert_int_equal(spool_open(&s, temporary_folder, &e), 0);
	assert_int_equal(spool_list_jobs(s, &ids, &count, &e), 0);
	assert_true(count == 0 && !ids);
	for (int i = 2; i >= 0; i--)
		assert_int_equal(spool_create_job_folder(s, 1 + 20 * (uint64_t)i, &e), 0);
	spool_path(s, "jobs/j07", path); /* not the name of a job's folder */
	assert_int_equal(mkdir(path, 0777), 0);
	assert_int_equal(spool_write_job_file(s, 21, "preview.exr", "bytes", 5, &e), 0);
	spool_job_path(s, 21, "preview.exr", path);
	assert_int_equal(access(path, F_OK), 0);
	assert_int_equal(spool_delete_job(s, 21, &e), 0);
	assert_int_equal(spool_list_jobs(s, &ids, &count, &e), 0);
	assert_true(count == 2 && ids[0] == 1 && ids[1] == 41);
	mem_free(ids);
	assert_true(spool_write_job_file(s, 21, "preview.exr", "bytes", 5, &e) < 0);
	spool_close(s);
}

static uint64_t ten_megabytes(const char *path)
{
	(void)path;
	return 10000000;
}

static uint64_t unknown_capacity(const char *path)
{
	(void)path;
	return 0;
}

static void bytes_beyond_the_disk_are_refused(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	struct disk small = disk_system;
	assert_int_equal(spool_open(&s, temporary_folder, &e), 0);
	assert_int_equal(spool_check_capacity(s, UINT64_MAX, &e), -ENOSPC);
	small.capacity = ten_megabytes;
	disk_set_calls(&small);
	assert_int_equal(spool_check_capacity(s, 10000000, &e), 0);
	assert_int_equal(spool_check_capacity(s, 10000001, &e), -ENOSPC);
	assert_non_null(strstr(e.text, "the coordinator's spool has 10 MB in all"));
	small.capacity = unknown_capacity;
	assert_int_equal(spool_check_capacity(s, UINT64_MAX, &e), 0);
	disk_set_calls(NULL);
	spool_close(s);
}

static uint64_t little_space(const char *path)
{
	(void)path;
	return 4 * SPOOL_RESERVE_BYTES - 1;
}

/* A file is not written where a job that waits for room needs that room. */
static void reserve_is_kept_until_it_is_used(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	struct stat st;
	char path[SPOOL_PATH_MAX];
	struct disk small = disk_system;
	small.available = little_space;
	assert_int_equal(spool_open(&s, temporary_folder, &e), 0);
	spool_path(s, "reserve", path);
	for (int i = 0; i < 2; i++) {
		disk_set_calls(&small);
		spool_create_reserve(s);
		assert_false(spool_release_reserve(s));
		disk_set_calls(NULL);
		spool_create_reserve(s);
		spool_create_reserve(s);
		assert_int_equal(stat(path, &st), 0);
		assert_int_equal(st.st_size, SPOOL_RESERVE_BYTES);
		assert_true((uint64_t)st.st_blocks * 512 >= SPOOL_RESERVE_BYTES);
		assert_true(spool_release_reserve(s));
		assert_int_equal(access(path, F_OK), -1);
	}
	spool_close(s);
}

/* Folders that cannot be listed are an error, or their jobs would be forgotten; a job's folder that still has something
 * in it is not reported as gone. */
static void folder_that_cannot_be_listed_is_an_error(void **state)
{
	(void)state;
	struct spool *s;
	struct error e;
	char path[SPOOL_PATH_MAX];
	uint64_t *ids, bytes;
	size_t count;
	assert_int_equal(spool_open(&s, temporary_folder, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		assert_int_equal(spool_create_job_folder(s, id, &e), 0);
	failing_list_begin("/jobs", 2, EIO);
	assert_int_equal(spool_list_jobs(s, &ids, &count, &e), -EIO);
	assert_true(!ids && count == 0);
	failing_list_end();
	assert_int_equal(spool_write_job_file(s, 2, "checkpoint", "bytes", 5, &e), 0);
	assert_int_equal(spool_write_job_file(s, 2, "journal.1", "bytes", 5, &e), 0);
	failing_list_begin("/jobs/j2", 1, EIO);
	assert_int_equal(spool_film_bytes(s, 2, 1, &bytes, &e), -EIO);
	assert_int_equal(bytes, 5);
	assert_int_equal(spool_delete_job(s, 2, &e), -EIO);
	failing_list_end();
	assert_int_equal(spool_film_bytes(s, 2, 3, &bytes, &e), 0);
	assert_true(bytes == 5 || bytes == 15);
	assert_int_equal(spool_delete_job(s, 2, &e), 0);
	spool_job_path(s, 2, NULL, path);
	assert_int_not_equal(access(path, F_OK), 0);
	assert_int_equal(spool_film_bytes(s, 2, 1, &bytes, &e), 0); /* the job's folder is gone: it has no films */
	assert_int_equal(bytes, 0);
	assert_int_equal(spool_delete_job(s, 2, &e), 0);
	spool_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(spool_belongs_to_one_coordinator, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(bytes_beyond_the_disk_are_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(reserve_is_kept_until_it_is_used, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(jobs_have_folders, temporary_folder_set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(folder_that_cannot_be_listed_is_an_error, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
