/* SPDX-License-Identifier: Apache-2.0 */
/* A temporary folder for each test of a group: cmocka's set-up and tear-down. */
#ifndef TESTS_SUPPORT_TEMPORARY_FOLDER_H
#define TESTS_SUPPORT_TEMPORARY_FOLDER_H

extern char temporary_folder[64];

int temporary_folder_set_up(void **state);
int temporary_folder_tear_down(void **state);

#endif
