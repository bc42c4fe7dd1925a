/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bidirectional scattering. One file per plug-in and one line in bsdf_list.h; the generic tests pick it up.
 *
 * Directions are unit vectors in the local shading frame (z = shading normal), both pointing AWAY from the surface.
 * When sampling, wo points to the previous vertex of the path and wi to the next; eval and pdf take any pair.
 * `eval` is f (1/sr), without a cosine; delta lobes contribute nothing to eval and pdf.
 * Transport: radiance travelling along wi -> wo is scaled by (n_wo/n_wi)^2 when refracted (n_x: index on the side of
 * x; Walter 2007 eq. 21 with Veach 1997 sec. 5.2), importance is not: this factor is
 * f_radiance(wo,wi) / f_importance(wo,wi). For a BSDF that is not reciprocal (is_nonreciprocal), importance is still
 * radiance with the directions exchanged: f_importance(wo,wi) = f_radiance(wi,wo).
 * Measure of densities: solid angle; for delta lobes the probability of choosing the lobe.
 * Immutable after creation; any thread; nothing here allocates after create.
 */
#ifndef WORKER_RENDER_BSDF_BSDF_H
#define WORKER_RENDER_BSDF_BSDF_H

#include "worker/render/math/relief.h"
#include "worker/render/texture/texture.h"

enum bsdf_mode {
	BSDF_REFLECT = 1,
	BSDF_TRANSMIT = 2,
	BSDF_DELTA = 4,	   /* combined with one of the two above */
	BSDF_STRAIGHT = 8, /* combined with TRANSMIT and DELTA: not refracted, whatever the surface's index */
};

/* Which quantity a sub-path carries while it is traced: a camera sub-path traces importance backwards and thus
 * gathers radiance; its BSDF values are those of TRANSPORT_RADIANCE. */
enum transport { TRANSPORT_RADIANCE, TRANSPORT_IMPORTANCE };

struct bsdf_point {
	struct texture_point texture_point;
	const struct wavelengths *wavelengths;
	enum transport transport;
	bool culls_backfaces; /* rays that hit the surface from below its normal ignore it: see struct bsdf */
	struct relief_frames relief_frames; /* the shading frames of single parts: tilted.h, bumpmap.c */
};

struct bsdf_sample {
	vec3 wi;
	unsigned mode; /* bits of enum bsdf_mode */
	double pdf;    /* solid angle of all non-delta lobes together, or the probability of the delta lobe */
	spectrum f; /* eval(wo, wi), or for a delta lobe its weight over |wi.z|, so that the weight of the sample is f
		       |wi.z| / pdf in both cases */
	double eta; /* index on wi's side over the one on wo's side; 1 when reflected */
};

struct bsdf;
struct ior;
struct boundary_table;
struct relief_map;

struct bsdf_build {
	const struct asset_source *assets;
	struct arena *arena;
	bool is_dialect_3;
	double min_roughness;		    /* metal and glass with a roughness below this one are created as smooth */
	struct attribute_table *attributes; /* of the mesh that has this BSDF; NULL: none */
	bool has_black_backs;		    /* opaque materials without `twosided` reflect nothing on their back */
	/* List of the tables that the scene's materials share; NULL: no sharing. */
	struct boundary_table **boundary_tables;
	struct relief_map **relief_maps;    /* likewise, the bump and normal maps of one material */
	const struct relief *base_relief;   /* of the bump or normal map around this BSDF; NULL: none */
	const struct volume_build *volumes; /* NULL: none */
};

static inline struct texture_build bsdf_texture_build(const struct bsdf_build *b)
{
	return (struct texture_build){b->assets, b->arena, b->is_dialect_3, b->attributes, b->volumes, false};
}

struct bsdf_ops {
	struct plugin_decl decl;
	size_t data_size; /* bytes of b->data, which is zeroed before `create` is called; 0: none */
	int (*create)(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e);
	spectrum (*eval)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	double (*pdf_solid)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	/* f |wi.z| |d wi / d h_par| with factors that diverge and vanish together cancelled analytically; see
	 * bsdf_eval_halfvec. NULL: nothing cancels, and the plain product is used. */
	spectrum (*eval_halfvec)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	/* See bsdf_eval_delta. NULL: the BSDF has no specular lobe. */
	spectrum (*eval_delta)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			       double *probability);
	/* u[0], u[1]: direction; u[2]: lobe. Returns false if the light is absorbed. */
	bool (*sample)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		       struct bsdf_sample *out);
};

