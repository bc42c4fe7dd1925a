/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/path_class.h"

#include <assert.h>

const char *path_class_name(unsigned path_class)
{
#define LENGTHS(kind)                                                                                 \
	{                                                                                             \
		kind ", 1-2 edges", kind ", 3-4 edges", kind ", 5-8 edges", kind ", 9 edges and more" \
	}
	static const char *const names[PATH_CLASS_KINDS][PATH_CLASS_LENGTHS] = {
		[PATH_ROUGH] = LENGTHS("rough"),     [PATH_REFLECTED] = LENGTHS("reflected"),
		[PATH_CAUSTIC] = LENGTHS("caustic"), [PATH_REFLECTED_CAUSTIC] = LENGTHS("reflected caustic"),
		[PATH_SMOOTH] = LENGTHS("smooth"),
	};
#undef LENGTHS
	assert(path_class < PATH_CLASSES);
	return names[path_class / PATH_CLASS_LENGTHS][path_class % PATH_CLASS_LENGTHS];
}
