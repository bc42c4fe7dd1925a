/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/asset.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char root[] = "/tmp/hslt-asset-XXXXXX";
static char folder[128];

static void write_file(const char *name, const char *text)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", root, name);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fputs(text, f);
	fclose(f);
}

static void link_to(const char *target, const char *name)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	assert_int_equal(symlink(target, path), 0);
}

static int set_up(void **state)
{
	(void)state;
	char path[256];
	if (!mkdtemp(root))
		return -1;
	snprintf(folder, sizeof folder, "%s/scene", root);
	mkdir(folder, 0755);
	snprintf(path, sizeof path, "%s/sub", folder);
	mkdir(path, 0755);
	snprintf(path, sizeof path, "%s/fifo", folder);
	mkfifo(path, 0600);
	write_file("secret", "secret");
	write_file("scene/a.obj", "inside");
	write_file("scene/sub/b.png", "deeper");
	write_file("scene/empty", "");
	write_file("scene/..dots", "dots");
	link_to("../secret", "out");
	link_to("..", "up");
	snprintf(path, sizeof path, "%s/secret", root);
	link_to(path, "absolute");
	link_to("circle", "circle");
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	char command[256];
	snprintf(command, sizeof command, "rm -rf '%s'", root);
	return system(command);
}

static void reads(const char *name, const char *text)
{
	struct asset_source s = asset_folder(folder);
	struct asset a;
	struct error e;
	if (s.open(s.user, name, &a, &e))
		fail_msg("%s", e.text);
	assert_int_equal(a.size, strlen(text));
	assert_memory_equal(a.bytes, text, strlen(text) + (a.size == 0));
	s.close(s.user, &a);
	assert_null(a.bytes);
}

static void refuses(const char *name, const char *text)
{
	struct asset_source s = asset_folder(folder);
	struct asset a;
	struct error e = {""};
	int r = s.open(s.user, name, &a, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%s gave %d: %s\n not: %s", name, r, e.text, text);
	assert_null(a.bytes);
}

static void test_files_below(void **state)
{
	(void)state;
	reads("a.obj", "inside");
	reads("./a.obj", "inside");
	reads("sub/b.png", "deeper");
	reads("sub//b.png", "deeper");
	reads("empty", "");
	reads("..dots", "dots");
}

static void test_files_elsewhere(void **state)
{
	(void)state;
	refuses("none", "No such file");
	refuses("", "must lie below");
	refuses("../secret", "must lie below");
	refuses("sub/../../secret", "must lie below");
	refuses("sub/..", "must lie below");
	refuses("..", "must lie below");
	refuses("/etc/passwd", "must lie below");
	refuses("out", "out: ");
	refuses("up/secret", "up/secret: ");
	refuses("absolute", "absolute: ");
	refuses("circle", "circle: ");
	refuses("sub", "not a regular file");
	refuses("fifo", "not a regular file");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_files_below), cmocka_unit_test(test_files_elsewhere)};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
