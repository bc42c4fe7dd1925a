/* SPDX-License-Identifier: Apache-2.0 */
/* Makes the listing of a folder fail midway, as on a disk with a bad sector or an NFS server that lost the folder.
 * One thread. */
#ifndef TESTS_SUPPORT_FAILING_LIST_H
#define TESTS_SUPPORT_FAILING_LIST_H

/* From now on, listing any folder whose path contains `part` fails with this errno after `names` names, not counting
 * "." and ".."; their order is the file system's. */
void failing_list_begin(const char *part, int names, int error);
void failing_list_end(void); /* ends the failures */

#endif
