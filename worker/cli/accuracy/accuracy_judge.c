/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Computes the figures of each setting from its film, with intervals.
 *
 * The error is estimated from the differences between the groups of a render. The weights of pixels are made from one
 * image, the mean over all settings, so that errors differ only by the noise of the settings. Errors are then scaled to
 * the number of mutations and to the CPU time of the default. The bias is the difference from the reference, in the
 * mean of the image and in blocks of it.
 *
 * Fails only if memory is out.
 */
#include "worker/cli/accuracy/accuracy_judge.h"

#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/estimate/canvas_blocks.h"

#include <stdlib.h>
#include <string.h>

#define LEVEL 0.05

struct judge {
	const struct accuracy_run *run;
	struct accuracy_judgement *judgement;
	double *mean_image;   /* [pixels * 3]: the mean image of all settings */
	double *weights;      /* [pixels * 3], for one setting at a time */
	double *pixel_errors; /* [2][pixels]: errors of the pixels of one setting, and the same sorted */
	double *rel_mse;      /* [settings] */
	double *degrees;      /* [settings]: degrees of freedom of rel_mse */
	double *block_means;  /* [settings][group_count][cell_count]: means over the blocks, and over the image */
	size_t cell_count, group_count;
};

static const struct accuracy_job *get_job(const struct judge *j, size_t i)
{
	return &j->run->jobs[i];
}

/* Returns the interval of x, given the standard deviation of its logarithm. */
static struct interval interval_around(double x, double log_sd)
{
	double factor = exp(stats_t_quantile(LEVEL, 1e9) * log_sd);
	return (struct interval){x, x / factor, x * factor};
}

static int compute_mean_image(struct judge *j, struct error *e)
{
	size_t n = j->run->design->count, values = (size_t)j->judgement->width * j->judgement->height * 3;
	for (size_t i = 0; i < n; i++) {
		struct canvas_image img;
		if (canvas_image_init(get_job(j, i)->run.canvas, false, &img, e))
			return -ENOMEM;
		for (size_t k = 0; k < values; k++)
			j->mean_image[k] += (double)img.rgb[k] / (double)n;
		/* The report shows the reference, which has the least noise. */
		for (size_t k = 0; i == ACCURACY_REFERENCE && k < values; k++)
			j->judgement->rgb[(k % 3) * (values / 3) + k / 3] = img.rgb[k];
		canvas_image_fini(&img);
	}
	return 0;
}

static void compute_rates(struct accuracy_figures *f, const struct canvas_counts *n)
{
	static const enum strategy_counter failures[] = {STRATEGY_FAIL_SINGULAR, STRATEGY_FAIL_DIVERGED,
							 STRATEGY_FAIL_ITERATIONS, STRATEGY_FAIL_REVERSE};
	uint64_t walks = 0, failed = 0;
	for (int k = 0; k < BATCH_STRATEGIES; k++) {
		walks += n->strategies[k][STRATEGY_WALKS];
		for (size_t i = 0; i < sizeof failures / sizeof *failures; i++)
			failed += n->strategies[k][failures[i]];
	}
	double samples = (double)n->counters[COUNT_SAMPLES];
	f->acceptance_rate = (double)n->counters[COUNT_ACCEPTED] / samples;
	f->rays_per_mutation =
		((double)n->counters[COUNT_RAYS_CLOSEST] + (double)n->counters[COUNT_RAYS_SHADOW]) / samples;
	f->failed_walk_share = walks ? (double)failed / (double)walks : NAN;
}

/* Computes the weights of the errors of one setting: 1 / (B^2 + (0.01 m)^2), B the mean image of all settings and m its
 * mean, divided by the number of values; 0 for the pixels with the largest errors. */
