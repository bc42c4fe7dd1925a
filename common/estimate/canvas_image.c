/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes an image from the integer sums of a canvas.
 *
 * canvas_image_init adds up the counts of bootstrap and rounds, computes b of each group and of all, and from it the
 * factor of each group's film. Then it pools the films tile by tile into RGB, and estimates the error and the
 * statistics within chains. A preview (includes_open_rounds) includes rounds that are not complete and has no error.
 *
 * All loops run in a fixed order over exact inputs, so that equal films give equal bits. What is not known, such as b
 * without samples, is NAN or 0; the only failure is -ENOMEM, after which the image has no arrays.
 */
#include "common/estimate/canvas_image.h"

#include "common/base/color.h"
#include "common/base/mem.h"
#include "common/estimate/canvas_error.h"
#include "common/estimate/convergence.h"
#include "common/estimate/moments_image.h"

#include <math.h>
#include <string.h>

/* Adds those counts of the bootstrap that concern the image although its samples are in no film: the ones that
 * determine b, and refused contributions. */
static void add_bootstrap(struct tally *to, const struct tally *from, uint32_t groups)
{
	for (uint32_t g = 0; g < groups; g++) {
		to->groups[g].independent += from->groups[g].independent;
		exact_sum_merge(&to->groups[g].independent_sum, &from->groups[g].independent_sum);
		exact_sum_merge(&to->groups[g].overlong_sum, &from->groups[g].overlong_sum);
	}
	struct canvas_counts refused = {{0}, {{0}}};
	for (int i = COUNT_NAN; i <= COUNT_NEGATIVE; i++)
		refused.counters[i] = from->counts.counters[i];
	canvas_counts_add(&to->counts, &refused);
}

static double ratio_or_zero(double a, double b)
{
	return b > 0 ? a / b : 0;
}

/* Computes b of each group, the pooled b, its standard error from the spread of the groups, and the share of the energy
 * in paths that are too long. */
static void compute_b(struct image_builder *m)
{
	uint32_t groups = m->c->plan.groups;
	struct exact_sum sum = {0}, beyond = {0}, bootstrap = {0};
	uint64_t independent = 0;
	double mean = 0, square = 0;
	for (uint32_t g = 0; g < groups; g++) {
		m->b[g] = ratio_or_zero(exact_sum_value(&m->totals->groups[g].independent_sum),
					(double)m->totals->groups[g].independent);
		exact_sum_merge(&sum, &m->totals->groups[g].independent_sum);
		exact_sum_merge(&beyond, &m->c->bootstrap_tally.groups[g].overlong_sum);
		exact_sum_merge(&bootstrap, &m->c->bootstrap_tally.groups[g].independent_sum);
		independent += m->totals->groups[g].independent;
		mean += m->b[g] / groups;
	}
	for (uint32_t g = 0; g < groups; g++)
		square += (m->b[g] - mean) * (m->b[g] - mean);
	m->img->b = ratio_or_zero(exact_sum_value(&sum), (double)independent);
	m->img->b_error = groups > 1 ? sqrt(square / groups / (groups - 1)) : NAN;
	m->img->b_tail_index = m->c->plan.kind == PLAN_CHAINS ? m->c->b_tail_index : 0;
	double outside = exact_sum_value(&beyond);
	m->img->overlong_share = ratio_or_zero(outside, outside + exact_sum_value(&bootstrap));
}

/* Computes the factors from sums on the grid to the images of the groups and to the pooled image. */
static void compute_factors(struct image_builder *m)
{
	const struct plan *p = &m->c->plan;
	uint64_t samples = 0;
	for (uint32_t g = 0; g < p->groups; g++)
		samples += m->totals->groups[g].samples;
	m->img->samples = samples;
	for (uint32_t g = 0; g < p->groups; g++) {
		double n = p->kind == PLAN_CHAINS ? (double)m->totals->groups[g].samples
						  : (double)p->epoch * (double)m->c->rounds;
		m->factor[g] = (p->kind == PLAN_CHAINS ? m->b[g] : 1) * ratio_or_zero(m->c->quantum, n);
	}
	double n =
		p->kind == PLAN_CHAINS ? (double)samples : (double)p->groups * (double)p->epoch * (double)m->c->rounds;
	m->pooled_factor = (p->kind == PLAN_CHAINS ? m->img->b : 1) * ratio_or_zero(m->c->quantum, n);
}

