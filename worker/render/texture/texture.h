/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Textures: a colour or a height that may depend on (u,v). One file per plug-in and one line in texture_list.h.
 * Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_TEXTURE_TEXTURE_H
#define WORKER_RENDER_TEXTURE_TEXTURE_H

#include "worker/render/texture/color.h"
#include "worker/render/image/image.h"

struct texture;
struct attribute_table;
struct volume_build;

/* The point of a surface at which a texture is evaluated. */
struct texture_point {
	double u, v;   /* texture coordinates */
	double b1, b2; /* barycentric coordinates on the triangle `prim`; 0 on a sphere or without a surface */
	uint32_t prim;
	bool is_probe; /* probes a material without a surface: p is not known */
	vec3 p;	       /* position in the world */
};

/* Interpolates channel k of values at the vertices of a mesh linearly. value: `channels` numbers per vertex; index: the
 * mesh's. */
static inline double texture_interpolate(const float *value, size_t channels, const uint32_t (*index)[3],
					 const struct texture_point *point, size_t k)
{
	const uint32_t *i = index[point->prim];
	double b0 = 1 - point->b1 - point->b2;
	return b0 * (double)value[i[0] * channels + k] + point->b1 * (double)value[i[1] * channels + k] +
	       point->b2 * (double)value[i[2] * channels + k];
}

/* What texture_create needs besides the node. */
struct texture_build {
	const struct asset_source *assets;
	struct arena *arena;
	bool is_dialect_3;
	struct attribute_table *attributes; /* of the mesh (attribute_table.h); NULL: no mesh */
	const struct volume_build *volumes; /* NULL: the texture is not on a surface in the world */
	/* The texture stands for a number such as a roughness or a weight, not for a spectrum. For coloured images,
	 * Mitsuba 3 then takes the luminance and 0.6 the mean, for colours both take the mean; Mitsuba 3 also exchanges
	 * the colours of a checkerboard. */
	bool is_number;
};

/* Three numbers as a function of (u,v), with their first and second derivatives. */
struct texture_derivatives {
	double x[3], du[3], dv[3], duu[3], duv[3], dvv[3];
	bool is_grey; /* all three numbers are equal */
};

struct texture_ops {
	struct plugin_decl decl;
	size_t data_size; /* bytes of t->data, which is zeroed before `create` is called */
	int (*create)(struct texture *t, const struct scene_node *n, enum color_role role,
		      const struct texture_build *build, struct error *e);
	spectrum (*eval)(const struct texture *t, const struct texture_point *point, const struct wavelengths *w);
	double (*height)(const struct texture *t, double u, double v); /* for COLOR_HEIGHT */
	void (*eval_derivatives)(const struct texture *t, double u, double v,
				 struct texture_derivatives *j); /* for COLOR_RELIEF */
	double (*max)(const struct texture *t);			 /* upper bound over (u,v) and wavelengths */
	enum color_kind (*color_kind)(const struct texture *t);
	double (*aspect)(const struct texture *t); /* width over height of the image; NULL: 1 */
};

struct texture {
	const struct texture_ops *ops; /* NULL: a constant, `color` or `relief` below */
	struct color color;
	double relief[3]; /* in role COLOR_RELIEF; `color` is their luminance */
	void *data;
};

/* Reads the property `name` of node n: a colour or a nested texture, `fallback` if absent. Returns 0 or a negative
 * error code. */
int texture_from_node(struct texture *t, const struct scene_node *n, const char *name, double fallback,
		      enum color_role role, const struct texture_build *build, struct error *e);

/* Creates the texture that node n is. Returns 0 or a negative error code; -ENOTSUP if its type is not known. */
int texture_create(struct texture *t, const struct scene_node *n, enum color_role role,
		   const struct texture_build *build, struct error *e);

static inline spectrum texture_eval(const struct texture *t, const struct texture_point *point,
				    const struct wavelengths *w)
{
	return t->ops ? t->ops->eval(t, point, w) : color_eval(&t->color, w);
}

static inline double texture_height(const struct texture *t, double u, double v)
{
	return t->ops ? t->ops->height(t, u, v) : t->color.scale;
}

static inline void texture_eval_derivatives(const struct texture *t, double u, double v, struct texture_derivatives *j)
{
	if (t->ops)
		t->ops->eval_derivatives(t, u, v, j);
	else
		*j = (struct texture_derivatives){.x = {t->relief[0], t->relief[1], t->relief[2]}};
}

double texture_aspect(const struct texture *t);
double texture_max(const struct texture *t);
enum color_kind texture_color_kind(const struct texture *t);
static inline bool texture_is_constant(const struct texture *t)
{
	return !t->ops;
}

extern const struct texture_ops *const texture_registry[]; /* ends with NULL */

#endif