static void compute_weights(struct judge *j, const float *error)
{
	size_t pixels = (size_t)j->judgement->width * j->judgement->height,
	       trimmed = (size_t)ceil(ACCURACY_TRIM * (double)pixels);
	double m = 0;
	for (size_t k = 0; k < 3 * pixels; k++)
		m += j->mean_image[k] / (double)(3 * pixels);
	for (size_t i = 0; i < pixels; i++) {
		double sum = 0;
		for (size_t k = 3 * i; k < 3 * i + 3; k++) {
			j->weights[k] = 1 / (j->mean_image[k] * j->mean_image[k] + 1e-4 * m * m);
			sum += j->weights[k] * (double)error[k] * (double)error[k];
		}
		j->pixel_errors[i] = sum;
	}
	double *sorted = j->pixel_errors + pixels;
	memcpy(sorted, j->pixel_errors, pixels * sizeof *sorted);
	qsort(sorted, pixels, sizeof *sorted, compare_doubles);
	double threshold = sorted[trimmed < pixels ? pixels - 1 - trimmed : 0];
	for (size_t k = 0; k < 3 * pixels; k++)
		j->weights[k] = j->pixel_errors[k / 3] > threshold ? 0 : j->weights[k] / (double)(3 * pixels);
}

/* Returns the degrees of freedom of the chi-square distribution that is spread like the groups' distances
 * (Satterthwaite 1946). */
static double degrees_of_freedom(const double *distance, size_t groups, double mean)
{
	double n = (double)groups, square = 0;
	for (size_t g = 0; g < groups; g++)
		square += (distance[g] / mean - 1) * (distance[g] / mean - 1);
	double spread = square / (n - 1) * (n + 2) / n;
	return spread > 0 ? fmax(2 * (n - 1) / spread, 1) : 1e9;
}

static int compute_error(struct judge *j, size_t i, struct error *e)
{
	struct accuracy_figures *f = &j->judgement->figures[i];
	struct canvas_image img;
	double distance[PLAN_GROUPS_MAX], mean = 0;
	if (canvas_image_init(get_job(j, i)->run.canvas, false, &img, e))
		return -ENOMEM;
	compute_weights(j, img.error);
	canvas_group_distances(get_job(j, i)->run.canvas, j->weights, distance);
	for (size_t g = 0; g < j->group_count; g++)
		mean += distance[g] / (double)j->group_count;
	j->rel_mse[i] = mean / (double)(j->group_count - 1);
	j->degrees[i] = mean > 0 ? degrees_of_freedom(distance, j->group_count, mean) : 1;
	f->mutations = img.rounds * plan_round_mutations(&get_job(j, i)->plan);
	f->rounds = img.rounds;
	f->cpu_seconds = get_job(j, i)->cpu_seconds;
	compute_rates(f, &img.counts);
	canvas_image_fini(&img);
	return 0;
}

static void compute_cost(struct judge *j, size_t i)
{
	struct accuracy_job *b = &j->run->jobs[i];
	struct interval c = stats_median(b->costs, b->cost_count);
	j->judgement->figures[i].mutation_us = (struct interval){1e6 * c.value, 1e6 * c.low, 1e6 * c.high};
}

/* Converts the errors of all settings to the default's number of mutations, and to its CPU time: errors are inversely
 * proportional to the square root of either. */
static void scale_errors(struct judge *j, struct front_point *points)
{
	struct accuracy_judgement *o = j->judgement;
	const struct accuracy_figures *d = &o->figures[ACCURACY_DEFAULT];
	o->default_mutations = d->mutations;
	o->default_cpu_seconds = 1e-6 * d->mutation_us.value * (double)d->mutations;
	for (size_t i = 0; i < j->run->design->count; i++) {
		struct accuracy_figures *f = &o->figures[i];
		double sd = sqrt(0.5 / j->degrees[i]), cost_sd = 0;
		if (f->mutation_us.low > 0)
			cost_sd = 0.5 * log(f->mutation_us.high / f->mutation_us.low) /
				  (2 * stats_t_quantile(LEVEL, 1e9));
		double error_per_root_mutation = sqrt(j->rel_mse[i] * (double)f->mutations);
		f->error_at_equal_mutations =
			interval_around(error_per_root_mutation / sqrt((double)o->default_mutations), sd);
		f->error_at_equal_time = interval_around(
			error_per_root_mutation * sqrt(1e-6 * f->mutation_us.value / o->default_cpu_seconds),
			hypot(sd, cost_sd));
		points[i].log_error = log(f->error_at_equal_time.value);
		points[i].log_sd = hypot(sd, cost_sd);
	}
}

