/*
 * Classes of paths, by how many edges they have and where their smooth vertices lie (Heckbert 1990). What chains say of the
 * energy of each is held against what the bootstrap says: a class that independent sampling hardly finds is where chains
 * agree with themselves and not with each other. Pure.
 */
#ifndef COMMON_FILM_PATH_CLASS_H
#define COMMON_FILM_PATH_CLASS_H

/* Inner vertices are smooth (delta, or a lobe narrower than PATH_CLASS_ALPHA) or rough. */
enum path_class_kind {
	PATH_ROUGH,     /* no smooth vertex */
	PATH_REFLECTED, /* smooth ones only between the camera and the first rough one: seen in a mirror or through glass */
	PATH_CAUSTIC,   /* smooth ones only between the light and the last rough one, or rough ones on both sides of them */
	PATH_BOTH,      /* smooth ones towards the camera and towards the light, a rough one between: caustics in mirrors */
	PATH_SMOOTH,    /* smooth vertices only */
	PATH_CLASS_KINDS,
};
enum path_class_length { PATH_EDGES_1_2, PATH_EDGES_3_4, PATH_EDGES_5_8, PATH_EDGES_9_UP, PATH_CLASS_LENGTHS };
enum { PATH_CLASSES = PATH_CLASS_KINDS * PATH_CLASS_LENGTHS };

#define PATH_CLASS_ALPHA 0.1

/* 0..PATH_CLASSES - 1 */
unsigned path_class(unsigned edges, enum path_class_kind kind);
/* "caustic, 3-4 edges" */
const char *path_class_name(unsigned path_class);

#endif
