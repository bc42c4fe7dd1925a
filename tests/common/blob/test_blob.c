/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The store of files by their hash: it keeps the files that it was given, refuses bytes with another hash, evicts the
 * files that were used longest ago and that nobody holds, and detects files that were damaged or removed meanwhile.
 * Errors of the disk are in test_blob_disk.c.
 */
#include "common/base/disk.h"
#include "common/blob/blob_batch.h"
#include "common/blob/blob_check.h"
#include "common/blob/blob_state.h"
#include "tests/support/blob_text.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Test vector of FIPS 180-2, appendix B.1. */
static void sha_256_matches_its_test_vector(void **state)
{
	(void)state;
	struct blob_hash h;
	struct error e;
	char hex[BLOB_HEX_SIZE];
	assert_int_equal(blob_hash_bytes("abc", 3, &h, &e), 0);
	blob_hash_to_hex(&h, hex);
	assert_string_equal(hex, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

static void stored_file_is_read_back_after_reopening(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	uint64_t size;
	char text[16] = "";
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	struct blob_hash h = blob_text_store(s, "hello, farm");
	blob_store_close(s);
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0); /* opened again */
	assert_true(blob_is_stored(s, &h, &size));
	assert_int_equal(size, 11);
	int fd = blob_open(s, &h, &size, &e);
	assert_true(fd >= 0);
	assert_int_equal(read(fd, text, sizeof text), 11);
	assert_string_equal(text, "hello, farm");
	close(fd);
	struct blob_hash other = h;
	other.bytes[0] ^= 1;
	assert_int_equal(blob_open(s, &other, &size, &e), -ENOENT);
	blob_text_store(s, "hello, farm"); /* storing a file twice has the effect of storing it once */
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 11);
	blob_store_close(s);
}

static void bytes_with_the_wrong_hash_are_refused(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w;
	struct blob_hash h;
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	assert_int_equal(blob_hash_bytes("true", 4, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, &h, 5, &e), 0);
	assert_int_equal(blob_write_append(w, "false", 5, &e), 0);
	assert_int_equal(blob_write_append(w, "!", 1, &e), -EMSGSIZE);
	assert_int_equal(blob_write_commit(w, &e), -EBADMSG);
	assert_int_equal(blob_write_begin(&w, s, &h, 4, &e), 0);
	assert_int_equal(blob_write_append(w, "tru", 3, &e), 0);
	assert_int_equal(blob_write_commit(w, &e), -EBADMSG); /* too short */
	assert_false(blob_is_stored(s, &h, NULL));
	blob_store_close(s);
	char command[128];
	snprintf(command, sizeof command, "test -z \"$(ls -A '%s')\"", temporary_folder);
	assert_int_equal(system(command), 0); /* no temporary file is left */
}

static void oldest_unheld_file_is_evicted(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 30, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij"),
			 c = blob_text_store(s, "ABCDEFGHIJ");
	blob_release(s, &a);
	blob_release(s, &b);
	assert_true(blob_hold(s, &a)); /* a is now younger than b */
	blob_release(s, &a);
	struct blob_hash d = blob_text_store(s, "!@#$%^&*()");
	assert_false(blob_is_stored(s, &b, NULL));
	assert_true(blob_is_stored(s, &a, NULL) && blob_is_stored(s, &c, NULL) && blob_is_stored(s, &d, NULL));
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 30);
	assert_true(blob_hold(s, &a));
	assert_int_equal(blob_write_begin(&w, s, &b, 10, &e), -EFBIG); /* all bytes are in use */
	assert_int_equal(blob_write_begin(&w, s, &b, 31, &e), -EMSGSIZE);
	blob_store_close(s);
}

/* The last twenty of a hundred files fit; whenever the store is opened, these are there and no others. */
static void reopened_store_has_the_files_that_fit(void **state)
{
	(void)state;
	enum { MANY = 100, FIT = 20 };
	struct blob_hash h[MANY];
	struct blob_store *s;
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 4 * FIT, &e), 0);
	for (int i = 0; i < MANY; i++) {
		char text[8];
		snprintf(text, sizeof text, "%04d", i);
		h[i] = blob_text_store(s, text);
		blob_release(s, &h[i]);
	}
	for (int start = 0; start < 2; start++) {
		for (int i = 0; i < MANY; i++)
			assert_true(blob_is_stored(s, &h[i], NULL) == (i >= MANY - FIT));
		assert_int_equal(blob_text_folder_bytes(temporary_folder), 4 * FIT);
		blob_store_close(s);
		assert_int_equal(blob_store_open(&s, temporary_folder, 4 * FIT, &e), 0);
	}
	blob_store_close(s);
}

/* The bytes that two writers have sent must fit below the limit together; bytes that were only announced take no room.
 */
