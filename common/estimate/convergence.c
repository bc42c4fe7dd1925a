/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checks tiles (potential scale reduction), then classes of paths (chains against bootstrap, groups against each
 * other), then chains that accepted nothing during whole epochs. Everything flagged goes into one sentence. Each
 * criterion requires both significance and size: a deviation that is invisible in the image is not a disagreement, nor
 * is one that may be due to chance.
 *
 * Nothing fails: values that are not known (too few groups, nothing visited) are NAN and are never flagged.
 */
#include "common/estimate/convergence.h"

#include "common/base/text.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Tiles: below an R-hat of 1.1 chains count as mixed (Gelman and Rubin 1992). A flagged tile must also have a large
 * error of its mean: otherwise a scene of many small lights, which chains visit in turn, would be flagged for
 * differences that 1,000 chains average out. */
#define R_HAT_MIXED 1.1
#define TILE_ERROR_MAX 0.1
#define TILE_SHARE_MIN 1e-3
#define FLAGGED_SHARE_MAX 0.01

/* Classes: the difference must be significant, at this level for all classes together, and large enough to be visible:
 * a share of b, or a share of the class's own energy if that is not negligible. */
#define CLASS_SIGNIFICANCE 1e-4
#define CLASS_DIFFERENCE_OF_B 0.02
#define CLASS_DIFFERENCE_OF_CLASS 0.2
#define CLASS_SHARE_MIN 0.005
/* Groups are inconsistent if the standard error of a class's energy in the chains, from the spread of the groups,
 * exceeds these shares of the energy and of b. It is a quarter of the energy if half of the groups found the class and
 * have equal shares of it (sqrt((16 / 8 - 1) / 15) for 16 groups). With fewer than INCONSISTENT_GROUPS_MIN groups the
 * standard error itself is too uncertain. */
#define INCONSISTENT_OF_CLASS 0.25
#define INCONSISTENT_OF_B 0.03
enum { INCONSISTENT_GROUPS_MIN = 8 };
/* Relative standard error of a class's energy in the bootstrap from which on the bootstrap is no evidence for an excess
 * in the chains: see excess_is_evidence(). */
#define BOOTSTRAP_ERROR_MAX 0.1

/* Share of chain epochs without an accepted mutation that is tolerated, and the shortest epoch that is judged by it. */
#define STUCK_SHARE_MAX 0.01
enum { STUCK_EPOCH_MIN = 1000 };

const char *convergence_name(enum convergence_verdict v)
{
	static const char *const names[] = {"agree", "too short", "disagree"};
	assert((unsigned)v < sizeof names / sizeof *names);
	return names[v];
}

/* For whole degrees of freedom the probability is a finite sum (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4). */
double convergence_student_tail(double t, uint32_t degrees)
{
	double angle = atan(fabs(t) / sqrt(degrees)), c = cos(angle), square = c * c;
	double sum = 0, term = 1;
	assert(degrees > 0);
	if (degrees % 2 == 0) {
		for (uint32_t k = 0; k < degrees; k += 2) {
			sum += term;
			term *= square * (k + 1) / (k + 2);
		}
		return fmax(1 - sin(angle) * sum, 0);
	}
	term = c;
	for (uint32_t k = 1; k < degrees; k += 2) {
		sum += term;
		term *= square * (k + 1) / (k + 2);
	}
	return fmax(1 - (angle + sin(angle) * sum) * M_2_PI, 0);
}

/* ---- tiles */

static bool tile_is_flagged(const struct canvas_image *img, size_t i)
{
	return img->r_hat[i] > (float)R_HAT_MIXED && img->tile_error[i] > (float)TILE_ERROR_MAX &&
	       img->tile_energy_share[i] >= (float)TILE_SHARE_MIN;
}

/* Returns the median of the `count` values of R-hat that are not NAN, by bisection over the values: quadratic, but
 * there are few tiles, and nothing is allocated. */
static double median_r_hat(const struct canvas_image *img, uint32_t count)
{
	size_t tiles = (size_t)img->tiles_across * img->tiles_down;
	float low = -INFINITY, high = INFINITY;
	for (size_t i = 0; i < tiles; i++) {
		float x = img->r_hat[i];
		uint32_t below = 0, equal = 0;
		if (isnan(x) || !(x > low && x < high))
			continue;
		for (size_t k = 0; k < tiles; k++) {
			below += img->r_hat[k] < x;
			equal += img->r_hat[k] == x;
		}
		if (below > count / 2)
			high = x;
		else if (below + equal <= count / 2)
			low = x;
		else
			return (double)x;
	}
	return NAN;
}

