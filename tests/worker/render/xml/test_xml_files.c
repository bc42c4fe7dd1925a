/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where a scene's files are searched for: the folders of <path>, in Mitsuba's order, folders that may not be read,
 * and paths from another machine. The content of each file is its own name, so a test sees which file was read.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* The names that exist, and names outside the folders that may be read. */
struct disk {
	const char *scene, *existing[4], *outside_existing[4];
};

static bool is_listed(const char *const *list, const char *name)
{
	for (int i = 0; i < 4 && list[i]; i++)
		if (strcmp(list[i], name) == 0)
			return true;
	return false;
}

static int disk_open(void *user, const char *name, struct asset *out, struct error *e)
{
	const struct disk *d = user;
	bool scene = strcmp(name, "s.xml") == 0;
	if (is_listed(d->outside_existing, name))
		return error_set(e, EINVAL, "%s: leads out", name);
	if (!scene && !is_listed(d->existing, name))
		return error_set(e, ENOENT, "%s: not there", name);
	const char *bytes = scene ? d->scene : name;
	*out = (struct asset){.bytes = (const unsigned char *)bytes, .size = strlen(bytes)};
	return 0;
}

static void disk_close(void *user, struct asset *a)
{
	(void)user, (void)a;
}

/* Expects the name under which the mesh `written` is read, and the number of notes. */
static void expect_name(struct disk d, const char *paths, const char *written, const char *name, uint32_t notes)
{
	char text[512];
	snprintf(text, sizeof text,
		 "<scene version='3.0.0'>%s<shape type='ply'><string name='filename' value='%s'/></shape></scene>",
		 paths, written);
	d.scene = text;
	struct asset_source assets = {.user = &d, .open = disk_open, .close = disk_close};
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s: %s", written, e.text);
	assert_string_equal(node_string(s.objects[0], "filename", ""), name);
	assert_int_equal(s.note_count, notes);
	assert_int_equal(notes, scene_has_note(&s, "looked for by their ends in the scene's folder"));
	scene_fini(&s);
}

#define PATHS "<path value='a'/><path value='../b'/>"

/* Mitsuba 3 puts each folder before those that it already searches, the scene's own among them. */
static void test_later_paths_are_searched_first(void **state)
{
	(void)state;
	expect_name((struct disk){.existing = {"m.ply"}}, PATHS, "m.ply", "m.ply", 0);
	expect_name((struct disk){.existing = {"m.ply", "a/m.ply"}}, PATHS, "m.ply", "a/m.ply", 0);
	expect_name((struct disk){.existing = {"m.ply", "a/m.ply", "%2e%2e/b/m.ply"}}, PATHS, "m.ply", "%2e%2e/b/m.ply",
		    0);
	expect_name((struct disk){.existing = {"m.ply"}}, PATHS, "none.ply", "none.ply", 0);
}

/* A file that may not be read is named if no other folder has the file, so that opening it can report how to allow
 * it. */
static void test_outside_file_is_named_only_if_no_folder_has_it(void **state)
{
	(void)state;
	static const char outside[] = "%2e%2e/b/m.ply";
	expect_name((struct disk){.outside_existing = {outside}}, PATHS, "m.ply", outside, 0);
	expect_name((struct disk){.existing = {"m.ply"}, .outside_existing = {outside}}, PATHS, "m.ply", "m.ply", 0);
	expect_name((struct disk){.existing = {"a/m.ply"}, .outside_existing = {outside}}, PATHS, "m.ply", "a/m.ply",
		    0);
}

/* A path that does not exist is replaced by its longest suffix that does; an existing path is kept, even if it may
 * not be read. */
static void test_missing_paths_are_replaced_by_their_existing_suffix(void **state)
{
	(void)state;
	expect_name((struct disk){.existing = {"x/m.ply", "m.ply"}}, "", "/home/me/x/m.ply", "x/m.ply", 1);
	expect_name((struct disk){.existing = {"m.ply"}}, "", "/home/me/x/m.ply", "m.ply", 1);
	expect_name((struct disk){.existing = {"m.ply"}}, "", "C:\\me\\x\\m.ply", "m.ply", 1);
	expect_name((struct disk){.existing = {"%2f/x/m.ply", "m.ply"}}, "", "/x/m.ply", "%2f/x/m.ply", 0);
	expect_name((struct disk){.existing = {"m.ply"}, .outside_existing = {"%2f/x/m.ply"}}, "", "/x/m.ply",
		    "%2f/x/m.ply", 0);
	expect_name((struct disk){.existing = {"m.ply"}}, "", "/x/none.ply", "%2f/x/none.ply", 0);
	expect_name((struct disk){.existing = {"m.ply"}}, "", "x/m.ply", "x/m.ply", 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_later_paths_are_searched_first),
		cmocka_unit_test(test_outside_file_is_named_only_if_no_folder_has_it),
		cmocka_unit_test(test_missing_paths_are_replaced_by_their_existing_suffix),
	};
	return cmocka_run_group_tests_name("xml_files", tests, NULL, NULL);
}
