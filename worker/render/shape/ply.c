/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Stanford PLY files: ascii and both byte orders, with elements and properties in any order.
 *
 * The header describes the data. A first pass counts the triangles, so that memory is allocated once, and a second pass
 * stores the data. If faces come before vertices, there is a third pass, because concave polygons are cut by the
 * positions of their corners (polygon.h). Vertices have x y z, nx ny nz and u v (or s t), faces vertex_indices (or
 * vertex_index). All other numbers of vertices and faces are attributes: integers stand for 0 to 1 and are decoded from
 * sRGB, as in Mitsuba. Lists and other elements are skipped.
 *
 * Reading fails if the header is invalid, if the file is truncated, if an index is out of range, or if a number is not
 * finite. Counts in the header are checked against the size of the file before anything is allocated.
 */
#include "common/base/liveness.h"
#include "worker/render/text/number.h"
#include "worker/render/image/srgb.h"
#include "worker/render/shape/attribute_names.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"
#include "worker/render/shape/polygon.h"

#include <string.h>

enum { PROPERTIES_MAX = 64, ELEMENTS_MAX = 16, WORD_MAX = 64, TICK_INTERVAL = 4096 };
/* The attributes of a polygon are copied to each of its triangles. They may have up to ATTRIBUTE_VALUES_PER_BYTE
 * numbers per byte of the file, and up to ATTRIBUTE_VALUES_MIN_LIMIT in any file. */
enum { ATTRIBUTE_VALUES_PER_BYTE = 8, ATTRIBUTE_VALUES_MIN_LIMIT = 1 << 20 };

enum scalar { SCALAR_NONE, INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 };
static const uint8_t scalar_size[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};

enum ply_format { FORMAT_ASCII, FORMAT_LITTLE_ENDIAN, FORMAT_BIG_ENDIAN };

/* The meaning of a number. */
enum property_role {
	ROLE_NONE = -1,
	ROLE_X,
	ROLE_Y,
	ROLE_Z,
	ROLE_NX,
	ROLE_NY,
	ROLE_NZ,
	ROLE_U,
	ROLE_V,
	ROLES,
	ROLE_INDICES
};

struct ply_property {
	enum scalar type, count_type; /* count_type: of a list's length; SCALAR_NONE: not a list */
	enum property_role role;
	bool is_in_attribute;
	uint32_t group, channel; /* of the attribute */
};

enum element_kind { ELEMENT_OTHER, ELEMENT_VERTEX, ELEMENT_FACE };

struct ply_element {
	enum element_kind kind;
	char name[WORD_MAX];
	uint64_t count;
	uint32_t property_count;
	struct ply_property properties[PROPERTIES_MAX];
	struct attribute_groups groups;
	bool is_integer[ATTRIBUTE_GROUPS_MAX];		    /* by group: its numbers are integers */
	struct attribute *attributes[ATTRIBUTE_GROUPS_MAX]; /* by group; NULL: the group is not stored */
};

struct ply {
	const struct scene_node *node;
	const char *name;
	struct error *error;
	const char *p, *end;
	char newline; /* ends a line of the header: \n, possibly after \r, or \r alone, as Rhino writes */
	int line;     /* current line of the header */
	enum ply_format format;
	uint32_t element_count;
	struct ply_element elements[ELEMENTS_MAX];
	bool has_role[ROLES];
	uint64_t triangle_count;
	struct mesh *mesh;
	bool flips_v;
	const bool *is_srgb; /* the parameter `is_srgb`; NULL: not given */
};

/* Reads the next word of a line of the header. Returns false at the end of the line. */
static bool next_word(struct ply *f, char word[WORD_MAX])
{
	while (f->p < f->end && (*f->p == ' ' || *f->p == '\t' || (*f->p == '\r' && f->newline == '\n')))
		f->p++;
	size_t n = 0;
	for (; f->p < f->end && !number_is_blank(*f->p); f->p++)
		if (n + 1 < WORD_MAX)
			word[n++] = *f->p;
	word[n] = 0;
	return n > 0;
}

static void skip_line(struct ply *f)
{
	const char *newline = memchr(f->p, f->newline, (size_t)(f->end - f->p));
	f->p = newline ? newline + 1 : f->end;
	f->line++;
}

