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
#include "tests/support/folder.h"

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
static void knows_sha_256(void **state)
{
	(void)state;
	struct blob_hash h;
	struct error e;
	char hex[BLOB_HEX_SIZE];
	assert_int_equal(blob_hash_bytes("abc", 3, &h, &e), 0);
	blob_hex(&h, hex);
	assert_string_equal(hex, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

static void keeps_and_reads_back(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	uint64_t size;
	char text[16] = "";
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	struct blob_hash h = blob_text_store(s, "hello, farm");
	blob_store_close(s);
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0); /* opened again */
	assert_true(blob_has(s, &h, &size));
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
	assert_int_equal(blob_text_bytes(folder), 11);
	blob_store_close(s);
}

static void refuses_false_bytes(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w;
	struct blob_hash h;
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	assert_int_equal(blob_hash_bytes("true", 4, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, &h, 5, &e), 0);
	assert_int_equal(blob_write_add(w, "false", 5, &e), 0);
	assert_int_equal(blob_write_add(w, "!", 1, &e), -EMSGSIZE);
	assert_int_equal(blob_write_commit(w, &e), -EBADMSG);
	assert_int_equal(blob_write_begin(&w, s, &h, 4, &e), 0);
	assert_int_equal(blob_write_add(w, "tru", 3, &e), 0);
	assert_int_equal(blob_write_commit(w, &e), -EBADMSG); /* too short */
	assert_false(blob_has(s, &h, NULL));
	blob_store_close(s);
	char command[128];
	snprintf(command, sizeof command, "test -z \"$(ls -A '%s')\"", folder);
	assert_int_equal(system(command), 0); /* no temporary file is left */
}

static void forgets_the_oldest_that_nobody_holds(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 30, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij"),
			 c = blob_text_store(s, "ABCDEFGHIJ");
	blob_release(s, &a);
	blob_release(s, &b);
	assert_true(blob_hold(s, &a)); /* a is now younger than b */
	blob_release(s, &a);
	struct blob_hash d = blob_text_store(s, "!@#$%^&*()");
	assert_false(blob_has(s, &b, NULL));
	assert_true(blob_has(s, &a, NULL) && blob_has(s, &c, NULL) && blob_has(s, &d, NULL));
	assert_int_equal(blob_text_bytes(folder), 30);
	assert_true(blob_hold(s, &a));
	assert_int_equal(blob_write_begin(&w, s, &b, 10, &e), -EFBIG); /* all bytes are in use */
	assert_int_equal(blob_write_begin(&w, s, &b, 31, &e), -EMSGSIZE);
	blob_store_close(s);
}

/* The last twenty of a hundred files fit; whenever the store is opened, these are there and no others. */
static void knows_many(void **state)
{
	(void)state;
	enum { MANY = 100, FIT = 20 };
	struct blob_hash h[MANY];
	struct blob_store *s;
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 4 * FIT, &e), 0);
	for (int i = 0; i < MANY; i++) {
		char text[8];
		snprintf(text, sizeof text, "%04d", i);
		h[i] = blob_text_store(s, text);
		blob_release(s, &h[i]);
	}
	for (int start = 0; start < 2; start++) {
		for (int i = 0; i < MANY; i++)
			assert_true(blob_has(s, &h[i], NULL) == (i >= MANY - FIT));
		assert_int_equal(blob_text_bytes(folder), 4 * FIT);
		blob_store_close(s);
		assert_int_equal(blob_store_open(&s, folder, 4 * FIT, &e), 0);
	}
	blob_store_close(s);
}

/* The bytes that two writers have sent must fit below the limit together; bytes that were only announced take no room.
 */
static void room_is_taken_by_what_arrives(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w[3];
	struct blob_hash a = blob_text_hash("0123456789"), b = blob_text_hash("abcdefghij");
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 25, &e), 0);
	assert_int_equal(blob_write_begin(&w[0], s, &a, 26, &e), -EMSGSIZE);
	assert_int_equal(blob_write_begin(&w[0], s, &a, 10, &e), 0);
	assert_int_equal(blob_write_begin(&w[1], s, &b, 25, &e), 0);
	assert_int_equal(blob_write_begin(&w[2], s, &a, 10, &e), 0);
	assert_int_equal(blob_write_add(w[1], "0123456789abcdef", 16, &e), 0);
	assert_int_equal(blob_write_add(w[0], "0123456789", 10, &e), -EFBIG);
	blob_write_abort(w[1]);
	for (int i = 0; i < 3; i += 2) { /* the second writer finds the file stored */
		assert_int_equal(blob_write_add(w[i], "0123456789", 10, &e), 0);
		assert_int_equal(blob_write_commit(w[i], &e), 0);
	}
	assert_int_equal(blob_text_bytes(folder), 10);
	assert_int_equal(blob_write_begin(&w[1], s, &b, 15, &e), 0); /* all that had arrived was given back */
	blob_write_abort(w[1]);
	blob_store_close(s);
}