/* In a preview of samples, strips differ in their number of samples. Returns the number of leases merged, over all
 * groups, for the strip that contains this row of the crop. Rows near the border of a strip also contain samples of the
 * next one, by the filter, and are slightly too bright or too dark. */
static double preview_leases(const struct canvas *c, uint32_t row)
{
	uint32_t part = 0;
	while (plan_row_range(&c->plan, part).end <= row + c->plan.border)
		part++;
	uint64_t n = c->rounds * c->plan.groups;
	for (uint32_t set = 1; set <= OPEN_ROUNDS; set++)
		for (uint32_t g = 0; g < c->plan.groups; g++)
			n += canvas_lease_is_merged(c, set, g, part);
	return (double)n;
}

/* Collects the used slots of a tile from the films of all groups: the prefix, and for a preview the open rounds.
 * Returns their number. */
static uint32_t collect_tile_slots(const struct image_builder *m, size_t tile,
				   const int64_t *slots[PLAN_GROUPS_MAX * FILMS_PER_GROUP])
{
	uint32_t n = 0;
	for (uint32_t g = 0; g < m->c->plan.groups; g++)
		for (uint32_t which = 0; which < (m->includes_open_rounds ? FILMS_PER_GROUP : 1); which++)
			if (*canvas_tile_flags(m->c, canvas_film_index(g, which), tile) & TILE_USED)
				slots[n++] = canvas_slot(m->c, canvas_film_index(g, which), tile);
	return n;
}

/* Adds up a row of pixels over the slots, as doubles, because the total may exceed 64 bits. The order of the slots is
 * fixed. */
static void pool_row(const int64_t *const *slots, uint32_t count, size_t first, size_t values, double *sums)
{
	memset(sums, 0, values * sizeof *sums);
	for (uint32_t i = 0; i < count; i++)
		for (size_t k = 0; k < values; k++)
			sums[k] += (double)slots[i][first + k];
}

static void pool_tile(struct image_builder *m, uint32_t tx, uint32_t ty)
{
	const struct plan *p = &m->c->plan;
	const int64_t *slots[PLAN_GROUPS_MAX * FILMS_PER_GROUP];
	uint32_t count = collect_tile_slots(m, (size_t)ty * m->c->tiles_across + tx, slots), x = tx * TILE_SIZE;
	uint32_t width = p->crop_width - x < TILE_SIZE ? p->crop_width - x : TILE_SIZE;
	for (uint32_t y = ty * TILE_SIZE; y < p->crop_height && y < (ty + 1) * TILE_SIZE; y++) {
		double factor = m->pooled_factor, sums[SLOT_ROW_VALUES], rgb[3];
		if (m->includes_open_rounds && p->kind == PLAN_SAMPLES)
			factor = ratio_or_zero(m->c->quantum, preview_leases(m->c, y) * (double)p->epoch);
		pool_row(slots, count, (size_t)(y % TILE_SIZE) * SLOT_ROW_VALUES, (size_t)width * TILE_CHANNELS, sums);
		float *out = m->img->rgb + ((size_t)y * p->crop_width + x) * 3;
		for (size_t i = 0; i < width; i++) {
			const double *s = sums + i * TILE_CHANNELS,
				     xyz[3] = {s[0] * factor, s[1] * factor, s[2] * factor};
			rec709_from_xyz(xyz, rgb);
			for (size_t k = 0; k < 3; k++)
				out[i * 3 + k] = (float)rgb[k];
		}
	}
}

static int compute_moments(const struct image_builder *m, struct error *e)
{
	struct moments_group groups[PLAN_GROUPS_MAX];
	for (uint32_t g = 0; g < m->c->plan.groups; g++)
		groups[g] = (struct moments_group){m->c->bootstrap_tally.groups[g].independent,
						   m->totals->groups[g].samples, m->b[g]};
	return moments_fill_image(m->c->moments, groups, m->c->rounds, m->includes_open_rounds, m->img, e);
}

static void set_interval_unknown(struct canvas_image *img, enum error_doubt why)
{
	img->rel_mse_doubt = why;
	img->rel_mse_interval_95[0] = img->rel_mse_interval_95[1] = NAN;
}