static enum scalar find_scalar(const char *name)
{
	static const struct {
		const char *name;
		enum scalar type;
	} names[] = {{"char", INT8},	 {"int8", INT8},       {"uchar", UINT8},    {"uint8", UINT8},
		     {"short", INT16},	 {"int16", INT16},     {"ushort", UINT16},  {"uint16", UINT16},
		     {"int", INT32},	 {"int32", INT32},     {"uint", UINT32},    {"uint32", UINT32},
		     {"float", FLOAT32}, {"float32", FLOAT32}, {"double", FLOAT64}, {"float64", FLOAT64}};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (strcmp(names[i].name, name) == 0)
			return names[i].type;
	return SCALAR_NONE;
}

static enum property_role find_role(enum element_kind kind, const char *name, bool is_list)
{
	static const struct {
		const char *name;
		enum property_role role;
	} names[] = {{"x", ROLE_X},   {"y", ROLE_Y},   {"z", ROLE_Z},	      {"nx", ROLE_NX},
		     {"ny", ROLE_NY}, {"nz", ROLE_NZ}, {"u", ROLE_U},	      {"v", ROLE_V},
		     {"s", ROLE_U},   {"t", ROLE_V},   {"texture_u", ROLE_U}, {"texture_v", ROLE_V}};
	if (kind == ELEMENT_FACE && is_list &&
	    (strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0))
		return ROLE_INDICES;
	for (size_t i = 0; kind == ELEMENT_VERTEX && !is_list && i < sizeof names / sizeof *names; i++)
		if (strcmp(names[i].name, name) == 0)
			return names[i].role;
	return ROLE_NONE;
}

static int header_error(const struct ply *f, const char *what)
{
	return node_error(f->node, f->error, EINVAL, "%s:%d: %s", f->name, f->line, what);
}

static int read_format(struct ply *f)
{
	char word[WORD_MAX];
	next_word(f, word);
	if (strcmp(word, "ascii") == 0)
		f->format = FORMAT_ASCII;
	else if (strcmp(word, "binary_little_endian") == 0)
		f->format = FORMAT_LITTLE_ENDIAN;
	else if (strcmp(word, "binary_big_endian") == 0)
		f->format = FORMAT_BIG_ENDIAN;
	else
		return header_error(f, "the format is neither ascii nor binary_little_endian nor binary_big_endian");
	return 0;
}

static int read_element(struct ply *f)
{
	char name[WORD_MAX], count[WORD_MAX];
	int64_t n = -1;
	if (f->element_count == ELEMENTS_MAX)
		return header_error(f, "more than 16 elements");
	if (!next_word(f, name) || !next_word(f, count) || !number_parse_int(count, &n) || n < 0)
		return header_error(f, "an element needs a name and a count");
	struct ply_element *el = &f->elements[f->element_count++];
	*el = (struct ply_element){.count = (uint64_t)n};
	memcpy(el->name, name, sizeof name);
	el->kind = strcmp(name, "vertex") == 0 ? ELEMENT_VERTEX
		   : strcmp(name, "face") == 0 ? ELEMENT_FACE
					       : ELEMENT_OTHER;
	el->groups = attribute_groups_make(el->kind == ELEMENT_FACE ? "face_" : "vertex_");
	for (uint32_t i = 0; i + 1 < f->element_count; i++)
		if (strcmp(f->elements[i].name, name) == 0)
			return header_error(f, "an element is given twice");
	return 0;
}

