/* SPDX-License-Identifier: Apache-2.0 */
/* Short texts as files of a blob store. A failure fails the test. */
#ifndef TESTS_SUPPORT_BLOB_TEXT_H
#define TESTS_SUPPORT_BLOB_TEXT_H

#include "common/blob/blob.h"

struct blob_hash blob_text_hash(const char *text);
struct blob_hash blob_text_store(struct blob_store *s, const char *text); /* stores the text in two pieces */
uint64_t blob_text_folder_bytes(const char *folder); /* total size of all files directly in the folder */

#endif