/* If the chains are flagged for some reason but are too short to be judged, the size of their errors is not known. */
static void doubt_short_chains(struct image_builder *m)
{
	struct convergence a;
	convergence_judge(&m->c->plan, m->img, &a);
	if (a.verdict != CHAINS_TOO_SHORT || m->img->rel_mse_doubt)
		return;
	set_interval_unknown(m->img, ERROR_DOUBT_SHORT_CHAINS);
}

/* Returns the number of samples per pixel that can discover light: for chains, only independent proposals and bootstrap
 * samples do, since mutations start from light that has been found. */
static double discovery_samples(const struct image_builder *m)
{
	const struct plan *p = &m->c->plan;
	double independent = 0;
	for (uint32_t g = 0; g < p->groups; g++)
		independent += (double)m->totals->groups[g].independent;
	return p->kind == PLAN_CHAINS ? independent / ((double)p->crop_width * p->crop_height)
				      : (double)p->groups * (double)p->epoch * (double)m->c->rounds;
}

/* Declares the interval unknown if the error would leave it with the light that, by the plan's pilot, the samples so
 * far are unlikely to have found. Once samples find such light, the spread between groups shows it. */
static void doubt_unseen_light(struct image_builder *m)
{
	struct canvas_image *img = m->img;
	if (!(img->rel_mse > 0))
		return;
	img->rel_mse_unseen = plan_unseen_mean_square(&m->c->plan, discovery_samples(m));
	if (img->rel_mse_doubt ||
	    img->rel_mse + IMAGE_UNSEEN_FACTOR * img->rel_mse_unseen <= img->rel_mse_interval_95[1])
		return;
	set_interval_unknown(img, ERROR_DOUBT_UNSEEN);
}

int canvas_image_init(const struct canvas *c, bool open_rounds, struct canvas_image *img, struct error *e)
{
	const struct plan *p = &c->plan;
	*img = (struct canvas_image){.width = p->crop_width,
				     .height = p->crop_height,
				     .rel_mse = NAN,
				     .rel_mse_upper = NAN,
				     .rel_mse_as_measured = NAN,
				     .rel_mse_degrees = NAN,
				     .rel_mse_interval_95 = {NAN, NAN},
				     .rounds = c->rounds};
	struct image_builder m = {
		.c = c, .img = img, .includes_open_rounds = open_rounds, .totals = mem_alloc(1, sizeof *m.totals)};
	bool errors = p->groups > 1 && !open_rounds;
	img->rgb = mem_alloc((size_t)img->width * img->height * 3, sizeof *img->rgb);
	img->error = errors ? mem_alloc((size_t)img->width * img->height * 3, sizeof *img->error) : NULL;
	if (!m.totals || !img->rgb || (errors && !img->error)) {
		canvas_image_fini(img);
		mem_free(m.totals);
		return error_set(e, ENOMEM, "no memory for an image of %ux%u", p->crop_width, p->crop_height);
	}
	add_bootstrap(m.totals, &c->bootstrap_tally, p->groups);
	tally_merge(m.totals, &c->prefix_tally, p->groups);
	for (uint32_t i = 0; open_rounds && i < OPEN_ROUNDS; i++)
		tally_merge(m.totals, &c->open_tallies[i], p->groups);
	compute_b(&m);
	compute_factors(&m);
	img->counts = m.totals->counts;
	for (uint32_t ty = 0; ty < c->tiles_down; ty++)
		for (uint32_t tx = 0; tx < c->tiles_across; tx++)
			pool_tile(&m, tx, ty);
	img->is_black = true;
	for (size_t i = 0; i < (size_t)img->width * img->height * 3 && img->is_black; i++)
		img->is_black = img->rgb[i] == 0;
	if (p->groups < 2 && !open_rounds && !img->is_black)
		img->rel_mse_doubt = ERROR_DOUBT_NO_SPREAD;
	int rc = errors ? canvas_estimate_error(&m, e) : 0;
	if (rc == 0)
		rc = compute_moments(&m, e);
	if (rc == 0 && errors) {
		doubt_short_chains(&m);
		doubt_unseen_light(&m);
	}
	if (rc)
		canvas_image_fini(img);
	mem_free(m.totals);
	return rc;
}

void canvas_image_fini(struct canvas_image *img)
{
	mem_free(img->rgb);
	mem_free(img->error);
	mem_free(img->r_hat);
	mem_free(img->tile_error);
	mem_free(img->tile_energy_share);
	img->rgb = img->error = img->r_hat = img->tile_error = img->tile_energy_share = NULL;
}
