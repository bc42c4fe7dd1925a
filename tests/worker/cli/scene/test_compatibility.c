/* SPDX-License-Identifier: Apache-2.0 */
/* docs/compatibility.md must equal the list generated from the registries. The working folder is the root of the
 * tree. */
#include "worker/cli/scene/compatibility.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_compatibility_page_is_up_to_date(void **state)
{
	(void)state;
	char *text = NULL, line[8192];
	size_t size = 0;
	FILE *out = open_memstream(&text, &size), *page = fopen("docs/compatibility.md", "r");
	assert_true(out && page);
	compatibility_print(out);
	assert_int_equal(fclose(out), 0);
	const char *rest = text;
	for (int n = 1; fgets(line, sizeof line, page); n++) {
		size_t length = strlen(line);
		if (strncmp(rest, line, length) != 0)
			fail_msg("line %d is stale (hslt-scene compatibility >docs/compatibility.md): %s", n, line);
		rest += length;
	}
	assert_string_equal(rest, "");
	/* One row of each kind that must be present. */
	assert_non_null(strstr(text, "\n| `roughconductor` | `material`"));
	assert_non_null(strstr(text, "\n| emitter | `astroobject` |"));
	assert_non_null(strstr(text, "\n| any | `max_depth`"));
	assert_null(strstr(text, "| bsdf | `diffuse` |"));
	assert_non_null(strstr(text, "\n| `<blackbody>` | `name`, `temperature`, `scale` |"));
	assert_non_null(strstr(text, "\n| `filename` | a file (`.spd`)"));
	assert_non_null(strstr(text, "\n| `irregular` | `wavelengths`, `values` |"));
	assert_non_null(strstr(
		text, "\n| `direct`, `direct_projective` | light that is scattered once, with a note; no media"));
	assert_non_null(strstr(
		text, "`ptracer`, `bdpt`, `mlt`, `pssmlt`, `erpt`, `hslt`, `adaptive`, `motion` | all light |\n"));
	assert_non_null(strstr(text, "`halton`, `hammersley`"));
	assert_null(strstr(text, "| sampler | `halton`"));
	assert_non_null(strstr(text, "\n| `singlescatter` | nothing"));
	assert_non_null(strstr(text, "\n| bsdf `disney` | `principled` | 2.x and 3.x |"));
	assert_non_null(
		strstr(text, "\n| `diffuse_reflectance` of the bsdf `diffuse` | `reflectance` | 0.5 and 0.6 |"));
	fclose(page);
	free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_compatibility_page_is_up_to_date)};
	return cmocka_run_group_tests_name("compatibility", tests, NULL, NULL);
}