static int read_property(struct ply *f)
{
	char word[WORD_MAX], name[WORD_MAX];
	if (f->element_count == 0)
		return header_error(f, "a property before any element");
	struct ply_element *el = &f->elements[f->element_count - 1];
	if (el->property_count == PROPERTIES_MAX)
		return header_error(f, "an element with more than 64 properties");
	struct ply_property p = {0};
	next_word(f, word);
	bool is_list = strcmp(word, "list") == 0;
	if (is_list) {
		next_word(f, word);
		p.count_type = find_scalar(word);
		next_word(f, word);
	}
	p.type = find_scalar(word);
	if (p.type == SCALAR_NONE || (is_list && (p.count_type == SCALAR_NONE || p.count_type >= FLOAT32)))
		return header_error(f, "a property of an unknown type");
	if (!next_word(f, name))
		return header_error(f, "a property without a name");
	p.role = find_role(el->kind, name, is_list);
	if (p.role == ROLE_INDICES && p.type >= FLOAT32)
		return header_error(f, "indices must be whole numbers");
	for (uint32_t i = 0; i < el->property_count && p.role != ROLE_NONE; i++)
		if (el->properties[i].role == p.role)
			p.role = ROLE_NONE; /* u and s may both be present: the first one counts */
	if (p.role >= 0 && p.role < ROLES)
		f->has_role[p.role] = true;
	if (p.role == ROLE_NONE && !is_list && el->kind != ELEMENT_OTHER)
		p.is_in_attribute = attribute_groups_add(&el->groups, name, &p.group, &p.channel);
	if (p.is_in_attribute)
		el->is_integer[p.group] = p.type < FLOAT32;
	el->properties[el->property_count++] = p;
	return 0;
}

static int read_header(struct ply *f)
{
	char word[WORD_MAX];
	bool has_format = false;
	f->line = 1;
	f->newline = '\n';
	if (!next_word(f, word) || strcmp(word, "ply") != 0)
		return header_error(f, "this is not a PLY file");
	if (f->end - f->p >= 2 && f->p[0] == '\r' && f->p[1] != '\n')
		f->newline = '\r';
	for (;;) {
		skip_line(f);
		if (f->p >= f->end)
			return header_error(f, "the header does not end");
		int r = 0;
		if (!next_word(f, word) || strcmp(word, "comment") == 0 || strcmp(word, "obj_info") == 0)
			continue;
		if (strcmp(word, "format") == 0) {
			r = read_format(f);
			has_format = true;
		} else if (strcmp(word, "element") == 0) {
			r = read_element(f);
		} else if (strcmp(word, "property") == 0) {
			r = read_property(f);
		} else if (strcmp(word, "end_header") == 0) {
			skip_line(f);
			return has_format ? 0 : header_error(f, "the header names no format");
		} else {
			return header_error(f, "neither comment, format, element, property nor end_header");
		}
		if (r)
			return r;
	}
}

static double decode_scalar(const char *data, enum scalar type, bool big_endian)
{
	uint64_t bits = 0;
	uint32_t size = scalar_size[type], low;
	for (uint32_t i = 0; i < size; i++)
		bits |= (uint64_t)(unsigned char)data[big_endian ? size - 1 - i : i] << 8 * i;
	float f;
	double d;
	switch (type) {
	case INT8:
		return (int8_t)bits;
	case INT16:
		return (int16_t)bits;
	case INT32:
		return (int32_t)bits;
	case FLOAT32:
		low = (uint32_t)bits;
		memcpy(&f, &low, sizeof f);
		return (double)f;
	case FLOAT64:
		memcpy(&d, &bits, sizeof d);
		return d;
	default:
		return (double)bits;
	}
}

/* Reads the next number. Returns false if there is none. */
static bool next_number(struct ply *f, enum scalar type, double *x)
{
	if (f->format != FORMAT_ASCII) {
		if ((size_t)(f->end - f->p) < scalar_size[type])
			return false;
		*x = decode_scalar(f->p, type, f->format == FORMAT_BIG_ENDIAN);
		f->p += scalar_size[type];
		return true;
	}
	while (f->p < f->end && number_is_blank(*f->p))
		f->p++;
	const char *rest = (type < FLOAT32 ? number_scan : number_scan_printed)(f->p, f->end, x);
	if (!rest || (rest < f->end && !number_is_blank(*rest)))
		return false;
	f->p = rest;
	return true;
}

static int item_error(const struct ply *f, const struct ply_element *el, uint64_t i, const char *what)
{
	return node_error(f->node, f->error, EINVAL, "%s: %s %llu: %s", f->name, el->name, (unsigned long long)i, what);
}

/* Replaces the fan that begins with triangle `first` by the triangles of the polygon. Polygons of more than
 * POLYGON_CORNERS_MAX corners stay fans. */
