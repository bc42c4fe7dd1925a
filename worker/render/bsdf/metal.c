/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/metal.h"

#include "common/base/spelling.h"
#include "worker/render/bsdf/fresnel.h"

#include <string.h>
#include <strings.h>

enum { METAL_ROWS = 95 };

static const struct {
	const char *name;
	double samples[METAL_ROWS][3]; /* nm, n, k */
} metals[] = {
#include "conductors.inc"
};

/* Mitsuba has two sources for some metals and calls the second NAME_palik; for Na, Ni and V it has only that one. The
 * table here has one entry per metal, which either name selects. */
static bool is_named(const char *name, const char *metal)
{
	size_t n = strlen(metal);
	return strncmp(name, metal, n) == 0 && (name[n] == 0 || strcmp(name + n, "_palik") == 0);
}

/* Returns the chemical symbol of a metal given by its English name, for hints; NULL if the name is not known. */
static const char *chemical_symbol(const char *name)
{
	static const struct {
		const char *word, *symbol;
	} words[] = {
		{"aluminium", "Al"}, {"aluminum", "Al"}, {"beryllium", "Be"}, {"chrome", "Cr"},	 {"chromium", "Cr"},
		{"copper", "Cu"},    {"gold", "Au"},	 {"iridium", "Ir"},   {"lithium", "Li"}, {"mercury", "Hg"},
		{"mirror", "none"},  {"nickel", "Ni"},	 {"rhodium", "Rh"},   {"silver", "Ag"},	 {"tungsten", "W"},
		{"sodium", "Na"},    {"potassium", "K"}, {"vanadium", "V"},
	};
	for (size_t i = 0; i < sizeof words / sizeof *words; i++)
		if (strcasecmp(words[i].word, name) == 0)
			return words[i].symbol;
	return NULL;
}

static int refuse_name(const char *name, const struct scene_node *n, struct error *e)
{
	char hint[128], known[512] = "";
	struct spelling s = {.wanted_name = name};
	for (size_t i = 0; i < sizeof metals / sizeof *metals; i++) {
		spelling_offer(&s, metals[i].name);
		spelling_append_to_list(known, sizeof known, metals[i].name);
	}
	spelling_append_to_list(known, sizeof known, "none");
	s.best_match = chemical_symbol(name) ? chemical_symbol(name) : s.best_match;
	return node_error(n, e, ENOTSUP, "unknown conductor \"%.64s\"%s; eta and k are accepted, too (known: %s)", name,
			  spelling_hint(&s, hint, sizeof hint), known);
}

static int set_named_metal(struct metal *m, const char *name, const struct scene_node *n, struct arena *arena,
			   struct error *e)
{
	if (strcasecmp(name, "none") == 0) {
		m->eta.color = color_constant(0);
		m->k.color = color_constant(1);
		return 0;
	}
	for (size_t i = 0; i < sizeof metals / sizeof *metals; i++) {
		if (!is_named(name, metals[i].name))
			continue;
		double *samples = arena_alloc(arena, 3 * METAL_ROWS, sizeof *samples);
		if (!samples)
			return node_error(n, e, ENOMEM, "out of memory");
		for (size_t c = 0; c < 3; c++)
			for (size_t r = 0; r < METAL_ROWS; r++)
				samples[c * METAL_ROWS + r] = metals[i].samples[r][c];
		/* If colours are RGB, n and k are converted as if they were light, without D65, as in Mitsuba. */
		m->eta.color = color_from_samples(METAL_ROWS, samples, samples + METAL_ROWS, false, false);
		m->k.color = color_from_samples(METAL_ROWS, samples, samples + 2 * METAL_ROWS, false, false);
		return 0;
	}
	return refuse_name(name, n, e);
}

static int read_optional(struct texture *t, const struct scene_node *n, const char *name,
			 const struct bsdf_build *build, struct error *e)
{
	const struct texture_build texture_build = bsdf_texture_build(build);
	return node_find_property(n, name) ? texture_from_node(t, n, name, 0, COLOR_UNBOUNDED, &texture_build, e) : 0;
}

/* Divides t by the index outside now if t is constant. Returns the divisor that remains to be applied at each point. */
static double divide_by_outside_index(struct texture *t, double outside)
{
	if (!texture_is_constant(t))
		return outside;
	t->color.scale /= outside;
	return 1;
}

int metal_read(struct metal *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e)
{
	double outside;
	int code =
		set_named_metal(m, node_string(n, "material", build->is_dialect_3 ? "none" : "Cu"), n, build->arena, e);
	if (!code)
		code = read_optional(&m->eta, n, "eta", build, e);
	if (!code)
		code = read_optional(&m->k, n, "k", build, e);
	if (!code)
		code = ior_read(n, "ext_eta", build->is_dialect_3 ? 1 : IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_read_texture(b, &m->reflectance, n, "specular_reflectance", 1, build, e);
	if (code)
		return code;
	b->is_black = texture_max(&m->reflectance) == 0;
	m->eta_divisor = divide_by_outside_index(&m->eta, outside);
	m->k_divisor = divide_by_outside_index(&m->k, outside);
	m->is_textured = !texture_is_constant(&m->eta) || !texture_is_constant(&m->k);
	b->is_textured |= m->is_textured;
	m->is_perfect_mirror = !m->is_textured && texture_max(&m->eta) == 0 && texture_max(&m->k) > 0;
	if (!m->is_perfect_mirror) {
		bsdf_add_color_kind(b, texture_color_kind(&m->eta));
		bsdf_add_color_kind(b, texture_color_kind(&m->k));
	}
	return 0;
}

spectrum metal_fresnel(const struct metal *m, const struct bsdf_point *p, double cosine)
{
	spectrum r = texture_eval(&m->reflectance, &p->texture_point, p->wavelengths), index[2], f;
	if (m->is_perfect_mirror)
		return r;
	if (m->is_textured) {
		index[0] = spectrum_scale(1 / m->eta_divisor, texture_eval(&m->eta, &p->texture_point, p->wavelengths));
		index[1] = spectrum_scale(1 / m->k_divisor, texture_eval(&m->k, &p->texture_point, p->wavelengths));
	} else {
		color_eval_pair(&m->eta.color, &m->k.color, p->wavelengths, index);
	}
	double c = !(cosine > 0) ? 0 : cosine < 1 ? cosine : 1;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		f.v[i] = fresnel_conductor(c, index[0].v[i], index[1].v[i]);
	return spectrum_mul(r, f);
}
