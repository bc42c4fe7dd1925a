#include "common/film/path_class.h"

#include <assert.h>

unsigned path_class(unsigned edges, enum path_class_kind kind)
{
	assert(edges >= 1 && kind <= PATH_NO_VERTEX);
	unsigned row = kind == PATH_NO_VERTEX ? PATH_ROUGH : kind;
	unsigned length = edges <= 2 ? PATH_EDGES_1_2 : edges <= 4 ? PATH_EDGES_3_4 : edges <= 8 ? PATH_EDGES_5_8 : PATH_EDGES_9_UP;
	return row * PATH_CLASS_LENGTHS + length;
}

const char *path_class_name(unsigned path_class)
{
#define LENGTHS(kind) {kind ", 1-2 edges", kind ", 3-4 edges", kind ", 5-8 edges", kind ", 9 edges and more"}
	static const char *const names[PATH_CLASS_KINDS][PATH_CLASS_LENGTHS] = {
		[PATH_ROUGH] = LENGTHS("rough"),
		[PATH_REFLECTED] = LENGTHS("reflected"),
		[PATH_CAUSTIC] = LENGTHS("caustic"),
		[PATH_BOTH] = LENGTHS("reflected caustic"),
		[PATH_SMOOTH] = LENGTHS("smooth"),
	};
#undef LENGTHS
	assert(path_class < PATH_CLASSES);
	return names[path_class / PATH_CLASS_LENGTHS][path_class % PATH_CLASS_LENGTHS];
}