static void triangulate_face(struct mesh *m, uint32_t first, uint32_t n)
{
	uint32_t index[POLYGON_CORNERS_MAX];
	struct polygon p;
	for (p.corner_count = 0; p.corner_count < n; p.corner_count++) {
		index[p.corner_count] =
			p.corner_count < 2 ? m->index[first][p.corner_count] : m->index[first + p.corner_count - 2][2];
		p.corner[p.corner_count] = vec3_load(m->position[index[p.corner_count]]);
	}
	polygon_triangulate(&p, m->index + first);
	for (uint32_t i = 0; i < n - 2; i++)
		for (int k = 0; k < 3; k++)
			m->index[first + i][k] = index[m->index[first + i][k]];
}

static int read_list(struct ply *f, const struct ply_element *el, uint64_t item, const struct ply_property *p,
		     uint32_t first_triangle)
{
	double n, corner[3] = {0, 0, 0};
	if (!next_number(f, p->count_type, &n) || !(n >= 0) || n != floor(n))
		return item_error(f, el, item, "a list without a length, or the file ends here");
	if (p->role == ROLE_INDICES && n < 1)
		return item_error(f, el, item, "a face without corners");
	for (double k = 0; k < n; k++) {
		double x;
		if (!next_number(f, p->type, &x))
			return item_error(f, el, item, "not a number, or the file ends here");
		if (p->role != ROLE_INDICES)
			continue;
		if (!(x >= 0 && x < (double)f->mesh->vertex_count) || x != floor(x))
			return item_error(f, el, item, "an index out of range");
		corner[k < 2 ? (int)k : 2] = x;
		if (k < 2 && k < n - 1)
			continue;
		/* Exporters write points and lines as faces of one or two corners: they become triangles without
		 * area. */
		for (int i = (int)k + 1; i < 3; i++)
			corner[i] = x;
		if (f->mesh->index)
			for (int i = 0; i < 3; i++)
				f->mesh->index[first_triangle][i] = (uint32_t)corner[i];
		first_triangle++;
		corner[1] = x;
	}
	if (p->role == ROLE_INDICES) {
		if (n > 3 && n <= POLYGON_CORNERS_MAX && f->mesh->index)
			triangulate_face(f->mesh, first_triangle - (uint32_t)(n - 2), (uint32_t)n);
		f->triangle_count += n < 3 ? 1 : (uint64_t)n - 2;
		if (f->triangle_count > MESH_TRIANGLES_MAX)
			return item_error(f, el, item, "more triangles than 2^27");
	}
	return 0;
}

static int store_vertex(struct ply *f, const struct ply_element *el, uint64_t i, const double role_values[ROLES])
{
	struct mesh *m = f->mesh;
	for (int k = 0; k < ROLES; k++)
		if (!(fabs(role_values[k]) <= MESH_COORDINATE_MAX) && k != ROLE_NX && k != ROLE_NY && k != ROLE_NZ)
			return item_error(f, el, i, "a number that is not finite, or beyond 1e60");
	memcpy(m->position[i], role_values, sizeof m->position[i]);
	if (m->normal)
		mesh_set_normal(m, (uint32_t)i,
				(vec3){role_values[ROLE_NX], role_values[ROLE_NY], role_values[ROLE_NZ]});
	if (m->uv) {
		m->uv[i][0] = role_values[ROLE_U];
		m->uv[i][1] = f->flips_v ? 1 - role_values[ROLE_V] : role_values[ROLE_V];
	}
	return 0;
}

/* Returns the value of a number of an attribute: integers stand for 0 to 1. */
static double attribute_value(const struct ply *f, enum scalar type, double x)
{
	static const double max_value[] = {[INT8] = 0x7f,     [UINT8] = 0xff,	    [INT16] = 0x7fff,
					   [UINT16] = 0xffff, [INT32] = 0x7fffffff, [UINT32] = 0xffffffff};
	bool is_integer = type < FLOAT32, is_encoded = f->is_srgb ? *f->is_srgb : is_integer;
	x = is_integer ? x / max_value[type] : x;
	/* Numbers out of range are not decoded, since their powers may overflow; they stay out of range. */
	return is_encoded && fabs(x) <= MESH_ATTRIBUTE_MAX ? srgb_to_linear(x) : x;
}

