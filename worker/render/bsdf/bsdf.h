/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bidirectional scattering. One file per plug-in and one line in bsdf_list.h; the generic tests pick it up.
 *
 * Directions are unit vectors in the local shading frame (z = shading normal), both pointing AWAY from the surface.
 * wo is where the path came from when sampling, wi where it goes; eval and pdf take any pair.
 * `eval` is f (1/sr), without a cosine; delta lobes contribute nothing to eval and pdf.
 * Transport: radiance travelling along wi -> wo is scaled by (n_wo/n_wi)^2 when refracted (n_x: index on the side of
 * x; Walter 2007 eq. 21 with Veach 1997 sec. 5.2), importance is not: f_radiance(wo,wi) / f_importance(wo,wi) is that.
 * Where a BSDF is not reciprocal (struct bsdf.directed), importance is radiance the other way round all the same:
 * f_importance(wo,wi) = f_radiance(wi,wo).
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
	BSDF_STRAIGHT = 8, /* combined with TRANSMIT and DELTA: not bent, whatever the surface's index */
};

/* Which quantity a sub-path carries while it is traced: a camera sub-path traces importance backwards and thus
 * gathers radiance; its BSDF values are those of TRANSPORT_RADIANCE. */
enum transport { TRANSPORT_RADIANCE, TRANSPORT_IMPORTANCE };

struct bsdf_point {
	struct texture_point where;
	const struct wavelengths *w;
	enum transport transport;
	bool culled;		   /* no ray meets the surface from below its normal: struct bsdf.culls */
	struct relief_place place; /* for parts that look at other shading frames: tilted.h, bumpmap.c */
};

struct bsdf_sample {
	vec3 wi;
	unsigned mode; /* of enum bsdf_mode */
	double pdf;    /* solid angle of all non-delta lobes together, or the probability of the delta lobe */
	spectrum f;    /* eval(wo, wi), or for a delta lobe f such that f / pdf is the weight of the path:
			  the cosine |wi.z| is already divided out: weight = f |wi.z| / pdf in both cases */
	double eta;    /* index on wi's side over the one on wo's side; 1 when reflected */
};

struct bsdf;
struct ior;
struct boundary_table;
struct bend;

struct bsdf_build {
	const struct asset_source *assets;
	struct arena *arena;
	bool dialect_3;
	double least_roughness;		    /* rough metal and glass below this roughness is made smooth */
	struct attribute_table *attributes; /* of the mesh; NULL: none */
	bool black_backs;		    /* of opaque materials without twosided */
	struct boundary_table **boundaries; /* tables that materials of the scene share; NULL: each has its own */
	struct bend **bends;		    /* likewise bump and normal maps of one material */
	const struct volume_build *volumes; /* NULL: none */
};

static inline struct texture_build bsdf_texture_build(const struct bsdf_build *b)
{
	return (struct texture_build){b->assets, b->arena, b->dialect_3, b->attributes, b->volumes, false};
}

struct bsdf_ops {
	struct plugin_decl decl;
	size_t data_size; /* of b->data, which is zeroed memory before `create`; 0: it has none */
	int (*create)(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e);
	spectrum (*eval)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	double (*pdf_solid)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	/* f |wi.z| |d wi / d h_par| with factors that diverge and vanish together cancelled analytically; see
	 * bsdf_eval_halfvec. NULL: nothing cancels, and the plain product is used. */
	spectrum (*eval_halfvec)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
	/* See bsdf_eval_delta. NULL: it has no specular lobe. */
	spectrum (*eval_delta)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			       double *chance);
	/* u[0], u[1]: direction; u[2]: lobe. false: absorbed. */
	bool (*sample)(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		       struct bsdf_sample *out);
};

