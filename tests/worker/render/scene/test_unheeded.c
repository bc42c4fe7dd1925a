/* SPDX-License-Identifier: Apache-2.0 */
/* Parameters that change light a little and are not supported: a note by name, none where the file says that it is off.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define BENT(type, name, value)                                                                                   \
	"<bsdf type='" type "'><texture name='t' type='checkerboard'/><bsdf type='diffuse'/><boolean name='" name \
	"' value='" value "'/></bsdf>"

/* note: NULL: there is none with `not supported` */
static void check(const char *inside, const char *note)
{
	char xml[1024];
	struct scene s;
	struct error e;
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", inside);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s: %s", inside, e.text);
	if (scene_has_note(&s, note ? note : "not supported") != (note != NULL))
		fail_msg("%s: %s", inside, note ? note : "a note too many");
	scene_fini(&s);
}

static void test_notes(void **state)
{
	(void)state;
	check("<emitter type='sky'><rgb name='albedo' value='1 0 0'/></emitter>", NULL);
	check("<emitter type='sky'/>", NULL);
	check(BENT("bumpmap", "flip_invalid_normals", "true"), NULL);
	check(BENT("bumpmap", "use_shadowing_function", "true"), NULL);
	check("<emitter type='directional'><float name='angle' value='0.53'/></emitter>",
	      "`angle` is not supported: the image differs a little from Mitsuba's");
	check("<emitter type='directional'><float name='angle' value='0.0'/></emitter>", NULL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_notes)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