/* Stores the attributes of item i; the triangles of a face begin with `first`. */
static void store_attributes(const struct ply *f, const struct ply_element *el, uint64_t i, uint64_t first,
			     const double attribute_values[PROPERTIES_MAX])
{
	uint64_t begin = el->kind == ELEMENT_FACE ? first : i,
		 end = el->kind == ELEMENT_FACE ? f->triangle_count : i + 1;
	for (uint32_t k = 0; k < el->property_count; k++) {
		const struct ply_property *p = &el->properties[k];
		struct attribute *a = p->is_in_attribute ? el->attributes[p->group] : NULL;
		if (!a || p->channel >= a->channels)
			continue;
		double value = attribute_value(f, p->type, attribute_values[k]);
		for (uint64_t item = begin; item < end; item++)
			mesh_set_attribute(a, (size_t)item, p->channel, value);
	}
}

static int read_item(struct ply *f, const struct ply_element *el, uint64_t i)
{
	double role_values[ROLES] = {0}, attribute_values[PROPERTIES_MAX];
	uint64_t first = f->triangle_count;
	for (uint32_t k = 0; k < el->property_count; k++) {
		const struct ply_property *p = &el->properties[k];
		int r = 0;
		double x;
		if (p->count_type != SCALAR_NONE)
			r = read_list(f, el, i, p, (uint32_t)f->triangle_count);
		else if (!next_number(f, p->type, &x))
			r = item_error(f, el, i, "not a number, or the file ends here");
		else if (p->role >= 0)
			role_values[p->role] = x;
		else
			attribute_values[k] = x;
		if (r)
			return r;
	}
	if (el->groups.count > 0 && f->mesh->position)
		store_attributes(f, el, i, first, attribute_values);
	return el->kind == ELEMENT_VERTEX && f->mesh->position ? store_vertex(f, el, i, role_values) : 0;
}

/* Returns the minimum size of an item in bytes; in ascii, a number takes at least one. */
static uint64_t min_item_bytes(const struct ply *f, const struct ply_element *el)
{
	uint64_t n = 0;
	for (uint32_t k = 0; k < el->property_count; k++) {
		const struct ply_property *p = &el->properties[k];
		n += f->format == FORMAT_ASCII ? 1
					       : scalar_size[p->count_type != SCALAR_NONE ? p->count_type : p->type];
	}
	return n;
}

/* Reads everything after the header: at first without arrays, to count triangles and check the data, then with them. */
static int read_body(struct ply *f)
{
	f->triangle_count = 0;
	for (uint32_t k = 0; k < f->element_count; k++) {
		const struct ply_element *el = &f->elements[k];
		uint64_t min_bytes = min_item_bytes(f, el);
		if (min_bytes == 0)
			continue;
		if (el->count > (uint64_t)(f->end - f->p) / min_bytes)
			return node_error(f->node, f->error, EINVAL, "%s: too short for %llu of element `%s`", f->name,
					  (unsigned long long)el->count, el->name);
		for (uint64_t i = 0; i < el->count; i++) {
			if (i % TICK_INTERVAL == 0)
				liveness_tick();
			int r = read_item(f, el, i);
			if (r)
				return r;
		}
	}
	return 0;
}

static int check_header(struct ply *f)
{
	uint64_t vertices = 0;
	bool has_faces = false, has_other_elements = false; /* for instance strips of triangles */
	for (uint32_t i = 0; i < f->element_count; i++) {
		const struct ply_element *el = &f->elements[i];
		if (el->kind == ELEMENT_VERTEX)
			vertices = el->count;
		else
			has_other_elements |= el->count > 0;
		for (uint32_t k = 0; k < el->property_count; k++)
			has_faces |= el->properties[k].role == ROLE_INDICES && el->count > 0;
	}
	if ((vertices == 0 && has_other_elements) || !f->has_role[ROLE_X] || !f->has_role[ROLE_Y] ||
	    !f->has_role[ROLE_Z])
		return node_error(f->node, f->error, EINVAL, "%s: has no vertices with x, y and z", f->name);
	if (!has_faces && has_other_elements)
		return node_error(f->node, f->error, EINVAL, "%s: has no faces with vertex_indices", f->name);
	if (vertices >= UINT32_MAX || vertices > (uint64_t)(f->end - f->p))
		return node_error(f->node, f->error, EINVAL, "%s: too short for %llu vertices", f->name,
				  (unsigned long long)vertices);
	f->mesh->vertex_count = (uint32_t)vertices;
	return 0;
}

