/* SPDX-License-Identifier: Apache-2.0 */
/* The files of a ledger in the test's folder (tests/support/folder.h), while no ledger has them open. One thread. */
#ifndef TESTS_SUPPORT_LEDGER_FILES_H
#define TESTS_SUPPORT_LEDGER_FILES_H

const char *ledger_files_path(const char *file); /* valid until the next call */
/* As somebody else than the ledger would change it; fails the test where SQLite refuses. */
void ledger_files_change(const char *file, const char *sql);

#endif
