/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/stated_error.h"

#include "common/base/text.h"

#include <math.h>

/* The rules for renders whose light is rare (tests/image/README.md, "Where the render stops"). Once the estimate is at
 * most `max_error`, most of the rare light has been found, and the true error is at most `factor` times the estimate.
 * Above `max_error` this does not hold: for a lamp in a glass shell, 44 % was stated where 544 % was true. Renders of
 * chains wait until the doubt is gone. The doubt of few groups in few pixels never goes, so it has a rule for chains,
 * too, without which a target error alone would never end the render; the rule is the one of single groups, since few
 * groups may hide these. */
static const struct rare_rule {
	enum error_doubt doubt;
	double max_error, factor;
	bool applies_to_chains; /* the rule also applies to chains */
} rare_rules[] = {{ERROR_DOUBT_ONE_GROUP, 0.1, 5, false},
		  {ERROR_DOUBT_FEW_GROUPS, 0.1, 5, true},
		  {ERROR_DOUBT_TAIL, 0.2, 2.5, false}};
enum { RARE_RULES = sizeof rare_rules / sizeof *rare_rules };

static const char no_spread_text[] =
	"a single group of samples gives no error; it takes at least 2 samples per pixel and 2 groups";

/* Appends the error that the image has if the pixels that came out bright really are bright, if that is less than half
 * of the stated error. A lamp smaller than a pixel looks like a firefly in short renders: 395 % was stated where 22 %
 * was true. */
static void append_error_as_measured(const struct canvas_image *img, struct text *t)
{
	/* Unseen light is missing in either case. */
	double as_measured = img->rel_mse_as_measured + img->rel_mse_unseen;
	if (as_measured < 0.25 * img->rel_mse)
		text_appendf(t, "; if the bright ones are highlights and not fireflies, the error is about %.3g %%",
			     100 * sqrt(as_measured));
}

void stated_error_print_doubt(const struct canvas_image *img, char *text, size_t size)
{
	struct text t = {text, size};
	if (size)
		text[0] = 0;
	double share = 100 * img->doubtful_share;
	switch (img->rel_mse_doubt) {
	case ERROR_DOUBT_NONE:
		break;
	case ERROR_DOUBT_ONE_GROUP:
		text_appendf(
			&t, "%.0f %% of the estimate comes from pixels where one group of samples outweighs all others",
			share);
		append_error_as_measured(img, &t);
		break;
	case ERROR_DOUBT_DARK:
		text_appendf(
			&t,
			"%.0f %% of the estimate comes from pixels with too few samples to estimate their brightness",
			share);
		append_error_as_measured(img, &t);
		break;
	case ERROR_DOUBT_WIDE:
		text_appendf(&t, "it would span more than a factor of ten");
		break;
	case ERROR_DOUBT_TAIL:
		text_appendf(
			&t,
			"few pixels hold most of the error, and larger errors may still come: their tail index is %.2f, "
			"not above %.2f",
			img->error_tail_index, img->error_tail_critical);
		break;
	case ERROR_DOUBT_FEW_GROUPS:
		text_appendf(
			&t,
			"with so few groups of samples in so few pixels, rare bright paths may not have been found yet");
		break;
	case ERROR_DOUBT_NO_SPREAD:
		text_appendf(&t, "%s", no_spread_text);
		break;
	case ERROR_DOUBT_SHORT_CHAINS:
		text_appendf(&t, "the chains are too short to be judged");
		break;
	case ERROR_DOUBT_UNSEEN:
		text_appendf(
			&t,
			"about %.2g %% of the light, root mean square over the image, arrives by paths that so few samples "
			"hardly ever find; with it the error is about %.3g %%",
			100 * sqrt(img->rel_mse_unseen), 100 * sqrt(img->rel_mse + img->rel_mse_unseen));
		break;
	}
}

/* Tail index above which the variance is finite. Of 95 % intervals from 16 groups of 1,000 samples of a Pareto
 * distribution, 95 % contain the true mean at an index of 3, 93 % at 2.2, 91 % at 1.8, 80 % at 1.5, and 28 % at 1.1
 * (3,000 trials each). The spread of the groups' means does not show which intervals are wrong: regular looking ones
 * are wrong more often. */
static const double finite_variance_index = 2;

