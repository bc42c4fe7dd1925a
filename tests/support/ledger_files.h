/* SPDX-License-Identifier: Apache-2.0 */
/* The files of a ledger in the test's folder (tests/support/temporary_folder.h), while no ledger has them open. One
 * thread. */
#ifndef TESTS_SUPPORT_LEDGER_FILES_H
#define TESTS_SUPPORT_LEDGER_FILES_H

const char *ledger_files_path(const char *file); /* valid until the next call */
/* Changes a file as somebody other than the ledger might; fails the test if SQLite refuses. */
void ledger_files_execute(const char *file, const char *sql);

#endif