/* A writer that announces a large file and sends little of it takes only as much room as it sent. */
static void evicts_as_bytes_arrive(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_writer *w, *other;
	struct blob_hash large = blob_text_hash("a large file"), small = blob_text_hash("small");
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 30, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij");
	blob_release(s, &a);
	blob_release(s, &b);
	assert_int_equal(blob_write_begin(&w, s, &large, 28, &e), 0);
	assert_true(blob_has(s, &a, NULL) && blob_has(s, &b, NULL));
	assert_int_equal(blob_write_begin(&other, s, &small, 5, &e), 0);
	blob_write_abort(other);
	assert_int_equal(blob_write_add(w, "0123456789", 10, &e), 0);
	assert_true(blob_has(s, &a, NULL) && blob_has(s, &b, NULL));
	assert_int_equal(blob_write_add(w, "0", 1, &e), 0);
	assert_false(blob_has(s, &a, NULL));
	assert_true(blob_has(s, &b, NULL));
	assert_true(blob_hold(s, &b)); /* b is the only file left to evict */
	assert_int_equal(blob_write_add(w, "123456789", 9, &e), 0);
	assert_int_equal(blob_write_add(w, "0", 1, &e), -EFBIG);
	assert_int_equal(blob_text_bytes(folder), 30);
	blob_write_abort(w);
	assert_int_equal(blob_write_begin(&w, s, &large, 20, &e), 0);
	blob_write_abort(w);
	assert_true(blob_has(s, &b, NULL));
	blob_store_close(s);
}

/* After a restart with a smaller limit, files that are held before the store is trimmed stay, even the oldest. */
static void held_before_it_is_trimmed(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	struct blob_hash a = blob_text_store(s, "0123456789"), b = blob_text_store(s, "abcdefghij");
	blob_store_close(s);
	assert_int_equal(blob_store_open(&s, folder, 5, &e), 0);
	assert_true(blob_hold(s, &a));
	blob_store_trim(s);
	assert_true(blob_has(s, &a, NULL));
	assert_false(blob_has(s, &b, NULL));
	blob_release(s, &a);
	blob_store_trim(s);
	assert_int_equal(blob_text_bytes(folder), 0);
	blob_store_close(s);
}

/* Any byte is damaged: a check detects it, the file is moved aside and no longer given out; writing the file again
 * restores it, and its holders still hold it. */
static void damaged_at_rest(void **state)
{
	(void)state;
	static const char text[] = "bytes that are to stay as they are";
	struct blob_store *s;
	struct error e;
	char path[4096], damaged[300], hex[BLOB_HEX_SIZE];
	uint64_t size;
	assert_int_equal(blob_store_open(&s, folder, 1000, &e), 0);
	struct blob_hash h = blob_text_store(s, text), other;
	assert_int_equal(blob_hash_bytes("x", 1, &other, &e), 0);
	blob_path(s, &h, path, sizeof path);
	blob_hex(&h, hex);
	snprintf(damaged, sizeof damaged, "%s/damaged.%s", folder, hex);
	for (size_t at = 0; at < strlen(text); at++) {
		int fd = open(path, O_WRONLY);
		char wrong = (char)(text[at] ^ 1);
		assert_int_equal(pwrite(fd, &wrong, 1, (off_t)at), 1);
		close(fd);
		assert_int_equal(blob_check(s, &h, 1000, &e), 0); /* the file was just written, and is not read again */
		assert_int_equal(blob_check(s, &h, BLOB_SINCE_GIVEN, &e), 0);
		if (at % 2) { /* whoever was given the file may have wrong bytes */
			close(blob_open(s, &h, &size, &e));
			assert_int_equal(blob_check(s, &h, 1000, &e), 0);
		}
		assert_int_equal(blob_check(s, &h, at % 2 ? BLOB_SINCE_GIVEN : 0, &e), -EBADMSG);
		assert_non_null(strstr(e.text, "damaged"));
		assert_true(access(path, F_OK) != 0 && access(damaged, F_OK) == 0);
		assert_true(!blob_has(s, &h, NULL) && !blob_hold(s, &h) && blob_open(s, &h, &size, &e) == -ENOENT);
		assert_int_equal(blob_check(s, &h, 0, &e), -ENOENT);
		blob_text_store(s, text);
		assert_int_equal(blob_check(s, &h, 0, &e), 0);
		assert_true(blob_has(s, &h, &size) && size == strlen(text));
	}
	for (int seconds = 0; seconds <= 1000; seconds += 1000) { /* however recently the file was read */
		unlink(path);
		assert_int_equal(blob_check(s, &h, seconds, &e), -EBADMSG);
		assert_non_null(strstr(e.text, "gone"));
		blob_text_store(s, text);
		blob_release(s, &h);
	}
	unlink(path);
	assert_int_equal(blob_check(s, &h, BLOB_SINCE_GIVEN, &e), -EBADMSG);
	assert_int_equal(blob_expect(s, &h, &e), 0);
	assert_int_equal(blob_expect(s, &other, &e), 0); /* a file that was never there */
	assert_false(blob_has(s, &other, NULL));
	blob_text_store(s, "x");
	blob_release(s, &other);
	blob_text_store(s, text);
	for (int i = 0; i < 40; i++) { /* more files than there is room for: held ones stay */
		char more[64];
		snprintf(more, sizeof more, "something else of fifty bytes or so, number %d", i);
		struct blob_hash m = blob_text_store(s, more);
		blob_release(s, &m);
	}
	assert_true(blob_has(s, &h, NULL) && blob_has(s, &other, NULL));
	blob_store_close(s);
}