void stated_error_print_b_doubt(const struct canvas_image *img, char *text, size_t size)
{
	struct text t = {text, size};
	if (size)
		text[0] = 0;
	if (img->rel_mse_doubt == ERROR_DOUBT_NO_SPREAD)
		text_appendf(&t, "%s", no_spread_text);
	else if (img->b_tail_index > 0 && img->b_tail_index < finite_variance_index)
		text_appendf(
			&t,
			"independent samples that find light are too few or too unequal: their tail index is %.2f, "
			"and below %g their variance is infinite",
			img->b_tail_index, finite_variance_index);
}

void stated_error_print(const struct canvas_image *img, char *text, size_t size)
{
	struct text t = {text, size};
	char why[STATED_ERROR_TEXT_MAX];
	if (size)
		text[0] = 0;
	stated_error_print_doubt(img, why, sizeof why);
	if (img->rel_mse_doubt == ERROR_DOUBT_NO_SPREAD)
		text_appendf(&t, "relative error not known: %s", why);
	if (!isfinite(img->rel_mse))
		return;
	if (*why)
		text_appendf(&t, "relative error about %.3g %%, its interval is not known: %s",
			     100 * sqrt(img->rel_mse), why);
	else
		text_appendf(&t, "relative error %.2f %% (95 %%: %.2f to %.2f %%)", 100 * sqrt(img->rel_mse),
			     100 * sqrt(img->rel_mse_interval_95[0]), 100 * sqrt(img->rel_mse_interval_95[1]));
	if (img->unvisited_count)
		text_appendf(&t, "; no chain reached %llu of %llu pixels", (unsigned long long)img->unvisited_count,
			     (unsigned long long)img->width * img->height);
}

/* Returns a bound on the relative error, raised if the error with unseen light would exceed it. */
static double add_unseen(const struct canvas_image *img, double upper)
{
	double unseen = IMAGE_UNSEEN_FACTOR * img->rel_mse_unseen;
	return img->rel_mse + unseen > upper * upper ? sqrt(upper * upper + unseen) : upper;
}

double stated_error_upper(const struct canvas_image *img, bool *doubtful)
{
	double error = sqrt(img->rel_mse), upper = sqrt(img->rel_mse_upper);
	bool samples = !img->r_hat;
	*doubtful = img->rel_mse_doubt != ERROR_DOUBT_NONE && img->rel_mse_doubt != ERROR_DOUBT_UNSEEN;
	if (img->rel_mse_doubt == ERROR_DOUBT_UNSEEN)
		return add_unseen(img, upper);
	for (size_t i = 0; i < RARE_RULES; i++) {
		const struct rare_rule *r = &rare_rules[i];
		if (img->rel_mse_doubt != r->doubt || !(samples || r->applies_to_chains) || !(error <= r->max_error))
			continue;
		*doubtful = false;
		return add_unseen(img, fmax(upper, r->factor * error));
	}
	return upper;
}

void stated_error_print_rule(double target, bool chains, char *text, size_t size)
{
	struct text t = {text, size};
	double rare = rare_rules[RARE_RULES - 1].factor, single = rare_rules[0].factor;
	if (size)
		text[0] = 0;
	if (!(target > 0))
		return;
	text_appendf(&t, "it stops once the upper end of the error's 90 %% interval is at most %.3g %%; ",
		     100 * target);
	if (chains)
		text_appendf(&t, "an error in doubt does not stop it");
	else
		text_appendf(
			&t,
			"if the error stays in doubt, once the estimate is at most %.3g %% (1/%g, infinite variance) or "
			"%.3g %% (1/%g, fireflies)",
			100 * stated_error_rare_stop(target, rare), rare, 100 * stated_error_rare_stop(target, single),
			single);
}

double stated_error_rare_factor(double error, double upper)
{
	for (size_t i = 0; i < RARE_RULES; i++)
		if (fabs(upper / (rare_rules[i].factor * error) - 1) < 1e-4) /* equal except for rounding */
			return rare_rules[i].factor;
	return 0;
}

double stated_error_rare_stop(double target, double factor)
{
	const struct rare_rule *r = rare_rules;
	while (r < rare_rules + RARE_RULES - 1 && r->factor != factor) /* the last has the smallest factor */
		r++;
	return fmin(target / r->factor, r->max_error);
}

bool stated_error_meets(const struct canvas_image *img, double target)
{
	bool doubtful;
	double upper = stated_error_upper(img, &doubtful);
	return !doubtful && upper <= target; /* false for NAN */
}