static void only_received_bytes_count_against_the_limit(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w[3];
	struct blob_hash a = blob_text_hash("0123456789"), b = blob_text_hash("abcdefghij");
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 25, &e), 0);
	assert_int_equal(blob_write_begin(&w[0], s, &a, 26, &e), -EMSGSIZE);
	assert_int_equal(blob_write_begin(&w[0], s, &a, 10, &e), 0);
	assert_int_equal(blob_write_begin(&w[1], s, &b, 25, &e), 0);
	assert_int_equal(blob_write_begin(&w[2], s, &a, 10, &e), 0);
	assert_int_equal(blob_write_append(w[1], "0123456789abcdef", 16, &e), 0);
	assert_int_equal(blob_write_append(w[0], "0123456789", 10, &e), -EFBIG);
	blob_write_abort(w[1]);
	for (int i = 0; i < 3; i += 2) { /* the second writer finds the file stored */
		assert_int_equal(blob_write_append(w[i], "0123456789", 10, &e), 0);
		assert_int_equal(blob_write_commit(w[i], &e), 0);
	}
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 10);
	assert_int_equal(blob_write_begin(&w[1], s, &b, 15, &e), 0); /* all that had arrived was given back */
	blob_write_abort(w[1]);
	blob_store_close(s);
}

/* A writer that announces a large file and sends little of it takes only as much room as it sent. */
static void files_are_evicted_as_bytes_arrive(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w, *other;
	struct blob_hash large = blob_text_hash("a large file"), small = blob_text_hash("small");
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 30, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij");
	blob_release(s, &a);
	blob_release(s, &b);
	assert_int_equal(blob_write_begin(&w, s, &large, 28, &e), 0);
	assert_true(blob_is_stored(s, &a, NULL) && blob_is_stored(s, &b, NULL));
	assert_int_equal(blob_write_begin(&other, s, &small, 5, &e), 0);
	blob_write_abort(other);
	assert_int_equal(blob_write_append(w, "0123456789", 10, &e), 0);
	assert_true(blob_is_stored(s, &a, NULL) && blob_is_stored(s, &b, NULL));
	assert_int_equal(blob_write_append(w, "0", 1, &e), 0);
	assert_false(blob_is_stored(s, &a, NULL));
	assert_true(blob_is_stored(s, &b, NULL));
	assert_true(blob_hold(s, &b)); /* b is the only file left to evict */
	assert_int_equal(blob_write_append(w, "123456789", 9, &e), 0);
	assert_int_equal(blob_write_append(w, "0", 1, &e), -EFBIG);
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 30);
	blob_write_abort(w);
	assert_int_equal(blob_write_begin(&w, s, &large, 20, &e), 0);
	blob_write_abort(w);
	assert_true(blob_is_stored(s, &b, NULL));
	blob_store_close(s);
}

/* After a restart with a smaller limit, files that are held before the store is trimmed stay, even the oldest. */
static void files_held_before_a_trim_survive_it(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij");
	blob_store_close(s);
	assert_int_equal(blob_store_open(&s, temporary_folder, 5, &e), 0);
	assert_true(blob_hold(s, &a));
	blob_store_trim(s);
	assert_true(blob_is_stored(s, &a, NULL));
	assert_false(blob_is_stored(s, &b, NULL));
	blob_release(s, &a);
	blob_store_trim(s);
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 0);
	blob_store_close(s);
}

/* Any byte is damaged: a check detects it, the file is moved aside and no longer given out; writing the file again
 * restores it, and its holders still hold it. */
static void damaged_file_is_moved_aside_until_rewritten(void **state)
{
	(void)state;
	static const char text[] = "bytes that are to stay as they are";
	struct blob_store *s;
	struct error e;
	char path[4096], damaged[300], hex[BLOB_HEX_SIZE];
	uint64_t size;
	assert_int_equal(blob_store_open(&s, temporary_folder, 1000, &e), 0);
	struct blob_hash h = blob_text_store(s, text), other;
	assert_int_equal(blob_hash_bytes("x", 1, &other, &e), 0);
	blob_path(s, &h, path, sizeof path);
	blob_hash_to_hex(&h, hex);
	snprintf(damaged, sizeof damaged, "%s/damaged.%s", temporary_folder, hex);
	for (size_t offset = 0; offset < strlen(text); offset++) {
		int fd = open(path, O_WRONLY);
		char wrong = (char)(text[offset] ^ 1);
		assert_int_equal(pwrite(fd, &wrong, 1, (off_t)offset), 1);
		close(fd);
		assert_int_equal(blob_check(s, &h, 1000, &e), 0); /* the file was just written, and is not read again */
		assert_int_equal(blob_check(s, &h, BLOB_SINCE_OPENED, &e), 0);
		if (offset % 2) { /* whoever was given the file may have wrong bytes */
			close(blob_open(s, &h, &size, &e));
			assert_int_equal(blob_check(s, &h, 1000, &e), 0);
		}
		assert_int_equal(blob_check(s, &h, offset % 2 ? BLOB_SINCE_OPENED : 0, &e), -EBADMSG);
		assert_non_null(strstr(e.text, "damaged"));
		assert_true(access(path, F_OK) != 0 && access(damaged, F_OK) == 0);
		assert_true(!blob_is_stored(s, &h, NULL) && !blob_hold(s, &h) &&
			    blob_open(s, &h, &size, &e) == -ENOENT);
		assert_int_equal(blob_check(s, &h, 0, &e), -ENOENT);
		blob_text_store(s, text);
		assert_int_equal(blob_check(s, &h, 0, &e), 0);
		assert_true(blob_is_stored(s, &h, &size) && size == strlen(text));
	}
	for (int seconds = 0; seconds <= 1000; seconds += 1000) { /* however recently the file was read */
		unlink(path);
		assert_int_equal(blob_check(s, &h, seconds, &e), -EBADMSG);
		assert_non_null(strstr(e.text, "gone"));
		blob_text_store(s, text);
		blob_release(s, &h);
	}
	unlink(path);
	assert_int_equal(blob_check(s, &h, BLOB_SINCE_OPENED, &e), -EBADMSG);
	assert_int_equal(blob_hold_expected(s, &h, &e), 0);
	assert_int_equal(blob_hold_expected(s, &other, &e), 0); /* a file that was never there */
	assert_false(blob_is_stored(s, &other, NULL));
	blob_text_store(s, "x");
	blob_release(s, &other);
	blob_text_store(s, text);
	for (int i = 0; i < 40; i++) { /* more files than there is room for: held ones stay */
		char more[64];
		snprintf(more, sizeof more, "something else of fifty bytes or so, number %d", i);
		struct blob_hash m = blob_text_store(s, more);
		blob_release(s, &m);
	}
	assert_true(blob_is_stored(s, &h, NULL) && blob_is_stored(s, &other, NULL));
	blob_store_close(s);
}

