/* SPDX-License-Identifier: Apache-2.0 */
/* Folders of the fuzzers: below one that goes when the program ends, in memory where there is such a place. */
#ifndef TESTS_FUZZ_FOLDERS_H
#define TESTS_FUZZ_FOLDERS_H

const char *folders_base(void);
void folders_copy(const char *from, const char *to); /* files and folders */
void folders_remove(const char *path);

#endif
