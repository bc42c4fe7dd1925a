/* SPDX-License-Identifier: Apache-2.0 */
/* A glTF file's JSON tree, and the elements made from it. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_TREE_H
#define WORKER_RENDER_GLTF_GLTF_TREE_H

#include "worker/render/math/mat4.h"
#include "worker/render/xml/xml.h"

#include <jansson.h>

enum {
	GLTF_JSON_MAX = 128 << 20,     /* bytes of the JSON, including embedded data */
	GLTF_VALUES_MAX = 1 << 22,     /* values in the JSON, each of at most 250 bytes of memory */
	GLTF_EMBEDDED_MAX = 4096,      /* buffers and images embedded in the JSON */
	GLTF_PRIMITIVES_MAX = 1 << 18, /* for all meshes, counted once per node that has them */
};

#define GLTF_INTEGER_MAX 9007199254740992.0 /* a double represents all integers up to here */

/* Top-level arrays whose entries are named in messages. */
enum gltf_array {
	GLTF_ACCESSORS,
	GLTF_BUFFERS,
	GLTF_BUFFER_VIEWS,
	GLTF_CAMERAS,
	GLTF_IMAGES,
	GLTF_LIGHTS,
	GLTF_MATERIALS,
	GLTF_MESHES,
	GLTF_NODES,
	GLTF_SAMPLERS,
	GLTF_SCENES,
	GLTF_SKINS,
	GLTF_TEXTURES,
	GLTF_ARRAYS
};

/* Types of an accessor's components. */
enum gltf_component {
	GLTF_BYTE = 5120,
	GLTF_UNSIGNED_BYTE,
	GLTF_SHORT,
	GLTF_UNSIGNED_SHORT,
	GLTF_UNSIGNED_INT = 5125,
	GLTF_FLOAT
};

/* An entry of a top-level array. */
struct gltf_entry {
	enum gltf_array array;
	size_t index;
	const json_t *json; /* an object */
};

/* The bytes of a compressed view. */
struct gltf_unpacked_view {
	unsigned char *bytes; /* allocated with mem_alloc(); NULL: not needed so far */
	uint64_t byte_count;
};

/* Where the bytes of a buffer, a view or an image are. */
struct gltf_range {
	const char *file;
	uint64_t first_byte, byte_count;
	bool is_base64;	     /* first_byte and byte_count are of the text, offsets of views of the decoded bytes */
	uint64_t size;	     /* number of decoded bytes */
	unsigned skip_bytes; /* decoded bytes to skip at the beginning */
};

struct gltf {
	struct xml_tree *tree;
	const struct asset_source *assets;
	struct arena *arena;
	struct error *error;
	int error_code; /* negative errno of an error: nothing more is added to the tree until gltf_record_failure() */
	const char *file;
	const unsigned char *bytes; /* contents of the file */
	size_t size;
	uint64_t binary_offset, binary_size; /* the binary chunk of a .glb */
	json_t *root;
	const json_t *lights;	 /* NULL: none */
	int *lines[GLTF_ARRAYS]; /* line on which each entry begins */
	size_t line_count[GLTF_ARRAYS], line_capacity[GLTF_ARRAYS];
	struct gltf_range *buffers, *images; /* embedded data located so far, by entry */
	unsigned embedded_count, primitive_count;
	unsigned char *is_material_made; /* by material: made for these bits 1 << enum gltf_vertex_colours */
	/* Open buffers: the last one in a file; a list of those in base64. */
	struct gltf_open_buffer *open_file, *decoded_buffers;
	struct gltf_unpacked_view *unpacked_views; /* by view; NULL: no compressed view was needed so far */
	uint64_t unpacked_bytes;		   /* total size of these */
	size_t *parents;			   /* by node (gltf_node.h); NULL: not needed so far */
	uint64_t embedded_bytes;		   /* total size of computed vertices */
	uint64_t bytes_read;			   /* so far, from files with buffers */
	double *mesh_use_counts;		   /* by mesh: number of nodes that use it */
	bool *is_mesh_made;			   /* by mesh: a shapegroup was made of it */
	struct xml_element *scene;
	/* Nodes whose meshes a scale of 0 makes lines or points; index of the first. */
	size_t scaled_away_count, first_scaled_away;
	bool has_camera, has_light;
	bool is_from_blender;	  /* Blender's exporter wrote the file */
	bool uses_burley_diffuse; /* the writer's diffuse surfaces follow Burley, not Lambert, as the format's do */
	double lamp_scale;	  /* factor for the intensities of KHR_lights_punctual */
	vec3 box_min, box_max;	  /* bounding box of all vertices */
};

const char *gltf_array_name(enum gltf_array array);
/* Finds the entry with that index. Returns false, after a failure, if there is none. */
bool gltf_find_entry(struct gltf *g, enum gltf_array array, uint64_t index, struct gltf_entry *out);
/* Finds the entry whose index is the value of `key`. Returns 1 if found, 0 if there is no such key, negative after a
 * failure. */
int gltf_resolve(struct gltf *g, const struct gltf_entry *referrer, const json_t *object, const char *key,
		 enum gltf_array array, struct gltf_entry *out);
/* Sets g->error_code, and the error with "file:line: array[index]: " before the text. Returns g->error_code. */
__attribute__((format(printf, 4, 5))) int gltf_fail(struct gltf *g, const struct gltf_entry *entry, int errno_value,
						    const char *format, ...);

/* Called after a node or a primitive, which is complete by itself: moves a failure to the list of what is missing,
 * so that reading goes on. A limit that was exceeded still ends the reading. */
void gltf_record_failure(struct gltf *g);

/* Each returns a member of an object, or a default if it is missing; a member of another type is an error. */
double gltf_number(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key, double fallback);
uint64_t gltf_integer(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key,
		      uint64_t fallback);
const char *gltf_string(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key,
			const char *fallback);
/* Stores `count` numbers in x, which keeps its values if the member is missing. */
void gltf_numbers(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key, double *x,
		  size_t count);
/* Or NULL. */
const json_t *gltf_object(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key);
const json_t *gltf_extension(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *name);

/* Make elements, with the line of an entry. With NULL as parent nothing is made, and NULL is returned. */
struct xml_element *gltf_add_element(struct gltf *g, struct xml_element *parent, const struct gltf_entry *entry,
				     const char *name);
__attribute__((format(printf, 4, 5))) void gltf_add_attribute(struct gltf *g, struct xml_element *el, const char *name,
							      const char *format, ...);
/* <cls type="..." name="...">; without a name if that is NULL */
struct xml_element *gltf_add_plugin(struct gltf *g, struct xml_element *parent, const struct gltf_entry *entry,
				    const char *cls, const char *type, const char *name);
void gltf_put_number(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		     double x);
void gltf_put_integer(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		      uint64_t x);
void gltf_put_bool(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name, bool x);
void gltf_put_string(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		     const char *text);
void gltf_put_rgb(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		  const double rgb[3]);
void gltf_put_matrix(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		     const mat4 *m);
void gltf_extend_bounds(struct gltf *g, vec3 p); /* extends the box by a vertex */
/* Adds a note, only once per file. */
void gltf_note(struct gltf *g, const char *text);
/* Returns whether one of the first 64 entries of the file's `list`, extensionsUsed or extensionsRequired, is this
 * extension. The bound keeps the time of a hostile file linear; what is listed later may be reported twice. */
bool gltf_lists_extension(const struct gltf *g, const char *list, const char *extension);
/* Returns whether the reader knows the extension, supported or not. */
bool gltf_is_known_extension(const char *extension);

#endif
