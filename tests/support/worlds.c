/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/render.h"
#include "tests/support/worlds.h"

#include "tests/support/memory_assets.h"

#include <stdarg.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

const char *worlds_accuracy, *worlds_effects;

static struct render_options make_options(uint32_t width, uint32_t height)
{
	struct render_options o = {.width = width, .height = height};
	snprintf(o.accuracy, sizeof o.accuracy, "%s", worlds_accuracy ? worlds_accuracy : "");
	snprintf(o.effects, sizeof o.effects, "%s", worlds_effects ? worlds_effects : "");
	return o;
}

static struct world *build_world(const struct asset_source *assets, const char *name, uint32_t width, uint32_t height)
{
	struct error e = {""};
	struct scene s;
	struct world *w = NULL;
	struct render_options o = make_options(width, height);
	int rc = scene_read(&s, assets, name, render_plugins(), NULL, 0, &e);
	if (!rc) {
		/* Scenes of tests need not care which way their surfaces face, unless they set `backs`. */
		s.has_black_backs &= strstr(o.accuracy, "backs=") != NULL;
		rc = world_new(&w, &s, assets, &o, &e);
		scene_fini(&s);
	}
	if (rc)
		fail_msg("%s", e.text);
	return w;
}

struct world *world_from_text(uint32_t width, uint32_t height, const char *format, ...)
{
	static char body[1 << 16], text[sizeof body + 64];
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(body, sizeof body, format, ap);
	va_end(ap);
	assert_true(n > 0 && (size_t)n < sizeof body);
	int m = snprintf(text, sizeof text, "<scene version='3.0.0'>%s</scene>", body);
	const struct memory_file files[] = {{"test.xml", text, (size_t)m}, {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	return build_world(&assets, "test.xml", width, height);
}

void world_check_files_refused(const struct memory_file *files, const char *sentence)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct world *w = NULL;
	struct error e = {""};
	int rc = scene_read(&s, &assets, files[0].name, render_plugins(), NULL, 0, &e);
	if (!rc) {
		struct render_options o = make_options(0, 0);
		rc = world_new(&w, &s, &assets, &o, &e);
		scene_fini(&s);
	}
	if (rc >= 0 || !strstr(e.text, sentence))
		fail_msg("%.*s\n gave %d: %s\n not: %s", (int)files[0].size, (const char *)files[0].bytes, rc, e.text,
			 sentence);
}

void world_check_refused(const char *body, const char *sentence)
{
	static char xml[2048];
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>" SENSOR("0,0,9", "0,0,0") "%s</scene>", body);
	assert_true(n > 0 && (size_t)n < sizeof xml);
	world_check_files_refused((const struct memory_file[]){{"s.xml", xml, (size_t)n}, {NULL, NULL, 0}}, sentence);
}

struct world *world_from_files(uint32_t width, uint32_t height, const struct memory_file *files)
{
	struct asset_source assets = memory_assets(files);
	return build_world(&assets, files[0].name, width, height);
}

static struct world *build_from_folder(const char *base, const char *folder, const char *file, uint32_t width,
				       uint32_t height)
{
	char path[4096];
	snprintf(path, sizeof path, "%s/%s", base, folder);
	struct asset_source assets = asset_source_for_folder(path);
	return build_world(&assets, file, width, height);
}

struct world *world_from_public_scene(const char *folder, const char *file, uint32_t width, uint32_t height)
{
	const char *scenes = getenv("HSLT_SCENES");
	if (!scenes)
		return NULL;
	return build_from_folder(scenes, folder, file, width, height);
}

struct world *world_from_own_scene(const char *folder, const char *file, uint32_t width, uint32_t height)
{
	return build_from_folder("tests/scenes", folder, file, width, height);
}
