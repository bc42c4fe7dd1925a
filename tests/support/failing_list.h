/* SPDX-License-Identifier: Apache-2.0 */
/* A folder whose list fails midway, as on a disk with a bad sector or an NFS server that lost it. One thread. */
#ifndef TESTS_SUPPORT_FAILING_LIST_H
#define TESTS_SUPPORT_FAILING_LIST_H

/* From now on, each folder whose path has `part` in it fails with this errno after so many of its names, "." and ".."
 * not counted; which ones come before is the file system's choice. */
void failing_list_begin(const char *part, int names, int error);
void failing_list_end(void); /* the disk is the system's again */

#endif
