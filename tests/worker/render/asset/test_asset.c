/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which files a scene may open: those below its folder and below the search folders, by any name that leads there;
 * but not by `..`, absolute names, links out of the folder, folders, FIFOs or devices. The canonical name of a file
 * is the same by every route.
 */
#include "worker/render/asset/asset_keeper.h"
#include "worker/render/asset/asset_name.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char root_folder[] = "/tmp/hslt-asset-XXXXXX";
static char scene_folder[128];

static void write_file(const char *name, const char *text)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", root_folder, name);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fputs(text, f);
	fclose(f);
}

static void make_link(const char *target, const char *name)
{
	char path[256];
	snprintf(path, sizeof path, "%s/%s", scene_folder, name);
	assert_int_equal(symlink(target, path), 0);
}

static int set_up(void **state)
{
	(void)state;
	char path[256];
	if (!mkdtemp(root_folder))
		return -1;
	snprintf(scene_folder, sizeof scene_folder, "%s/scene", root_folder);
	mkdir(scene_folder, 0755);
	snprintf(path, sizeof path, "%s/sub", scene_folder);
	mkdir(path, 0755);
	snprintf(path, sizeof path, "%s/fifo", scene_folder);
	mkfifo(path, 0600);
	write_file("secret", "secret");
	write_file("scene/a.obj", "inside");
	write_file("scene/sub/b.png", "deeper");
	write_file("scene/empty", "");
	write_file("scene/..dots", "dots");
	make_link("../secret", "out");
	make_link("..", "up");
	snprintf(path, sizeof path, "%s/secret", root_folder);
	make_link(path, "absolute");
	make_link("circle", "circle");
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	char command[256];
	snprintf(command, sizeof command, "rm -rf '%s'", root_folder);
	return system(command);
}

static void expect_content(const char *name, const char *text)
{
	struct asset_source s = asset_source_for_folder(scene_folder);
	struct asset a;
	struct error e;
	if (s.open(s.user, name, &a, &e))
		fail_msg("%s", e.text);
	assert_int_equal(a.size, strlen(text));
	assert_memory_equal(a.bytes, text, strlen(text) + (a.size == 0));
	s.close(s.user, &a);
	assert_null(a.bytes);
}

