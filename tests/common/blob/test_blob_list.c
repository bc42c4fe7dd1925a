/* SPDX-License-Identifier: Apache-2.0 */
/* A store whose folder cannot be listed to its end is not opened: files that were not listed would be unknown, and
 * never deleted. */
#include "common/blob/blob.h"
#include "tests/support/failing_list.h"
#include "tests/support/blob_text.h"
#include "tests/support/temporary_folder.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void store_that_cannot_be_listed_is_not_opened(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	struct blob_hash one = blob_text_store(s, "one"), two = blob_text_store(s, "two");
	blob_store_close(s);
	failing_list_begin(temporary_folder, 1, EIO);
	int rc = blob_store_open(&s, temporary_folder, 0, &e);
	failing_list_end();
	assert_int_equal(rc, -EIO);
	assert_non_null(strstr(e.text, temporary_folder));
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	assert_true(blob_is_stored(s, &one, NULL) && blob_is_stored(s, &two, NULL));
	blob_store_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(store_that_cannot_be_listed_is_not_opened, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