struct bsdf {
	const struct bsdf_ops *ops;
	unsigned modes;	 /* union of the modes of all lobes: DELTA does not say which of the other modes is specular */
	bool has_smooth; /* some lobe is not a delta lobe: eval is not identically 0 */
	bool has_delta;
	double min_alpha;  /* smallest roughness of its non-delta lobes; INFINITY for diffuse only; 0 for delta only */
	double mean_alpha; /* albedo-weighted mean roughness of its non-delta lobes, diffuse counting 1; 0 for delta
			      only */
	double eta; /* index below the surface (against the normal) over the one above, at 587.6 nm where it depends on
		       the wavelength; 1: opaque, or not known. Lobes with BSDF_STRAIGHT ignore it */
	bool is_straight_transmitter; /* every lobe that transmits has BSDF_STRAIGHT: eta has no meaning */
	bool is_dispersive;	/* the index depends on the wavelength: use bsdf_eta; paths carry one wavelength only */
	const struct ior *ior;	/* laws of dispersion of both sides, by enum ior_side; NULL: only eta is known */
	bool is_two_sided;	/* scatters light that arrives from below the normal */
	bool has_mirrored_back; /* is_two_sided only since bsdf_mirror_back (twosided.h) made some part of it so */
	bool is_textured;
	bool is_nonreciprocal;	     /* paths from a light choose specular lobes with other probabilities than
				paths from the camera */
	bool culls_backfaces;	     /* light that has entered a curve with this BSDF leaves it without a vertex: struct
					geom_shape.culls_backfaces */
	bool uses_relief_frames;     /* some part has a shading frame of its own, and needs bsdf_point.relief_frames */
	bool is_see_through;	     /* a `mask` or `null`: objects behind the surface show through */
	bool uses_tangents;	     /* anisotropic, or has a normal map: depends on the tangents of the frame */
	bool is_black;		     /* neither reflects nor transmits */
	enum color_kind color_kind;  /* COLOR_KIND_CONSTANT: the BSDF has no colour */
	const struct relief *relief; /* bump or normal map that bends the shading normals; NULL: none */
	void *data;
};

/* Returns whether connections may look through surfaces with b (path/transparent.h). They do not look through hair,
 * which culls back faces. */
static inline bool bsdf_passes_connections(const struct bsdf *b)
{
	return (b->modes & BSDF_STRAIGHT) && !b->culls_backfaces;
}

/* Returns whether connections to emitters may be refracted by b (path/refracted.h). Surfaces that connections look
 * through are excluded, so that there is one connection from each point of an emitter. */
static inline bool bsdf_refracts_connections(const struct bsdf *b)
{
	return b->has_delta && (b->modes & BSDF_TRANSMIT) && !(b->modes & BSDF_STRAIGHT) && !b->culls_backfaces;
}

/* Returns the index below the surface over the one above, at the hero wavelength nm[0] if b is dispersive. */
double bsdf_eta(const struct bsdf *b, const struct wavelengths *w);

/* Returns, for non-delta lobes, wo towards the camera and wi towards the light, f_radiance(wo, wi) |wi.z| times the
 * solid angle of directions wi per area of plane-plane half vectors h_par = h_xy / h_z, with h along wo + eta wi and
 * eta = n_wi / n_wo (1 when reflected). wo is held fixed, since chains are followed from the camera. For microfacets
 * the product is W G2 P22(h) |wo.h| / (|wo.z| |h.z|), W = F or (1-F) (n_wo/n_wi)^2, P22 the density of slopes; for
 * others f |wi.z| |h.z|^3 4 |wi.h| where reflected and f |wi.z| |h.z|^3 (wo.h + eta wi.h)^2 / (eta^2 |wi.h|) where
 * refracted. If light is transmitted between equal indices, the half vector is (wo + wi)_xy and the product is f. */
spectrum bsdf_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);

/* Evaluates the exactly specular lobe `mode` (REFLECT, TRANSMIT or TRANSMIT | STRAIGHT, with or without the DELTA bit)
 * for wo: its direction wi, and the probability `probability` with which `sample` chooses it. Returns its weight f
 * |wi.z| (f as in struct bsdf_sample), or zero if there is no such lobe or light is totally reflected; wi and chance
 * are then undefined. */
spectrum bsdf_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			 double *probability);

/* Creates b from n, with b->data in build->arena. Returns 0, or a negative error code with a sentence in e: -ENOTSUP if
 * the type of n is not known, or the code of the plug-in. */
int bsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e);
/* Like bsdf_create, but with the given operations, whatever the type of n is. */
int bsdf_create_as(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n,
		   const struct bsdf_build *build, struct error *e);
/* `eval` and `pdf_solid` of a BSDF that has specular lobes only: zero. */
spectrum bsdf_eval_zero(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
double bsdf_pdf_zero(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
void bsdf_make_black(struct bsdf *b); /* absorbs everything: for emitters without a BSDF */

extern const struct bsdf_ops *const bsdf_registry[]; /* ends with NULL */

#endif