static void judge_tiles(const struct plan *p, const struct canvas_image *img, struct convergence *a)
{
	uint32_t count = 0;
	if (!img->r_hat)
		return;
	for (size_t i = 0; i < (size_t)img->tiles_across * img->tiles_down; i++) {
		double r_hat = (double)img->r_hat[i];
		a->tiles++;
		if (isnan(r_hat))
			continue;
		count++;
		if (!(r_hat <= a->max_r_hat)) {
			a->max_r_hat = r_hat;
			a->worst_x = p->crop_x + (uint32_t)(i % img->tiles_across) * TILE_SIZE;
			a->worst_y = p->crop_y + (uint32_t)(i / img->tiles_across) * TILE_SIZE;
		}
		if (tile_is_flagged(img, i)) {
			a->flagged_tiles++;
			a->flagged_energy_share += (double)img->tile_energy_share[i];
		}
	}
	a->median_r_hat = median_r_hat(img, count);
}

/* ---- classes */

/*
 * Returns whether an excess of a class in the chains over the bootstrap counts as evidence. Energies of independent
 * samples have heavy tails: until the rare bright samples occur, both mean and spread of the bootstrap are too small
 * and t is far too large. An excess therefore counts only if the bootstrap knows the class well. Little is lost by
 * this: the chains distribute b, which comes from independent samples, over the classes, so an excess in one class is a
 * deficit in others. A deficit is safe to judge, because samples that raise the bootstrap's mean also raise its spread.
 */
static bool excess_is_evidence(const struct path_class_energy *c)
{
	return c->bootstrap_error < BOOTSTRAP_ERROR_MAX * c->bootstrap;
}

static bool class_is_flagged(const struct path_class_energy *c, double b, uint32_t groups)
{
	double d = c->chains - c->bootstrap, class = fmax(c->chains, c->bootstrap);
	bool large = fabs(d) > CLASS_DIFFERENCE_OF_B * b ||
		     (fabs(d) > CLASS_DIFFERENCE_OF_CLASS * class && class > CLASS_SHARE_MIN * b);
	if (!(b > 0) || !large || groups < 2 || isnan(c->difference_t) || (d > 0 && !excess_is_evidence(c)))
		return false;
	return convergence_student_tail(c->difference_t, groups - 1) < CLASS_SIGNIFICANCE / PATH_CLASSES;
}

static bool class_is_inconsistent(const struct path_class_energy *c, double b, uint32_t groups)
{
	return groups >= INCONSISTENT_GROUPS_MIN && c->chains_error > INCONSISTENT_OF_CLASS * c->chains &&
	       c->chains_error > INCONSISTENT_OF_B * b;
}

static void judge_classes(const struct plan *p, const struct canvas_image *img, struct convergence *a)
{
	for (unsigned k = 0; k < PATH_CLASSES; k++) {
		a->flagged_classes |= (uint32_t)class_is_flagged(&img->classes[k], img->b, p->groups) << k;
		a->inconsistent_classes |= (uint32_t)class_is_inconsistent(&img->classes[k], img->b, p->groups) << k;
	}
}

/* ---- words */

static void append_tiles(struct text *t, const struct convergence *a)
{
	text_appendf(t, "they have not mixed in %u of %u tiles, with %.3g %% of the energy (R-hat %.3g at %u,%u)",
		     a->flagged_tiles, a->tiles, 100 * a->flagged_energy_share, a->max_r_hat, a->worst_x, a->worst_y);
}

static void append_classes(struct text *t, const struct canvas_image *img, uint32_t which, bool inconsistent)
{
	enum { SHOWN_MAX = 2 };
	unsigned shown = 0, omitted = 0;
	for (unsigned k = 0; k < PATH_CLASSES; k++) {
		const struct path_class_energy *c = &img->classes[k];
		if (!(which >> k & 1))
			continue;
		if (shown == SHOWN_MAX) {
			omitted++;
			continue;
		}
		double chains = 100 * c->chains / img->b;
		text_appendf(t, "%s", shown ? ", " : inconsistent ? "groups of them differ in paths " : "to paths ");
		if (inconsistent)
			text_appendf(t, "(%s): %.3g +- %.2g %% of the light", path_class_name(k), chains,
				     100 * c->chains_error / img->b);
		else
			text_appendf(t, "(%s) they give %.3g %% of the light, the bootstrap %.3g %%",
				     path_class_name(k), chains, 100 * c->bootstrap / img->b);
		shown++;
	}
	if (omitted)
		text_appendf(t, ", and %u classes more", omitted);
}