/* The removed folder is made again; the files that were in it are found missing when they are used. */
static void removed_folder_is_recreated(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	char inside[300], path[4096];
	uint64_t size;
	snprintf(inside, sizeof inside, "%s/inside", temporary_folder);
	assert_int_equal(blob_store_open(&s, inside, 1000, &e), 0);
	struct blob_hash h = blob_text_store(s, "lost");
	blob_path(s, &h, path, sizeof path);
	assert_int_equal(unlink(path), 0);
	assert_int_equal(rmdir(inside), 0);
	struct blob_hash other = blob_text_store(s, "stored after that");
	assert_true(blob_is_stored(s, &other, &size) && size == 17);
	assert_int_equal(blob_check(s, &h, 1000, &e), -EBADMSG);
	blob_text_store(s, "lost");
	assert_int_equal(blob_check(s, &h, 0, &e), 0);
	blob_store_close(s);
}

/* A check in parts, and what happens to the file between these parts. */
static void file_may_change_between_the_parts_of_a_check(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_check *c, *other;
	struct error e;
	char path[4096];
	uint64_t size;
	assert_int_equal(blob_store_open(&s, temporary_folder, 30, &e), 0);
	struct blob_hash h = blob_text_store(s, "bytes that are checked");
	blob_release(s, &h);
	blob_path(s, &h, path, sizeof path);
	/* the check ends early: nothing is known, and nothing is lost */
	assert_int_equal(blob_check_begin(&c, s, &h, 0, &e), 1);
	assert_int_equal(blob_check_end(c, &e), -ECANCELED);
	close(blob_open(s, &h, &size, &e));
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_OPENED, &e), 1);
	assert_int_equal(blob_check_end(c, &e), -ECANCELED);
	/* the file is held, and given out again before its check has ended */
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_OPENED, &e), 1);
	assert_true(blob_is_being_checked(s, &h));
	struct blob_hash more = blob_text_hash("other bytes, too many of them");
	struct blob_writer *w;
	assert_int_equal(blob_write_begin(&w, s, &more, 29, &e), -EFBIG);
	close(blob_open(s, &h, &size, &e));
	while (blob_check_read(c))
		continue;
	assert_int_equal(blob_check_end(c, &e), 0);
	assert_false(blob_is_being_checked(s, &h));
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_OPENED, &e), 1);
	/* two checks find the damage at once, and the file is written again before the second one reports it */
	assert_int_equal(truncate(path, 3), 0);
	assert_int_equal(blob_check_begin(&other, s, &h, 0, &e), 1);
	while (blob_check_read(c) || blob_check_read(other))
		continue;
	assert_int_equal(blob_check_end(c, &e), -EBADMSG);
	blob_text_store(s, "bytes that are checked");
	assert_int_equal(blob_check_end(other, &e), 0);
	assert_true(blob_is_stored(s, &h, &size) && size == 22);
	blob_store_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sha_256_matches_its_test_vector),
		cmocka_unit_test_setup_teardown(stored_file_is_read_back_after_reopening, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(bytes_with_the_wrong_hash_are_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(oldest_unheld_file_is_evicted, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(only_received_bytes_count_against_the_limit, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(files_are_evicted_as_bytes_arrive, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(files_held_before_a_trim_survive_it, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(damaged_file_is_moved_aside_until_rewritten, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(removed_folder_is_recreated, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(file_may_change_between_the_parts_of_a_check, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(reopened_store_has_the_files_that_fit, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