/* Returns the mean of X + Y + Z over a block of an image from a file, which counts as exact. */
static double block_mean(const struct picture *p, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
	/* X+Y+Z of Rec. 709's red, green and blue */
	static const double weight[3] = {0.644463186, 1.191920259, 1.202916555};
	double sum = 0;
	for (uint32_t y = y0; y < y1; y++)
		for (uint32_t x = x0; x < x1; x++)
			for (int k = 0; k < 3; k++)
				sum += weight[k] * (double)p->rgb[k][(size_t)y * p->image.width + x];
	return sum / ((double)(x1 - x0) * (y1 - y0));
}

static void file_block_means(const struct judge *j, const struct picture *p, double *out)
{
	uint32_t w = p->image.width, h = p->image.height, across = j->judgement->blocks_across,
		 down = j->judgement->blocks_down;
	for (uint32_t k = 0; k < across * down; k++)
		out[k] = block_mean(p, w * (k % across) / across, w * (k % across + 1) / across,
				    h * (k / across) / down, h * (k / across + 1) / down);
	out[across * down] = block_mean(p, 0, w, 0, h);
}

static void gather_cell(const double *blocks, size_t groups, size_t cells, size_t cell, double *out)
{
	for (size_t g = 0; g < groups; g++)
		out[g] = blocks[g * cells + cell];
}

static void compute_bias(struct judge *j, size_t i, const double *reference, size_t reference_groups,
			 struct front_point *point)
{
	struct accuracy_figures *f = &j->judgement->figures[i];
	double a[PLAN_GROUPS_MAX], b[PLAN_GROUPS_MAX], worst = -1;
	size_t last = (size_t)j->judgement->blocks_across * j->judgement->blocks_down;
	/* The bias of every setting is tested in the mean of its image and in every block. bias_lower_joint shares the
	 * level among all these tests: one half among the means, the other among the blocks. */
	double settings = (double)j->run->design->count, blocks = last > 0 ? (double)last : 1;
	for (size_t c = 0; c < j->cell_count; c++) {
		double t;
		gather_cell(j->block_means + i * j->group_count * j->cell_count, j->group_count, j->cell_count, c, a);
		gather_cell(reference, reference_groups, j->cell_count, c, b);
		double cell_level = c == last ? LEVEL : LEVEL / blocks;
		struct interval joint = stats_relative_difference(a, j->group_count, b, reference_groups,
								  0.5 * cell_level / settings, &t);
		struct interval d = stats_relative_difference(a, j->group_count, b, reference_groups, cell_level, NULL);
		if (!isfinite(d.value))
			continue;
		f->bias_lower_joint = fmax(f->bias_lower_joint, fmax(joint.low, -joint.high));
		point->bias_lower_single = fmax(point->bias_lower_single, fmax(d.low, -d.high));
		f->bias_upper = fmax(f->bias_upper, fmax(d.high, -d.low));
		if (c == last) {
			f->bias_mean = d;
		} else if (fabs(t) > worst) {
			worst = fabs(t);
			f->bias_worst_block = d;
			f->worst_block_index = (unsigned)c;
		}
	}
	point->changes_image = j->run->design->settings[i].changes_image;
	point->bias_lower_joint = f->bias_lower_joint;
	point->bias_upper = f->bias_upper;
}

