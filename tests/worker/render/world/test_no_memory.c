/* SPDX-License-Identifier: Apache-2.0 */
/* Whichever allocation fails, building a world returns -ENOMEM and leaks no memory. */
#include "tests/support/failing_memory.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/render.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void failed_allocations_of_a_world_are_reported(void **state)
{
	(void)state;
	/* clang-format off */
	static const char text[] =
		"<scene version='3.0.0'>"
			SENSOR("0,0,5", "0,0,0")
			"<shape type='cube'>"
				"<bsdf type='twosided'>"
					"<bsdf type='diffuse'>"
						"<texture name='reflectance' type='checkerboard'/>"
					"</bsdf>"
				"</bsdf>"
			"</shape>"
			"<shape type='sphere'><bsdf type='roughdielectric'/></shape>"
			"<shape type='rectangle'><emitter type='area'/></shape>"
			"<emitter type='constant'/>"
		"</scene>";
	/* clang-format on */
	const struct memory_file files[] = {{"a.xml", text, sizeof text - 1}, {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct error e = {""};
	struct scene s;
	if (scene_read(&s, &assets, "a.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	int failed = 0;
	for (long i = 0;; i++) {
		struct world *w = NULL;
		mem_fail_after(i);
		int rc = world_new(&w, &s, &assets, NULL, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || (rc == -ENOMEM && !w));
		world_free(w);
		if (rc == 0)
			break;
		failed++;
	}
	print_message("%d allocations\n", failed);
	assert_true(failed >= 4);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(failed_allocations_of_a_world_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
