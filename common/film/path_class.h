/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Classes of paths, by number of edges and by the position of smooth vertices (Heckbert 1990). The energy of each class
 * in the chains is compared with that in the bootstrap: where independent sampling hardly ever finds a class, each
 * chain may look converged although the chains disagree with each other. Pure.
 */
#ifndef COMMON_FILM_PATH_CLASS_H
#define COMMON_FILM_PATH_CLASS_H

#include <stdbool.h>

/* Inner vertices are smooth (specular, or a lobe narrower than PATH_CLASS_ALPHA) or rough. */
enum path_class_kind {
	PATH_ROUGH,	/* no smooth vertex */
	PATH_REFLECTED, /* smooth vertices only between the camera and the first rough vertex, such as a mirror image */
	PATH_CAUSTIC,	/* the vertex next to the camera is rough, and a smooth vertex follows nearer to the light */
	PATH_REFLECTED_CAUSTIC, /* a smooth vertex next to the camera, then a rough one, then a smooth one: a caustic in
				   a mirror */
	PATH_SMOOTH,		/* smooth vertices only */
	PATH_CLASS_KINDS,
	PATH_NO_VERTEX = PATH_CLASS_KINDS, /* no inner vertex yet, for path_class_kind_next; counts as PATH_ROUGH */
};
enum path_class_length { PATH_EDGES_1_2, PATH_EDGES_3_4, PATH_EDGES_5_8, PATH_EDGES_9_UP, PATH_CLASS_LENGTHS };
enum { PATH_CLASSES = PATH_CLASS_KINDS * PATH_CLASS_LENGTHS };

#define PATH_CLASS_ALPHA 0.1 /* roughness below which a lobe counts as smooth */

/* Returns the kind of a path after one more inner vertex, smooth or rough, is appended on the light's side. */
static inline enum path_class_kind path_class_kind_next(enum path_class_kind kind, bool smooth)
{
	static const unsigned char next[PATH_CLASS_KINDS + 1][2] = {
		[PATH_NO_VERTEX] = {PATH_ROUGH, PATH_SMOOTH},
		[PATH_ROUGH] = {PATH_ROUGH, PATH_CAUSTIC},
		[PATH_SMOOTH] = {PATH_REFLECTED, PATH_SMOOTH},
		[PATH_REFLECTED] = {PATH_REFLECTED, PATH_REFLECTED_CAUSTIC},
		[PATH_CAUSTIC] = {PATH_CAUSTIC, PATH_CAUSTIC},
		[PATH_REFLECTED_CAUSTIC] = {PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC},
	};
	return (enum path_class_kind)next[kind][smooth];
}

/* Returns the kind of a path whose inner vertices are those of `camera`, followed by those of `light`. */
static inline enum path_class_kind path_class_kind_join(enum path_class_kind camera, enum path_class_kind light)
{
	/* Row: the kind of the vertices on the camera's side; column: the kind of the others, in the enum's order. */
	static const unsigned char join[PATH_CLASS_KINDS + 1][PATH_CLASS_KINDS + 1] = {
		[PATH_ROUGH] = {PATH_ROUGH, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_ROUGH},
		[PATH_REFLECTED] = {PATH_REFLECTED, PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC,
				    PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC, PATH_REFLECTED},
		[PATH_CAUSTIC] = {PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC},
		[PATH_REFLECTED_CAUSTIC] = {PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC,
					    PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC},
		[PATH_SMOOTH] = {PATH_REFLECTED, PATH_REFLECTED, PATH_REFLECTED_CAUSTIC, PATH_REFLECTED_CAUSTIC,
				 PATH_SMOOTH, PATH_SMOOTH},
		[PATH_NO_VERTEX] = {PATH_ROUGH, PATH_REFLECTED, PATH_CAUSTIC, PATH_REFLECTED_CAUSTIC, PATH_SMOOTH,
				    PATH_NO_VERTEX},
	};
	return (enum path_class_kind)join[camera][light];
}

/* Returns the class of a path, 0 to PATH_CLASSES - 1; the classes of a kind are adjacent. edges >= 1. */
static inline unsigned path_class(unsigned edges, enum path_class_kind kind)
{
	unsigned row = kind == PATH_NO_VERTEX ? PATH_ROUGH : kind;
	static const unsigned char length[] = {PATH_EDGES_1_2, PATH_EDGES_1_2, PATH_EDGES_1_2,
					       PATH_EDGES_3_4, PATH_EDGES_3_4, PATH_EDGES_5_8,
					       PATH_EDGES_5_8, PATH_EDGES_5_8, PATH_EDGES_5_8};
	return row * PATH_CLASS_LENGTHS + (edges <= 8 ? length[edges] : PATH_EDGES_9_UP);
}
/* Returns a name such as "caustic, 3-4 edges". */
const char *path_class_name(unsigned path_class);

#endif
