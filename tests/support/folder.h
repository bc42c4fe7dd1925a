/* SPDX-License-Identifier: Apache-2.0 */
/* A temporary folder for each test of a group: cmocka's set-up and tear-down. */
#ifndef TESTS_SUPPORT_FOLDER_H
#define TESTS_SUPPORT_FOLDER_H

extern char folder[64];

int folder_set_up(void **state);
int folder_tear_down(void **state);

#endif
