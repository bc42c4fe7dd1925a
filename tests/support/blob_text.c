/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/blob_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <string.h>
#include <sys/stat.h>

struct blob_hash blob_text_hash(const char *text)
{
	struct blob_hash h;
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), &h, &e), 0);
	return h;
}

struct blob_hash blob_text_store(struct blob_store *s, const char *text)
{
	struct blob_hash h = blob_text_hash(text);
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_write_begin(&w, s, &h, strlen(text), &e), 0);
	assert_int_equal(blob_write_append(w, text, 1, &e), 0);
	assert_int_equal(blob_write_offset(w), 1);
	assert_int_equal(blob_write_append(w, text + 1, strlen(text) - 1, &e), 0);
	assert_int_equal(blob_write_commit(w, &e), 0);
	return h;
}

uint64_t blob_text_folder_bytes(const char *folder)
{
	uint64_t sum = 0;
	DIR *d = opendir(folder);
	assert_non_null(d);
	for (struct dirent *f; (f = readdir(d));) {
		struct stat st;
		if (fstatat(dirfd(d), f->d_name, &st, 0) == 0 && S_ISREG(st.st_mode))
			sum += (uint64_t)st.st_size;
	}
	closedir(d);
	return sum;
}
