/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Computes the potential scale reduction (Gelman and Rubin 1992) by tile and the energies of path classes from the
 * moments that a canvas keeps. The only failure is -ENOMEM.
 */
#include "common/estimate/moments_image.h"

#include "common/base/mem.h"
#include "common/film/moments_sums.h"

#include <math.h>

/* Moments are rounded to float once per epoch and then to the grid, so a spread below this share of the mean cannot be
 * distinguished from none. It occurs: in a film of one tile, every chain spends all its time in that tile. */
#define ROUNDING 0x1p-20

/* The shares of time that sequences spend in one tile. */
struct variance_split {
	double mean;		 /* of the sequences' shares */
	double between_variance; /* their variance */
	double within_variance;	 /* mean variance of one mutation's share within a sequence */
};

/* n: mutations per sequence. */
static double r_hat(const struct variance_split *s, double n)
{
	if (!(s->mean > 0) || isnan(s->between_variance) || n < 2)
		return NAN;
	bool same = s->between_variance <= (ROUNDING * s->mean) * (ROUNDING * s->mean);
	if (s->within_variance <= ROUNDING * s->mean)
		return same ? 1 : INFINITY;
	return sqrt((n - 1) / n + s->between_variance / s->within_variance);
}

static void compute_spread(const struct moments *m, uint32_t tile, double n, struct variance_split *s)
{
	size_t sequences = (size_t)m->lease_count * m->sequences_per_lease;
	double count = (double)sequences, square = 0, second = 0;
	*s = (struct variance_split){0, 0, 0};
	for (size_t i = 0; i < sequences; i++)
		s->mean += (double)m->first_moments[i * m->tile_count + tile];
	s->mean /= MOMENTS_GRID * n * count;
	for (size_t i = 0; i < sequences; i++) {
		double p = (double)m->first_moments[i * m->tile_count + tile] / (MOMENTS_GRID * n), d = p - s->mean;
		s->between_variance += d * d;
		square += p * p;
	}
	for (size_t i = 0; i < m->lease_count; i++)
		second += (double)m->second_moments[i * m->tile_count + tile];
	s->between_variance = sequences > 1 ? s->between_variance / (count - 1) : NAN;
	s->within_variance = n > 1 ? (second / (MOMENTS_GRID * n * count) - square / count) * n / (n - 1) : NAN;
}

static int compute_tiles(const struct moments *m, double n, struct canvas_image *img, struct error *e)
{
	img->r_hat = mem_alloc(m->tile_count, sizeof *img->r_hat);
	img->tile_error = mem_alloc(m->tile_count, sizeof *img->tile_error);
	img->tile_energy_share = mem_alloc(m->tile_count, sizeof *img->tile_energy_share);
	double *mean = mem_alloc(m->tile_count, sizeof *mean), all = 0;
	bool allocated = img->r_hat && img->tile_error && img->tile_energy_share && mean;
	int rc = allocated ? 0 : error_set(e, ENOMEM, "no memory for tiles");
	for (uint32_t t = 0; t < m->tile_count && rc == 0; t++) {
		struct variance_split s;
		compute_spread(m, t, n, &s);
		img->r_hat[t] = (float)r_hat(&s, n);
		img->tile_error[t] =
			(float)(s.mean > 0
					? sqrt(s.between_variance / ((double)m->lease_count * m->sequences_per_lease)) /
						  s.mean
					: NAN);
		mean[t] = s.mean;
		all += s.mean;
	}
	for (uint32_t t = 0; t < m->tile_count && rc == 0; t++)
		img->tile_energy_share[t] = (float)(all > 0 ? mean[t] / all : 0);
	mem_free(mean);
	return rc;
}

/* ---- classes */

/* Returns the mean of the groups' values, and stores its standard error. */
static double mean_and_error(const double *x, uint32_t groups, double *error)
{
	double mean = 0, square = 0;
	for (uint32_t g = 0; g < groups; g++)
		mean += x[g] / groups;
	for (uint32_t g = 0; g < groups; g++)
		square += (x[g] - mean) * (x[g] - mean);
	*error = groups > 1 ? sqrt(square / groups / (groups - 1)) : NAN;
	return mean;
}

