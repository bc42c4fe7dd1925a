/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `check` reads the scene in a way that does not stop at the first problem (scene_read_all). Then it checks meshes,
 * images and combinations of values as a worker would; problems that may only follow from one that the reader has found
 * are not reported. `show` collects everything as JSON, from which the text is made.
 *
 * Failures: if the scene cannot be rendered, `check` prints one line per problem, and the exit code is 1. If the file
 * cannot be found or read at all, that is the only line. `show` stops at the first problem and returns its sentence,
 * as it does if memory runs out or stdout cannot be written.
 */
#include "worker/cli/scene/scene_report.h"

#include "common/base/mem.h"
#include "common/blob/blob.h"
#include "worker/cli/base/source_place.h"
#include "worker/render/gltf/gltf.h"
#include "worker/render/scene/lenient.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* An open scene file: its folder, its name there, and the folder's files. */
struct opened_scene {
	char *folder, *name;
	struct asset_folders folders;
	struct asset_source assets;
};

static int open_scene(const struct render_arguments *a, struct opened_scene *o, struct error *e)
{
	int rc = scene_path_split(a->scene, a, &o->folder, &o->name, e);
	if (rc)
		return rc;
	o->folders = option_folders(a, o->folder);
	o->assets = asset_source_for_folders(&o->folders);
	return 0;
}

static void close_scene(struct opened_scene *o)
{
	mem_free(o->folder);
	mem_free(o->name);
}

static const char *plural(uint64_t n)
{
	return n == 1 ? "" : "s";
}

/* A line "file:12: ...". Problems are printed by file, in the order in which files first occur, and within a file by
 * line. */
struct problem {
	char *text;
	size_t file;  /* index of the first problem of the same file */
	size_t index; /* of this problem */
	unsigned long line;
};

struct problem_list {
	size_t count;
	struct problem *problems;
};

/* Returns the length of the file's name, and the line: 4 and 12 for "file:12". */
static size_t parse_place(const char *text, unsigned long *line)
{
	const char *colon = strchr(text, ':');
	*line = colon ? strtoul(colon + 1, NULL, 10) : 0;
	return colon ? (size_t)(colon - text) : 0;
}

static void add_problem(struct problem_list *p, const char *text)
{
	unsigned long line, other;
	size_t n = parse_place(text, &line), file = 0;
	struct problem *more = mem_grow(p->problems, p->count * sizeof *more, (p->count + 1) * sizeof *more);
	char *copy = mem_strdup(text);
	p->problems = more ? more : p->problems;
	if (!more || !copy) {
		mem_free(copy);
		printf("%s\n", text);
		return;
	}
	while (file < p->count &&
	       (parse_place(p->problems[file].text, &other) != n || memcmp(p->problems[file].text, text, n) != 0))
		file++;
	file = file < p->count ? p->problems[file].file : p->count;
	p->problems[p->count] = (struct problem){copy, file, p->count, line};
	p->count++;
}

static int compare_places(const void *x, const void *y)
{
	const struct problem *a = x, *b = y;
	if (a->file != b->file)
		return a->file < b->file ? -1 : 1;
	if (a->line != b->line)
		return a->line < b->line ? -1 : 1;
	return a->index < b->index ? -1 : 1;
}

static void print_problems(struct problem_list *p, const char *scene)
{
	if (p->count)
		qsort(p->problems, p->count, sizeof *p->problems, compare_places);
	for (size_t i = 0; i < p->count; i++) {
		source_place_print(stdout, "", scene, p->problems[i].text);
		mem_free(p->problems[i].text);
	}
	mem_free(p->problems);
}

/* Adds a problem for each file that cannot be opened, and returns their number. The contents of the others are checked
 * later, by find_build_problems. */
static uint32_t find_missing_files(const struct scene *s, const struct asset_source *assets, struct problem_list *list)
{
	uint32_t missing = 0;
	char text[2048];
	for (uint32_t i = 0; i < s->asset_count; i++) {
		struct asset a;
		struct error e;
		const char *place = s->asset_places[i];
		int rc = assets->open(assets->user, s->assets[i], &a, &e);
		if (rc) {
			bool texture = rc == -ENOENT && strstr(place, ": <texture ");
			snprintf(text, sizeof text, "%s%s%s%s", place, *place ? ": " : "", e.text,
				 texture ? lenient_texture_hint(e.text) : "");
			add_problem(list, text);
			missing++;
		} else {
			assets->close(assets->user, &a);
		}
	}
	return missing;
}