static void describe_verdict(const struct plan *p, const struct canvas_image *img, struct convergence *a, bool tiles,
			     bool stuck)
{
	struct text t = {a->text, sizeof a->text};
	const char *separator = "";
	if (a->verdict == CHAINS_TOO_SHORT)
		text_appendf(&t, "chains are too short to be judged, %llu mutations each: ",
			     (unsigned long long)(img->rounds * p->epoch));
	else
		text_appendf(&t, "chains disagree: ");
	if (tiles) {
		append_tiles(&t, a);
		separator = "; ";
	}
	if (a->flagged_classes) {
		text_appendf(&t, "%s", separator);
		append_classes(&t, img, a->flagged_classes, false);
		separator = "; ";
	}
	if (a->inconsistent_classes) {
		text_appendf(&t, "%s", separator);
		append_classes(&t, img, a->inconsistent_classes, true);
		separator = "; ";
	}
	if (stuck)
		text_appendf(&t, "%sin %.3g %% of their epochs of %llu mutations they accepted nothing", separator,
			     100 * a->stuck_share, (unsigned long long)p->epoch);
}

void convergence_judge(const struct plan *p, const struct canvas_image *img, struct convergence *a)
{
	*a = (struct convergence){.median_r_hat = NAN, .max_r_hat = NAN};
	if (p->kind != PLAN_CHAINS)
		return;
	uint64_t epochs = img->samples / p->epoch;
	judge_tiles(p, img, a);
	judge_classes(p, img, a);
	if (epochs)
		a->stuck_share = (double)img->counts.counters[COUNT_STUCK] / (double)epochs;
	bool tiles = a->flagged_energy_share > FLAGGED_SHARE_MAX,
	     stuck = p->epoch >= STUCK_EPOCH_MIN && a->stuck_share > STUCK_SHARE_MAX;
	if (!tiles && !a->flagged_classes && !a->inconsistent_classes && !stuck)
		return;
	/* The product cannot overflow: it is at most COUNT_SAMPLES, which fits into 64 bits. */
	a->verdict = img->rounds * p->epoch < CONVERGENCE_MUTATIONS_MIN ? CHAINS_TOO_SHORT : CHAINS_DISAGREE;
	describe_verdict(p, img, a, tiles, stuck);
}

void convergence_append_note(const struct convergence *a, char *note, size_t size)
{
	size_t used = strnlen(note, size);
	if (!*a->text || used >= size)
		return;
	struct text t = {note + used, size - used};
	text_appendf(&t, "%s%s", used ? "; " : "", a->text);
}

static void append_energy(struct text *t, double energy, double error)
{
	if (isnan(error))
		text_appendf(t, " %10.3f +- unknown", energy);
	else
		text_appendf(t, " %10.3f +-%8.3f", energy, error);
}

void convergence_print_table(const struct path_class_energy classes[PATH_CLASSES], double b,
			     const struct convergence *a, char *text, size_t size)
{
	struct text t = {text, size};
	if (size)
		text[0] = 0;
	bool any = false;
	for (unsigned k = 0; k < PATH_CLASSES && b > 0; k++) {
		const struct path_class_energy *c = &classes[k];
		if (!(c->chains > 0) && !(c->bootstrap > 0))
			continue;
		if (!any)
			text_appendf(&t, "%-36s %21s %21s %9s\n", "paths, % of the light", "bootstrap", "chains", "t");
		any = true;
		text_appendf(&t, "%-36s", path_class_name(k));
		append_energy(&t, 100 * c->bootstrap / b, 100 * c->bootstrap_error / b);
		append_energy(&t, 100 * c->chains / b, 100 * c->chains_error / b);
		if (isnan(c->difference_t))
			text_appendf(&t, " %9s", "-");
		else
			text_appendf(&t, " %9.2f", c->difference_t);
		text_appendf(&t, "%s%s\n", a->flagged_classes >> k & 1 ? "  differs" : "",
			     a->inconsistent_classes >> k & 1 ? "  groups apart" : "");
	}
}
