/* SPDX-License-Identifier: Apache-2.0 */
/* Folders of the fuzzers, below one folder that is removed when the program ends; in memory if there is such a file
 * system. */
#ifndef TESTS_FUZZ_FOLDERS_H
#define TESTS_FUZZ_FOLDERS_H

const char *folders_base(void);
void folders_copy(const char *from, const char *to); /* files and folders, recursively */
void folders_remove(const char *path);

#endif