/* Returns whether a problem is at this line of this file. */
static bool is_at_place(const char *text, const char *file, size_t n, unsigned long line)
{
	unsigned long problem_line;
	return parse_place(text, &problem_line) == n && memcmp(text, file, n) == 0 && problem_line == line;
}

/* Returns whether a problem found by building may only follow from one of the first `read_count` problems, found by
 * reading: it has no line, or the line of such a problem, or of an object that lacks something. */
static bool may_follow_from_problem(const struct scene *s, const struct problem_list *list, size_t read_count,
				    const char *text)
{
	unsigned long line;
	size_t n = parse_place(text, &line);
	if (line == 0)
		return true;
	for (size_t i = 0; i < read_count; i++)
		if (is_at_place(list->problems[i].text, text, n, line))
			return true;
	for (uint32_t i = 0; i < s->flawed_count; i++)
		if (strlen(s->flawed[i]->file) == n && memcmp(s->flawed[i]->file, text, n) == 0 &&
		    (unsigned long)s->flawed[i]->line == line)
			return true;
	return false;
}

/* Adds the problems that the reader cannot see: in meshes, pictures, and values that do not fit together. Returns their
 * number. */
static uint32_t find_build_problems(const struct scene *s, const struct asset_source *assets, struct problem_list *list,
				    struct render_summary *m)
{
	const struct render_options default_options = {0};
	const size_t before = list->count;
	struct arena arena = {0};
	struct report found = {.problem_count = 0};
	struct error e;
	uint32_t problems = 0;
	int rc = report_init(&found, &arena, &e);
	if (!rc)
		rc = world_check_all(s, assets, &default_options, &found, m, &e);
	for (uint32_t i = 0; i < found.problem_count; i++)
		if (!before || !may_follow_from_problem(s, list, before, found.problems[i])) {
			add_problem(list, found.problems[i]);
			problems++;
		}
	if (rc && (!before || !may_follow_from_problem(s, list, before, e.text))) {
		add_problem(list, e.text);
		problems++;
	}
	arena_fini(&arena);
	return problems;
}

/* Prints ", N segments of curves", or nothing if there are none. */
static const char *segments_text(uint64_t n, char *text, size_t size)
{
	text[0] = '\0';
	if (n)
		snprintf(text, size, ", %llu segment%s of curves", (unsigned long long)n, plural(n));
	return text;
}

/* Prints problems, notes and the summary. Meshes and images are checked if the reader has found no problem, or if
 * enough of the scene could be read. */
static int print_check(const struct scene *s, const struct asset_source *assets, const char *scene, bool *bad)
{
	static struct render_summary m; /* too large for the stack */
	uint32_t problems = s->problem_count, notes = s->note_count;
	struct problem_list list = {0};
	for (uint32_t i = 0; i < s->problem_count; i++)
		add_problem(&list, s->problems[i]);
	problems += find_missing_files(s, assets, &list);
	if (!problems || (s->object_count > 0 && problems < REPORT_PROBLEMS_MAX))
		problems += find_build_problems(s, assets, &list, &m);
	print_problems(&list, scene);
	for (uint32_t i = 0; i < s->note_count; i++)
		source_place_print(stdout, "note: ", scene, s->notes[i]);
	char text[512];
	for (size_t i = 0; !problems && render_scene_note(&m, i, text, sizeof text); i++, notes++)
		source_place_print(stdout, "note: ", scene, text);
	uint64_t pixels = (uint64_t)scene_settings_width(&m.settings) * scene_settings_height(&m.settings);
	if (!problems && pixels > PLAN_PIXELS_MAX) {
		printf("note: the image has %llu pixels; a render has at most %d: --crop or --size is needed\n",
		       (unsigned long long)pixels, PLAN_PIXELS_MAX);
		notes++;
	}
	*bad = problems > 0;
	if (*bad)
		printf("%s: %u problem%s, %u note%s\n", scene, problems, plural(problems), notes, plural(notes));
	else
		printf("%s: can be rendered: %llu shape%s, %llu triangle%s%s, %u file%s, %u note%s\n", scene,
		       (unsigned long long)m.shapes, plural(m.shapes), (unsigned long long)m.triangles,
		       plural(m.triangles), segments_text(m.segments, text, sizeof text), s->asset_count + 1,
		       plural(s->asset_count + 1), notes, plural(notes));
	return 0;
}

