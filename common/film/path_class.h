/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Classes of paths, by number of edges and position of smooth vertices (Heckbert 1990). The energy of each class in the
 * chains is compared with the bootstrap's: in a class that independent sampling hardly finds, chains may agree with
 * themselves but not with each other. Pure.
 */
#ifndef COMMON_FILM_PATH_CLASS_H
#define COMMON_FILM_PATH_CLASS_H

#include <stdbool.h>

/* Inner vertices are smooth (specular, or a lobe narrower than PATH_CLASS_ALPHA) or rough. */
enum path_class_kind {
	PATH_ROUGH,	/* no smooth vertex */
	PATH_REFLECTED, /* smooth only between the camera and the first rough vertex: seen in a mirror or through glass
			 */
	PATH_CAUSTIC,	/* smooth only between the light and the last rough vertex, or with rough vertices on both sides
			 */
	PATH_BOTH, /* smooth towards the camera and towards the light, with a rough one between: caustics in mirrors */
	PATH_SMOOTH, /* smooth vertices only */
	PATH_CLASS_KINDS,
	PATH_NO_VERTEX = PATH_CLASS_KINDS, /* where path_class_kind_next starts; as a kind it is PATH_ROUGH */
};
enum path_class_length { PATH_EDGES_1_2, PATH_EDGES_3_4, PATH_EDGES_5_8, PATH_EDGES_9_UP, PATH_CLASS_LENGTHS };
enum { PATH_CLASSES = PATH_CLASS_KINDS * PATH_CLASS_LENGTHS };

#define PATH_CLASS_ALPHA 0.1

/* The kind of a path with one more inner vertex on the light's side. */
static inline enum path_class_kind path_class_kind_next(enum path_class_kind kind, bool smooth)
{
	static const unsigned char next[PATH_CLASS_KINDS + 1][2] = {
		[PATH_NO_VERTEX] = {PATH_ROUGH, PATH_SMOOTH},  [PATH_ROUGH] = {PATH_ROUGH, PATH_CAUSTIC},
		[PATH_SMOOTH] = {PATH_REFLECTED, PATH_SMOOTH}, [PATH_REFLECTED] = {PATH_REFLECTED, PATH_BOTH},
		[PATH_CAUSTIC] = {PATH_CAUSTIC, PATH_CAUSTIC}, [PATH_BOTH] = {PATH_BOTH, PATH_BOTH},
	};
	return (enum path_class_kind)next[kind][smooth];
}

/* The class of a path whose inner vertices are the vertices of `camera`, then those of `light`. */
static inline enum path_class_kind path_class_kind_join(enum path_class_kind camera, enum path_class_kind light)
{
	/* Row: the kind of the vertices so far; column: the kind of those that follow, in the order of the enum. */
	static const unsigned char join[PATH_CLASS_KINDS + 1][PATH_CLASS_KINDS + 1] = {
		[PATH_ROUGH] = {PATH_ROUGH, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_ROUGH},
		[PATH_REFLECTED] = {PATH_REFLECTED, PATH_BOTH, PATH_BOTH, PATH_BOTH, PATH_BOTH, PATH_REFLECTED},
		[PATH_CAUSTIC] = {PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC, PATH_CAUSTIC},
		[PATH_BOTH] = {PATH_BOTH, PATH_BOTH, PATH_BOTH, PATH_BOTH, PATH_BOTH, PATH_BOTH},
		[PATH_SMOOTH] = {PATH_REFLECTED, PATH_REFLECTED, PATH_BOTH, PATH_BOTH, PATH_SMOOTH, PATH_SMOOTH},
		[PATH_NO_VERTEX] = {PATH_ROUGH, PATH_REFLECTED, PATH_CAUSTIC, PATH_BOTH, PATH_SMOOTH, PATH_NO_VERTEX},
	};
	return (enum path_class_kind)join[camera][light];
}

/* 0..PATH_CLASSES - 1, with all lengths of a kind adjacent; edges >= 1 */
static inline unsigned path_class(unsigned edges, enum path_class_kind kind)
{
	unsigned row = kind == PATH_NO_VERTEX ? PATH_ROUGH : kind;
	static const unsigned char length[] = {PATH_EDGES_1_2, PATH_EDGES_1_2, PATH_EDGES_1_2,
					       PATH_EDGES_3_4, PATH_EDGES_3_4, PATH_EDGES_5_8,
					       PATH_EDGES_5_8, PATH_EDGES_5_8, PATH_EDGES_5_8};
	return row * PATH_CLASS_LENGTHS + (edges <= 8 ? length[edges] : PATH_EDGES_9_UP);
}
/* "caustic, 3-4 edges" */
const char *path_class_name(unsigned path_class);

#endif
