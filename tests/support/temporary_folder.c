/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/temporary_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char temporary_folder[64];

int temporary_folder_set_up(void **state)
{
	(void)state;
	strcpy(temporary_folder, "/tmp/hslt-test.XXXXXX");
	return mkdtemp(temporary_folder) ? 0 : -1;
}

int temporary_folder_tear_down(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", temporary_folder);
	return system(command);
}