int scene_report_check(const struct render_arguments *a, bool lenient, bool *bad, struct error *e)
{
	struct opened_scene o;
	struct scene s;
	int rc = open_scene(a, &o, e);
	if (rc)
		return rc;
	rc = scene_read_all(&s, &o.assets, o.name, render_plugins(), a->defines, a->define_count, lenient, e);
	if (!rc) {
		rc = print_check(&s, &o.assets, a->scene, bad);
		scene_fini(&s);
	}
	close_scene(&o);
	return rc;
}

/* Returns {"name", "bytes", "sha256"} of one file; NULL, with the error set, after a failure. */
static json_t *file_to_json(const struct asset_source *assets, const char *name, struct error *e)
{
	struct asset a;
	struct blob_hash h;
	char hex[BLOB_HEX_SIZE];
	if (assets->open(assets->user, name, &a, e))
		return NULL;
	int rc = blob_hash_bytes(a.bytes, a.size, &h, e);
	json_t *o = NULL;
	if (!rc) {
		blob_hash_to_hex(&h, hex);
		o = json_pack("{s:s s:I s:s}", "name", name, "bytes", (json_int_t)a.size, "sha256", hex);
		if (!o)
			error_set(e, ENOMEM, "no memory for the list of files");
	}
	assets->close(assets->user, &a);
	return o;
}

static json_t *files_to_json(const struct scene *s, const struct opened_scene *o, struct error *e)
{
	json_t *files = json_array();
	for (uint32_t i = 0; files && i <= s->asset_count; i++) {
		json_t *one = file_to_json(&o->assets, i ? s->assets[i - 1] : o->name, e);
		if (!one || json_array_append_new(files, one)) {
			json_decref(files);
			return NULL;
		}
	}
	return files;
}

static json_t *effects_to_json(const struct render_summary *m)
{
	json_t *on = json_array();
	for (size_t i = 0; i < m->effect_line_count; i++)
		if (m->effect_lines[i].is_on)
			json_array_append_new(on, json_string(m->effect_lines[i].name));
	return on;
}

/* Returns everything that `show` prints, as JSON, from which the text is made, too. NULL, with the error set, after a
 * failure. */
static json_t *scene_to_json(const struct scene *s, const struct opened_scene *o, struct error *e)
{
	static struct render_summary m; /* too large for the stack */
	const struct render_options default_options = {0};
	if (world_check(s, &o->assets, &default_options, &m, e))
		return NULL;
	json_t *files = files_to_json(s, o, e), *notes = json_array();
	if (!files)
		return NULL;
	for (uint32_t i = 0; i < s->note_count; i++)
		json_array_append_new(notes, json_string(s->notes[i]));
	char text[512];
	for (size_t i = 0; render_scene_note(&m, i, text, sizeof text); i++)
		json_array_append_new(notes, json_string(text));
	const struct scene_settings *f = &m.settings;
	json_t *all =
		json_pack("{s:i s:s s:s s:i s:i s:I s:f s:s s:i s:I s:I s:I s:I s:I s:I s:I s:I s:o s:o s:o}", "schema",
			  1, "scene", o->name, "dialect",
			  gltf_is_file_name(o->name) ? "glTF 2.0"
			  : s->is_dialect_3	     ? "3.x"
						     : "0.6",
			  "width", (int)f->width, "height", (int)f->height, "sampleCount", (json_int_t)f->spp, "fov",
			  f->fov, "fovAxis", f->fov_axis, "maxDepth", (int)f->max_depth, "shapes", (json_int_t)m.shapes,
			  "triangles", (json_int_t)m.triangles, "segments", (json_int_t)m.segments, "instances",
			  (json_int_t)m.instances, "sharingShapes", (json_int_t)m.sharing_shapes, "sharedMeshes",
			  (json_int_t)m.shared_meshes, "storedTriangles", (json_int_t)m.stored_triangles, "memoryBytes",
			  (json_int_t)m.memory_bytes, "effects", effects_to_json(&m), "notes", notes, "files", files);
	if (!all)
		error_set(e, ENOMEM, "no memory for the description");
	return all;
}