/* Returns the time of a group's chains in a class, in mutations. */
static double class_time(const struct moments *m, uint32_t group, size_t class, bool open_rounds)
{
	struct exact_sum sum = {0};
	for (size_t set = 0; set < (open_rounds ? MOMENTS_SETS : MOMENTS_OPEN); set++)
		exact_sum_merge(&sum,
				&m->class_time[set * moments_class_count(m) + (size_t)group * PATH_CLASSES + class]);
	return exact_sum_value(&sum);
}

/* Returns the energy of one unit of a class's sums: chains add up time, of which a unit stands for b; samples add up
 * the energy that they leave to chains (erpt). */
static double class_unit(const struct moments *m, const struct moments_group *of)
{
	return m->plan.kind == PLAN_CHAINS ? of->b : 1;
}

/* Computes the energy of a class, and adds the chains' energy in it to chains_energy, by group. */
static void compute_class(const struct moments *m, const struct moments_group *groups, size_t class, bool open_rounds,
			  double chains_energy[PLAN_GROUPS_MAX], struct path_class_energy *out)
{
	uint32_t count = m->plan.groups;
	double bootstrap[PLAN_GROUPS_MAX], chains[PLAN_GROUPS_MAX], difference[PLAN_GROUPS_MAX], error;
	for (uint32_t g = 0; g < count; g++) {
		const struct moments_group *of = &groups[g];
		double sum = exact_sum_value(&m->bootstrap_energy[(size_t)g * PATH_CLASSES + class]);
		double time = of->mutations ? class_time(m, g, class, open_rounds) : 0;
		bootstrap[g] = of->bootstrap ? sum / (double)of->bootstrap : 0;
		chains[g] = of->mutations ? class_unit(m, of) * time / (double)of->mutations : 0;
		difference[g] = chains[g] - bootstrap[g];
		chains_energy[g] += chains[g];
	}
	out->bootstrap = mean_and_error(bootstrap, count, &out->bootstrap_error);
	out->chains = mean_and_error(chains, count, &out->chains_error);
	double mean = mean_and_error(difference, count, &error);
	bool compared = m->sequences_per_lease && (out->bootstrap > 0 || out->chains > 0);
	out->difference_t = compared && !(mean == 0 && error == 0) ? mean / error : NAN;
}

/* For samples whose brightest contributions are spread by chains: computes the chains' share of the energy, and of the
 * variance of b between groups. */
static void compute_chains_share(const double *chains_energy, const struct moments_group *groups, uint32_t count,
				 struct canvas_image *img)
{
	double other_energy[PLAN_GROUPS_MAX], chains_error, rest_error;
	for (uint32_t g = 0; g < count; g++)
		other_energy[g] = groups[g].b - chains_energy[g];
	double chains = mean_and_error(chains_energy, count, &chains_error),
	       others = mean_and_error(other_energy, count, &rest_error);
	img->chains_energy_share = chains / (chains + others);
	img->chains_variance_share =
		chains_error * chains_error / (chains_error * chains_error + rest_error * rest_error);
}

int moments_fill_image(const struct moments *m, const struct moments_group *groups, uint64_t rounds, bool open_rounds,
		       struct canvas_image *img, struct error *e)
{
	const struct plan *p = &m->plan;
	img->tiles_across = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE;
	img->tiles_down = (p->crop_height + TILE_SIZE - 1) / TILE_SIZE;
	double chains_energy[PLAN_GROUPS_MAX] = {0};
	for (size_t k = 0; k < PATH_CLASSES; k++)
		compute_class(m, groups, k, open_rounds, chains_energy, &img->classes[k]);
	if (p->kind == PLAN_SAMPLES)
		compute_chains_share(chains_energy, groups, p->groups, img);
	if (m->sequences_per_lease == 0 || open_rounds || rounds == 0)
		return 0;
	double chains = (double)(p->chains / m->lease_count / m->sequences_per_lease);
	return compute_tiles(m, chains * (double)p->epoch * (double)rounds, img, e);
}