/* The removed folder is made again; the files that were in it are found missing when they are used. */
static void a_folder_that_is_removed(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	char inside[300], path[4096];
	uint64_t size;
	snprintf(inside, sizeof inside, "%s/inside", folder);
	assert_int_equal(blob_store_open(&s, inside, 1000, &e), 0);
	struct blob_hash h = blob_text_store(s, "lost");
	blob_path(s, &h, path, sizeof path);
	assert_int_equal(unlink(path), 0);
	assert_int_equal(rmdir(inside), 0);
	struct blob_hash other = blob_text_store(s, "stored after that");
	assert_true(blob_has(s, &other, &size) && size == 17);
	assert_int_equal(blob_check(s, &h, 1000, &e), -EBADMSG);
	blob_text_store(s, "lost");
	assert_int_equal(blob_check(s, &h, 0, &e), 0);
	blob_store_close(s);
}

/* A check in parts, and what happens to the file between these parts. */
static void checked_in_parts(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_check *c, *other;
	struct error e;
	char path[4096];
	uint64_t size;
	assert_int_equal(blob_store_open(&s, folder, 30, &e), 0);
	struct blob_hash h = blob_text_store(s, "bytes that are checked");
	blob_release(s, &h);
	blob_path(s, &h, path, sizeof path);
	/* the check ends early: nothing is known, and nothing is lost */
	assert_int_equal(blob_check_begin(&c, s, &h, 0, &e), 1);
	assert_int_equal(blob_check_end(c, &e), -ECANCELED);
	close(blob_open(s, &h, &size, &e));
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_GIVEN, &e), 1);
	assert_int_equal(blob_check_end(c, &e), -ECANCELED);
	/* the file is held, and given out again before its check has ended */
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_GIVEN, &e), 1);
	assert_true(blob_is_being_checked(s, &h));
	struct blob_hash more = blob_text_hash("other bytes, too many of them");
	struct blob_writer *w;
	assert_int_equal(blob_write_begin(&w, s, &more, 29, &e), -EFBIG);
	close(blob_open(s, &h, &size, &e));
	while (blob_check_read(c))
		continue;
	assert_int_equal(blob_check_end(c, &e), 0);
	assert_false(blob_is_being_checked(s, &h));
	assert_int_equal(blob_check_begin(&c, s, &h, BLOB_SINCE_GIVEN, &e), 1);
	/* two checks find the damage at once, and the file is written again before the second one reports it */
	assert_int_equal(truncate(path, 3), 0);
	assert_int_equal(blob_check_begin(&other, s, &h, 0, &e), 1);
	while (blob_check_read(c) || blob_check_read(other))
		continue;
	assert_int_equal(blob_check_end(c, &e), -EBADMSG);
	blob_text_store(s, "bytes that are checked");
	assert_int_equal(blob_check_end(other, &e), 0);
	assert_true(blob_has(s, &h, &size) && size == 22);
	blob_store_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(knows_sha_256),
		cmocka_unit_test_setup_teardown(keeps_and_reads_back, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(refuses_false_bytes, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(forgets_the_oldest_that_nobody_holds, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(room_is_taken_by_what_arrives, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(evicts_as_bytes_arrive, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(held_before_it_is_trimmed, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(damaged_at_rest, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_folder_that_is_removed, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(checked_in_parts, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(knows_many, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