/* Prints the numbers of instances and of shapes that share meshes. They differ: small meshes are copied for each
 * instance, and moving shapes may share a mesh without being instances. */
static void print_instances(long long instances, long long sharing, long long meshes)
{
	printf(" (");
	if (instances)
		printf("%lld instance%s%s", instances, instances == 1 ? "" : "s", sharing ? "; " : "");
	if (sharing)
		printf("%lld share%s %lld mesh%s", sharing, sharing == 1 ? "s" : "", meshes, meshes == 1 ? "" : "es");
	printf(")");
}

static void print_text(json_t *all)
{
	size_t i;
	json_t *one;
	const char *text;
	long long shapes, triangles, segments, spp, instances, sharing, meshes, stored, memory;
	int width, height, depth;
	double fov;
	const char *name, *dialect, *axis;
	char text_of_segments[64];
	json_unpack(all, "{s:s s:s s:i s:i s:I s:f s:s s:i s:I s:I s:I s:I s:I s:I s:I s:I}", "scene", &name, "dialect",
		    &dialect, "width", &width, "height", &height, "sampleCount", &spp, "fov", &fov, "fovAxis", &axis,
		    "maxDepth", &depth, "shapes", &shapes, "triangles", &triangles, "segments", &segments, "instances",
		    &instances, "sharingShapes", &sharing, "sharedMeshes", &meshes, "storedTriangles", &stored,
		    "memoryBytes", &memory);
	bool gltf = strncmp(dialect, "glTF", 4) == 0;
	printf("%s: %s%s, film %d x %d, field of view %.4g degrees (%s), ", name, gltf ? "" : "Mitsuba ", dialect,
	       width, height, fov, axis);
	if (spp)
		printf("%lld sample%s per pixel, ", spp, spp == 1 ? "" : "s");
	printf("paths of at most %d edge%s\n%lld shape%s", depth, depth == 1 ? "" : "s", shapes,
	       shapes == 1 ? "" : "s");
	if (instances || sharing)
		print_instances(instances, sharing, meshes);
	printf(", %lld triangle%s", triangles, triangles == 1 ? "" : "s");
	if (sharing)
		printf(" (%lld in memory)", stored);
	printf("%s", segments_text((uint64_t)segments, text_of_segments, sizeof text_of_segments));
	printf(", about %.0f MB; effects needed:", ceil((double)memory * 0x1p-20));
	json_array_foreach(json_object_get(all, "effects"), i, one)
		printf("%s %s", i ? "," : "", json_string_value(one));
	printf("\n");
	json_array_foreach(json_object_get(all, "files"), i, one)
	{
		json_int_t bytes = json_integer_value(json_object_get(one, "bytes"));
		text = json_string_value(json_object_get(one, "sha256"));
		printf("%.16s %12lld bytes  %s\n", text, (long long)bytes,
		       json_string_value(json_object_get(one, "name")));
	}
	json_array_foreach(json_object_get(all, "notes"), i, one) printf("note: %s\n", json_string_value(one));
}

int scene_report_show(const struct render_arguments *a, bool lenient, bool json, struct error *e)
{
	struct opened_scene o;
	struct scene s;
	int rc = open_scene(a, &o, e);
	if (rc)
		return rc;
	rc = (lenient ? scene_read_lenient : scene_read)(&s, &o.assets, o.name, render_plugins(), a->defines,
							 a->define_count, e);
	if (!rc) {
		json_t *all = scene_to_json(&s, &o, e);
		if (all && json)
			rc = json_dumpf(all, stdout, JSON_COMPACT) || putchar('\n') == EOF
				     ? error_set(e, EIO, "stdout: a write failed")
				     : 0;
		else if (all)
			print_text(all);
		else
			rc = -EINVAL;
		json_decref(all);
		scene_fini(&s);
	}
	close_scene(&o);
	return rc;
}