/* Allocates the attributes of an element, after checking their size against that of the file. */
static int add_attributes(struct ply *f, struct ply_element *el, uint64_t bytes, struct arena *arena)
{
	uint64_t items = el->kind == ELEMENT_FACE ? f->triangle_count : f->mesh->vertex_count, values = 0;
	for (uint32_t k = 0; k < el->groups.count; k++)
		values += items * attribute_group_channel_count(&el->groups.groups[k]);
	if (values > ATTRIBUTE_VALUES_MIN_LIMIT && values / ATTRIBUTE_VALUES_PER_BYTE > bytes)
		return node_error(f->node, f->error, E2BIG, "%s: its polygons would make %llu numbers of attributes",
				  f->name, (unsigned long long)values);
	for (uint32_t k = 0; k < el->groups.count; k++) {
		uint32_t channels = attribute_group_channel_count(&el->groups.groups[k]);
		if (channels == 0)
			continue;
		struct attribute *a = mesh_add_attribute(f->mesh, el->groups.groups[k].name, el->kind == ELEMENT_FACE,
							 channels, 2 * ATTRIBUTE_GROUPS_MAX, arena);
		if (!a)
			return node_error(f->node, f->error, ENOMEM, "%s: out of memory", f->name);
		a->is_srgb = !f->is_srgb && !el->is_integer[k];
		el->attributes[k] = a;
	}
	return 0;
}

static bool faces_come_first(const struct ply *f)
{
	for (uint32_t i = 0; i < f->element_count; i++)
		if (f->elements[i].kind != ELEMENT_OTHER)
			return f->elements[i].kind == ELEMENT_FACE;
	return false;
}

static int read_file(struct ply *f, struct arena *arena)
{
	int r = read_header(f);
	if (!r)
		r = check_header(f);
	const char *body = f->p;
	if (!r)
		r = read_body(f);
	if (r)
		return r;
	bool normals = f->has_role[ROLE_NX] && f->has_role[ROLE_NY] && f->has_role[ROLE_NZ],
	     uv = f->has_role[ROLE_U] && f->has_role[ROLE_V];
	if (!mesh_alloc(f->mesh, f->mesh->vertex_count, (uint32_t)f->triangle_count, normals, uv, arena))
		return node_error(f->node, f->error, ENOMEM, "%s: out of memory", f->name);
	for (uint32_t k = 0; k < f->element_count && !r; k++)
		if (f->elements[k].kind != ELEMENT_OTHER)
			r = add_attributes(f, &f->elements[k], (uint64_t)(f->end - body), arena);
	for (int pass = 0; pass < (faces_come_first(f) ? 2 : 1) && !r; pass++) {
		f->p = body;
		r = read_body(f);
	}
	return r;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct asset a;
	int r = mesh_open_file(n, assets, &a, e);
	if (r)
		return r;
	const char *bytes = (const char *)a.bytes;
	bool srgb = node_bool(n, "srgb", true);
	struct ply f = {.node = n,
			.name = node_string(n, "filename", ""),
			.error = e,
			.p = bytes,
			.end = bytes + a.size,
			.mesh = &out->mesh,
			.flips_v = node_bool(n, "flip_tex_coords", false),
			.is_srgb = node_find_property(n, "srgb") ? &srgb : NULL};
	r = read_file(&f, arena);
	assets->close(assets->user, &a);
	return r;
}

SHAPE_OPS(ply, {"filename", UNDERSTOOD(VALUE_STRING)}, {"face_normals", UNDERSTOOD(VALUE_BOOL)},
	  {"flip_tex_coords", UNDERSTOOD(VALUE_BOOL)}, {"collapse", IGNORED},
	  {"srgb", UNDERSTOOD(VALUE_BOOL)}, /* whether colours are in sRGB */
	  MESH_SMOOTH_PARAM, SHAPE_PARAMS);