static void expect_refused(const char *name, const char *text)
{
	struct asset_source s = asset_source_for_folder(scene_folder);
	struct asset a;
	struct error e = {""};
	int r = s.open(s.user, name, &a, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%s gave %d: %s\n not: %s", name, r, e.text, text);
	assert_null(a.bytes);
}

static void test_files_below_the_folder_are_opened(void **state)
{
	(void)state;
	expect_content("a.obj", "inside");
	expect_content("./a.obj", "inside");
	expect_content("sub/b.png", "deeper");
	expect_content("sub//b.png", "deeper");
	expect_content("empty", "");
	expect_content("..dots", "dots");
}

static void test_files_outside_the_folder_are_refused(void **state)
{
	(void)state;
	expect_refused("none", "No such file");
	expect_refused("", "must lie below");
	expect_refused("../secret", "must lie below");
	expect_refused("sub/../../secret", "must lie below");
	expect_refused("sub/..", "must lie below");
	expect_refused("..", "must lie below");
	expect_refused("/etc/passwd", "must lie below"); /* not a canonical name */
	expect_refused("%2f/etc/passwd",
		       "/etc/passwd: leads out of the scene's folder; to allow that, give --path /etc");
	expect_refused("%2f/etc/../passwd", "%2f/etc/../passwd: files must lie below");
	expect_refused("out", "out: ");
	expect_refused("up/secret", "up/secret: ");
	expect_refused("absolute", "absolute: ");
	expect_refused("circle", "circle: ");
	expect_refused("sub", "not a regular file");
	expect_refused("fifo", "not a regular file");
}

static void test_names_become_canonical(void **state)
{
	(void)state;
	static const struct {
		const char *written, *canonical;
	} cases[] = {
		{"a.obj", "a.obj"},
		{"./a.obj", "a.obj"},
		{"a/./b//c", "a/b/c"},
		{"a/../b", "b"},
		{"a/b/../../c/d", "c/d"},
		{"a/../../b", "%2e%2e/b"},
		{"../../b", "%2e%2e/%2e%2e/b"},
		{"../a/../b", "%2e%2e/b"},
		{"..dots/...", "..dots/..."},
		{"a/.hidden", "a/.hidden"},
		{"/etc/../passwd", "%2f/passwd"},
		{"/../a//b", "%2f/a/b"},
		{"//a", "%2f/a"},
		{"/a/..", "/a/.."},
		{"/", "/"},
		{"a/..", "a/.."},
		{"", ""},
		{".", "."},
		{"a/%2e%2e/b", "b"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char out[ASSET_NAME_SIZE_MAX(64)], again[ASSET_NAME_SIZE_MAX(64)];
		asset_name_canonicalize(cases[i].written, out);
		assert_string_equal(out, cases[i].canonical);
		asset_name_canonicalize(out, again);
		assert_string_equal(again, out);
	}
	const char *rest;
	assert_int_equal(asset_name_levels_up("%2e%2e/%2e%2e/b/%2e%2e", &rest), 2);
	assert_string_equal(rest, "b/%2e%2e");
	assert_int_equal(asset_name_levels_up("%2e%2e", &rest), 0);
	assert_int_equal(asset_name_levels_up("%2f/b", &rest), ASSET_NAME_ABSOLUTE);
	assert_string_equal(rest, "b");
	assert_int_equal(asset_name_levels_up("%2f", &rest), 0);
	char shown[16], little[8];
	assert_string_equal(asset_name_display("%2f/a/b", shown, sizeof shown), "/a/b");
	assert_string_equal(asset_name_display("%2f/a/b/c.png", little, sizeof little), "/a/b/c.");
	assert_string_equal(asset_name_display("a/b", shown, sizeof shown), "a/b");
	assert_string_equal(asset_name_display("%2e%2e/%2e%2e/b", shown, sizeof shown), "../../b");
	assert_string_equal(asset_name_display("%2e%2e/%2e%2e/b.png", little, sizeof little), "../../b");
	assert_string_equal(asset_name_display("%2e%2e/%2e%2e/%2e%2e/b", little, sizeof little), "../../.");
}

/* A source that counts calls; its two files have handles that distinguish them. */
struct call_counts {
	int open_count, close_count;
};

static int count_open(void *user, const char *name, struct asset *out, struct error *e)
{
	static unsigned char bytes[2] = {'a', 'b'};
	if (strcmp(name, "a") != 0 && strcmp(name, "b") != 0)
		return error_set(e, ENOENT, "%s: no such file", name);
	((struct call_counts *)user)->open_count++;
	unsigned char *at = &bytes[*name - 'a'];
	*out = (struct asset){.bytes = at, .size = 1, .handle = at};
	return 0;
}

static void count_close(void *user, struct asset *a)
{
	assert_non_null(a->bytes);
	((struct call_counts *)user)->close_count++;
	*a = (struct asset){0};
}

static void open_and_close(const struct asset_source *s, const char *name)
{
	struct asset a;
	struct error e;
	assert_int_equal(s->open(s->user, name, &a, &e), 0);
	assert_int_equal(*a.bytes, *name);
	s->close(s->user, &a);
}

/* The scene's own folder is searched first, then the others in turn; each is as restricted as the first. */
static void test_folders_are_searched_in_order(void **state)
{
	(void)state;
	char others[2][256];
	const char *const list[] = {others[0], others[1]};
	snprintf(others[0], sizeof others[0], "%s/none", root_folder);
	snprintf(others[1], sizeof others[1], "%s/more", root_folder);
	assert_int_equal(mkdir(others[1], 0700), 0);
	write_file("scene/both", "own");
	write_file("more/both", "other");
	write_file("more/theirs", "other");
	write_file("outside", "none of theirs");
	char path[300];
	snprintf(path, sizeof path, "%s/out", others[1]);
	assert_int_equal(symlink("../outside", path), 0);
	struct asset_folders folders = asset_folders_make(scene_folder, list, 2);
	struct asset_source s = asset_source_for_folders(&folders);
	static const struct {
		const char *name, *bytes;
		int rc;
	} cases[] = {{"both", "own", 0},
		     {"theirs", "other", 0},
		     {"nowhere", NULL, -ENOENT},
		     {"out", NULL, -EXDEV},
		     {"../more/theirs", NULL, -EINVAL}, /* not a canonical name */
		     {"%2e%2e/more/theirs", "other", 0},
		     {"%2e%2e/more/both", "other", 0},
		     {"%2e%2e/scene/both", "own", 0},
		     {"%2e%2e/scene/sub/b.png", "deeper", 0},
		     {"%2e%2e/more/none", NULL, -ENOENT},
		     {"%2e%2e/more/out", NULL, -EXDEV},
		     {"%2e%2e/outside", NULL, -EINVAL},
		     {"%2e%2e/secret", NULL, -EINVAL},
		     {"%2e%2e/more2/theirs", NULL, -EINVAL},
		     {"%2e%2e/scene/fifo", NULL, -EINVAL},
		     {"%2e%2e/scene/up/secret", NULL, -EXDEV},
		     {"%2e%2e/more/../outside", NULL, -EINVAL},
		     {"%2e%2e//etc/passwd", NULL, -ENOENT},
		     {"both/x", NULL, -ENOTDIR}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct asset a;
		struct error e;
		int rc = s.open(s.user, cases[i].name, &a, &e);
		if ((rc == -ELOOP || rc == -ENOTDIR) && cases[i].rc == -EXDEV) /* a kernel without openat2 */
			rc = -EXDEV;
		assert_int_equal(rc, cases[i].rc);
		if (!rc) {
			assert_int_equal(a.size, strlen(cases[i].bytes));
			assert_memory_equal(a.bytes, cases[i].bytes, a.size);
			s.close(s.user, &a);
		}
	}
	assert_int_equal(asset_folders_make(scene_folder, (const char *[40]){0}, 40).count, ASSET_FOLDERS_MAX);
}

/* For a file outside the folder, the error names the folder to pass, and the file as the user wrote it. */
static void test_refusal_names_the_outside_folder(void **state)
{
	(void)state;
	char real[300], wanted[400], deep[64 * 7 + 8] = "";
	char *base = realpath(root_folder, NULL);
	assert_non_null(base);
	snprintf(real, sizeof real, "%s", base);
	free(base);
	snprintf(wanted, sizeof wanted,
		 "../common/a.png: leads out of the scene's folder; to allow that, give --path %s", real);
	expect_refused("%2e%2e/common/a.png", wanted);
	expect_content("%2e%2e/scene/a.obj", "inside");
	expect_refused("%2e%2e/scene/none.obj", "../scene/none.obj: No such file");
	/* a file that is nowhere, for a caller that can add search folders */
	struct asset_folders f = asset_folders_make(scene_folder, NULL, 0);
	struct asset_source own = asset_source_for_folders(&f), more;
	struct asset a;
	struct error e;
	assert_int_equal(own.open(own.user, "none.obj", &a, &e), -ENOENT);
	assert_string_equal(e.text, "none.obj: no such file in the scene's folder; --path FOLDER searches there, too");
	const char *const others[] = {root_folder};
	f = asset_folders_make(scene_folder, others, 1);
	more = asset_source_for_folders(&f);
	assert_int_equal(more.open(more.user, "none.obj", &a, &e), -ENOENT);
	assert_string_equal(e.text, "none.obj: no such file in the scene's folder or those of --path");
	/* a file in a folder around the scene's, or below the current one */
	f = asset_folders_make(scene_folder, NULL, 0);
	assert_int_equal(own.open(own.user, "more/theirs", &a, &e), -ENOENT);
	snprintf(wanted, sizeof wanted, "more/theirs: no such file in the scene's folder; --path %s finds it", real);
	assert_string_equal(e.text, wanted);
	char *before = getcwd(NULL, 0);
	assert_true(before && chdir(root_folder) == 0);
	assert_int_equal(own.open(own.user, "more/theirs", &a, &e), -ENOENT);
	assert_int_equal(chdir(before), 0);
	free(before);
	assert_string_equal(e.text, "more/theirs: no such file in the scene's folder; --path . finds it");
	for (int i = 0; i < 64; i++)
		strcat(deep, "%2e%2e/");
	strcat(deep, "a");
	expect_refused(deep, "give --path /");
}

static void expect_not_found(const char *name, const char *text)
{
	const char *const others[] = {root_folder};
	struct asset_folders f = asset_folders_make(scene_folder, others, 1);
	struct asset_source own = asset_source_for_folders(&f);
	struct asset a;
	struct error e;
	char wanted[400];
	snprintf(wanted, sizeof wanted, "%s: no such file in the scene's folder or those of --path%s", name, text);
	assert_int_equal(own.open(own.user, name, &a, &e), -ENOENT);
	assert_string_equal(e.text, wanted);
}

/* A file of a similar name, in folders of a similar name. */
static void test_similar_names_are_suggested(void **state)
{
	(void)state;
	write_file("scene/mesh_1.obj", "");
	write_file("scene/sub/Wood Floor.png", "");
	write_file("scene/empty2", "");
	expect_not_found("A.OBJ", "; did you mean `a.obj`?");
	expect_not_found("Sub/wood floor.PNG", "; did you mean `sub/Wood Floor.png`?");
	expect_not_found("sub/wood_floor.png", "; did you mean `sub/Wood Floor.png`?");
	expect_not_found("Mesh_1.obj", "; did you mean `mesh_1.obj`?");
	expect_not_found("common/./B.png", "");
	expect_not_found("mesh_2.obj", ""); /* another file of a series */
	expect_not_found("mesh_11.obj", "");
	expect_not_found("fifoo", ""); /* not a regular file */
	expect_not_found("subs", "");
	expect_not_found("outt", ""); /* leads out of the folder */
	expect_not_found("absolut", "");
	expect_not_found("scene/EMPTY", "; did you mean `scene/empty`?"); /* in the second folder */
}

/* By its absolute name, a file is found below the scene's folder and the search folders, whether these are named
 * directly or by a link, and nowhere else. */
static void test_absolute_names_are_found_in_allowed_folders(void **state)
{
	(void)state;
	char link[64], name[400];
	snprintf(link, sizeof link, "%s-link", root_folder);
	assert_int_equal(symlink(root_folder, link), 0);
	snprintf(name, sizeof name, "%%2f%s/scene/sub/b.png", root_folder);
	expect_content(name, "deeper");
	snprintf(name, sizeof name, "%%2f%s/scene/up/secret", root_folder);
	expect_refused(name, "up/secret: ");
	snprintf(name, sizeof name, "%%2f%s/scene/none", root_folder);
	expect_refused(name, "/scene/none: No such file");
	snprintf(name, sizeof name, "%%2f%s/scene2/none", root_folder);
	expect_refused(name, "/scene2/none: no such file on this machine");
	snprintf(name, sizeof name, "%%2f%s/secret", root_folder);
	expect_refused(name, "/secret: leads out of the scene's folder; to allow that, give --path /");
	const struct asset_folders linked = asset_folders_make(scene_folder, (const char *const[]){link}, 1);
	struct asset_source s = asset_source_for_folders(&linked);
	struct asset a;
	struct error e;
	snprintf(name, sizeof name, "%%2f%s/secret", link);
	assert_int_equal(s.open(s.user, name, &a, &e), 0);
	s.close(s.user, &a);
	snprintf(name, sizeof name, "%%2f%s/secret", root_folder);
	assert_int_equal(s.open(s.user, name, &a, &e), 0);
	s.close(s.user, &a);
	assert_int_equal(unlink(link), 0);
}

/* A file that is opened repeatedly is opened once underneath, and in the end every opened file is closed. */
static void test_keeper_opens_each_file_once(void **state)
{
	(void)state;
	struct call_counts c = {0, 0};
	const struct asset_source inner = {.user = &c, .open = count_open, .close = count_close};
	struct asset_keeper keeper = {.inner_source = &inner};
	struct asset_source s = asset_keeper_source(&keeper);
	struct asset first, second, other;
	struct error e;
	for (int i = 0; i < 5; i++)
		open_and_close(&s, "a");
	assert_true(c.open_count == 1 && c.close_count == 0);
	open_and_close(&s, "b");
	assert_true(c.open_count == 2 && c.close_count == 1);
	assert_int_equal(s.open(s.user, "c", &first, &e), -ENOENT);
	open_and_close(&s, "a");
	assert_true(c.open_count == 3 && c.close_count == 2);
	/* used twice at once, with another file beside it */
	assert_int_equal(s.open(s.user, "a", &first, &e), 0);
	assert_int_equal(s.open(s.user, "b", &other, &e), 0);
	assert_int_equal(s.open(s.user, "a", &second, &e), 0);
	assert_true(first.bytes == second.bytes && c.open_count == 4);
	s.close(s.user, &other);
	s.close(s.user, &first);
	assert_true(c.close_count == 3 && *second.bytes == 'a');
	s.close(s.user, &second);
	asset_keeper_fini(&keeper);
	assert_true(c.open_count == 4 && c.close_count == 4);
}

/* The keeper reads a file again only a limited number of times. */
static void test_keeper_rereads_a_limited_number_of_times(void **state)
{
	(void)state;
	struct call_counts c = {0, 0};
	const struct asset_source inner = {.user = &c, .open = count_open, .close = count_close};
	struct asset_keeper keeper = {.inner_source = &inner, .bytes_read = ASSET_KEEPER_BYTES_MAX};
	struct asset_source s = asset_keeper_source(&keeper);
	struct asset other;
	struct error e;
	open_and_close(&s, "a");
	open_and_close(&s, "a");
	assert_int_equal(s.open(s.user, "b", &other, &e), -E2BIG);
	assert_non_null(strstr(e.text, "b: the scene asks for its files again and again; 256 GB"));
	asset_keeper_fini(&keeper);
	assert_true(c.open_count == 1 && c.close_count == 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_files_below_the_folder_are_opened),
					   cmocka_unit_test(test_files_outside_the_folder_are_refused),
					   cmocka_unit_test(test_names_become_canonical),
					   cmocka_unit_test(test_folders_are_searched_in_order),
					   cmocka_unit_test(test_refusal_names_the_outside_folder),
					   cmocka_unit_test(test_similar_names_are_suggested),
					   cmocka_unit_test(test_absolute_names_are_found_in_allowed_folders),
					   cmocka_unit_test(test_keeper_opens_each_file_once),
					   cmocka_unit_test(test_keeper_rereads_a_limited_number_of_times)};
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
