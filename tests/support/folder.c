/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char folder[64];

int folder_set_up(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/hslt-test.XXXXXX");
	return mkdtemp(folder) ? 0 : -1;
}

int folder_tear_down(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return system(command);
}
