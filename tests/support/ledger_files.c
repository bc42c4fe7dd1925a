/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/ledger_files.h"

#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <sqlite3.h>
#include <stdio.h>

const char *ledger_files_path(const char *file)
{
	static char path[200];
	snprintf(path, sizeof path, "%s/%s", temporary_folder, file);
	return path;
}

void ledger_files_execute(const char *file, const char *sql)
{
	sqlite3 *db;
	assert_int_equal(sqlite3_open(ledger_files_path(file), &db), SQLITE_OK);
	assert_int_equal(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_close(db), SQLITE_OK);
}