static void compute_biases(struct judge *j, const struct picture *reference, struct front_point *points)
{
	const double *reference_blocks = j->block_means + ACCURACY_REFERENCE * j->group_count * j->cell_count;
	double file[ACCURACY_CELLS_MAX];
	for (size_t i = 0; i < j->run->design->count; i++)
		canvas_group_blocks(get_job(j, i)->run.canvas, j->judgement->blocks_across, j->judgement->blocks_down,
				    j->block_means + i * j->group_count * j->cell_count);
	if (reference)
		file_block_means(j, reference, file);
	for (size_t i = 0; i < j->run->design->count; i++)
		if (reference || i != ACCURACY_REFERENCE)
			compute_bias(j, i, reference ? file : reference_blocks, reference ? 1 : j->group_count,
				     &points[i]);
}

static int judge_all(struct judge *j, const struct picture *reference, struct error *e)
{
	static struct front_point points[ACCURACY_SETTINGS_MAX];
	static size_t dominated_by[ACCURACY_SETTINGS_MAX];
	size_t n = j->run->design->count;
	memset(points, 0, sizeof points);
	int rc = compute_mean_image(j, e);
	for (size_t i = 0; !rc && i < n; i++) {
		rc = compute_error(j, i, e);
		compute_cost(j, i);
	}
	if (rc)
		return rc;
	scale_errors(j, points);
	for (size_t i = 0; i < n; i++)
		j->judgement->is_unreliable |= j->judgement->figures[i].rounds < 4;
	j->judgement->is_unreliable |= j->judgement->figures[ACCURACY_DEFAULT].error_at_equal_time.value > 0.5;
	compute_biases(j, reference, points);
	/* The reference is not a candidate for the front, because it is rendered longer. The last setting takes its
	 * place. */
	points[ACCURACY_REFERENCE] = points[n - 1];
	stats_front(points, n - 1, LEVEL, dominated_by);
	for (size_t i = 0; i + 1 < n; i++)
		j->judgement->figures[i == ACCURACY_REFERENCE ? n - 1 : i].dominating_index =
			dominated_by[i] == ACCURACY_REFERENCE ? n - 1 : dominated_by[i];
	j->judgement->figures[ACCURACY_REFERENCE].dominating_index = ACCURACY_REFERENCE;
	return 0;
}

int accuracy_judge(const struct accuracy_run *r, const struct picture *reference, struct accuracy_judgement *out,
		   struct error *e)
{
	const struct plan *p = &r->jobs[0].plan;
	size_t pixels = (size_t)p->crop_width * p->crop_height, n = r->design->count;
	bool large = p->crop_width >= 32 && p->crop_height >= 24;
	*out = (struct accuracy_judgement){.blocks_across = large ? 4 : 1,
					   .blocks_down = large ? 3 : 1,
					   .has_reference_file = reference != NULL,
					   .width = p->crop_width,
					   .height = p->crop_height};
	struct judge j = {.run = r,
			  .judgement = out,
			  .cell_count = (size_t)out->blocks_across * out->blocks_down + 1,
			  .group_count = p->groups};
	out->rgb = mem_alloc(pixels * 3, sizeof *out->rgb);
	j.mean_image = mem_alloc(pixels * 3, sizeof *j.mean_image);
	j.weights = mem_alloc(pixels * 3, sizeof *j.weights);
	j.pixel_errors = mem_alloc(pixels * 2, sizeof *j.pixel_errors);
	j.rel_mse = mem_alloc(n, sizeof *j.rel_mse);
	j.degrees = mem_alloc(n, sizeof *j.degrees);
	j.block_means = mem_alloc(n * j.group_count * j.cell_count, sizeof *j.block_means);
	int rc = !out->rgb || !j.mean_image || !j.weights || !j.pixel_errors || !j.rel_mse || !j.degrees ||
				 !j.block_means
			 ? error_set(e, ENOMEM, "no memory for the comparison")
			 : judge_all(&j, reference, e);
	mem_free(j.mean_image);
	mem_free(j.weights);
	mem_free(j.pixel_errors);
	mem_free(j.rel_mse);
	mem_free(j.degrees);
	mem_free(j.block_means);
	if (rc)
		accuracy_judgement_fini(out);
	return rc;
}

void accuracy_judgement_fini(struct accuracy_judgement *j)
{
	mem_free(j->rgb);
	j->rgb = NULL;
}