struct bsdf {
	const struct bsdf_ops *ops;
	unsigned modes;	 /* union of all modes it can have (with both REFLECT|DELTA and REFLECT, both bits are set) */
	bool has_smooth; /* some lobe is not specular: eval is not identically 0 */
	bool has_delta;
	double alpha;	    /* smallest roughness of its non-delta lobes; INFINITY for diffuse only; 0 for delta only */
	double alpha_mean;  /* albedo-weighted mean roughness of its non-delta lobes, diffuse counting 1; 0 for delta
			       only */
	double eta;	    /* index below the surface (against the normal) over the one above, at 587.6 nm where it
			       depends on the wavelength; 1: opaque or none. Lobes with BSDF_STRAIGHT ignore it */
	bool only_straight; /* no lobe transmits but those with BSDF_STRAIGHT: eta means nothing */
	bool dispersive; /* the index depends on the wavelength: only bsdf_eta says it, and paths carry one wavelength
			  */
	const struct ior *ior; /* for both sides (enum ior_side); NULL: only eta is known */
	bool two_sided;	       /* scatters light that arrives from below the normal */
	bool textured;
	bool directed;		/* not reciprocal, and specular lobes are chosen with other probabilities by
				   paths from a light than by those from the camera */
	bool culls;		/* what goes through a curve of it leaves without a vertex: struct geom_shape.culled */
	bool uses_place;	/* some part looks at other shading frames of the surface: bsdf_point.place */
	bool passes;		/* a mask, or nothing at all: what lies behind shows through */
	bool uses_tangents;	/* differs along the two axes of the frame, or bends normals by a normal map */
	bool black;		/* neither reflects nor transmits */
	enum color_shape shape; /* CONSTANT: carries no colour */
	const struct relief *relief; /* bends the shading normals of the surface; NULL: none */
	void *data;
};

/* Whether connections may look through surfaces that have it (path/transparent.h). Not through hair, which culls. */
static inline bool bsdf_is_passed(const struct bsdf *b)
{
	return (b->modes & BSDF_STRAIGHT) && !b->culls;
}

/* Whether connections to emitters may be refracted by it (path/refracted.h). Not by what they look through: from one
 * point of an emitter there is one connection. */
static inline bool bsdf_refracts(const struct bsdf *b)
{
	return b->has_delta && (b->modes & BSDF_TRANSMIT) && !(b->modes & BSDF_STRAIGHT) && !b->culls;
}

/* Index below the surface over the one above, at the hero wavelength nm[0] where dispersive. */
double bsdf_eta(const struct bsdf *b, const struct wavelengths *w);

/* For non-delta lobes, wo towards the camera, wi towards the light: f_radiance(wo, wi) |wi.z| times the solid angle of
 * directions wi per area of plane-plane half vectors h_par = h_xy / h_z, h along wo + eta wi, eta = n_wi / n_wo (1 when
 * reflected), with wo held: the way a chain is followed from the camera. For microfacets this is
 * W G2 P22(h) |wo.h| / (|wo.z| |h.z|), W = F or (1-F) (n_wo/n_wi)^2, P22 the density of slopes; for others
 * f |wi.z| |h.z|^3 4 |wi.h| where reflected and f |wi.z| |h.z|^3 (wo.h + eta wi.h)^2 / (eta^2 |wi.h|) where refracted.
 * Where light passes between equal indices the half vector is (wo + wi)_xy, and this is f.
 */
spectrum bsdf_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);

/* The exactly specular lobe `mode` (REFLECT, TRANSMIT or TRANSMIT | STRAIGHT, with or without the DELTA bit) seen from
 * wo: its direction wi, the probability with which `sample` chooses it, and its weight f |wi.z| (f as in struct
 * bsdf_sample). Zero: there is none, or light is totally reflected; wi and chance are then not to be read. */
spectrum bsdf_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			 double *chance);

int bsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e);
/* The same with these operations, whatever the node's type is. */
int bsdf_create_as(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n,
		   const struct bsdf_build *build, struct error *e);
/* eval and pdf_solid without lobes that are not specular: zero. */
spectrum bsdf_no_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
double bsdf_no_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
void bsdf_black(struct bsdf *b); /* absorbs everything: for emitters without a BSDF */

extern const struct bsdf_ops *const bsdf_registry[]; /* ends with NULL */

#endif
