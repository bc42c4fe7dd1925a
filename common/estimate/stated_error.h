/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sentences about an image's error, the same in every program. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_STATED_ERROR_H
#define COMMON_ESTIMATE_STATED_ERROR_H

#include "common/estimate/image.h"

/* The definition of relMSE; hslt-compare uses the same one, with its reference as B. */
#define REL_MSE_DEFINITION \
	"mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B; the relative error is its square root"

enum { STATED_ERROR_TEXT_MAX = 384 };

/* Prints why the interval is not known: "78 % of the estimate comes from pixels ...". Empty if it is known, or if there
 * is no estimate. */
void stated_error_print_doubt(const struct canvas_image *img, char *text, size_t size);

/* Prints why b's standard error is not known (chains): if the samples' variance is infinite, the spread of the means of
 * few groups is too small until the rarest light has been found. Empty if it is known. */
void stated_error_print_b_doubt(const struct canvas_image *img, char *text, size_t size);

/* Prints "relative error 8.60 % (95 %: 8.41 to 8.90 %)", or "relative error about 38 %, its interval is not known:
 * ...", or "relative error not known: ..."; then, if there are any, the number of pixels that no chain visited. Empty
 * if there is no estimate. */
void stated_error_print(const struct canvas_image *img, char *text, size_t size);

/*
 * Returns the relative error that is compared with a target error: the upper end of the 90 % interval. *doubtful: the
 * image cannot be compared with a target yet.
 *
 * If an image made of samples is in doubt because of rare light, the doubt may last for ever, since the variance is
 * infinite. Instead of the interval's end, a multiple of the estimate is then compared (tests/image/README.md, "Where
 * the render stops"): five times the estimate if single groups outweigh all others (ERROR_DOUBT_ONE_GROUP), once the
 * estimate is 10 % or less; two and a half times if the tail of the errors is too long (ERROR_DOUBT_TAIL), once it is
 * 20 % or less. With few groups and few pixels (ERROR_DOUBT_FEW_GROUPS), single groups may outweigh the others without
 * being noticed, so the first rule applies, also to chains. If light that is still unseen would put the error above
 * such a bound, twice the relMSE of that light is added.
 */
double stated_error_upper(const struct canvas_image *img, bool *doubtful);
/* Returns whether the image's error meets the target, which ends a render. */
bool stated_error_meets(const struct canvas_image *img, double target);
/* Prints the rule by which a render with this target error stops, with its factors: "it stops once the upper end of the
 * error's 90 % interval is at most 2 %; ...". Empty if the target is 0. chains: the render is made of chains. */
void stated_error_print_rule(double target, bool chains, char *text, size_t size);
/* Returns the factor of the rule for rare light by which stated_error_upper got `upper` from this error; 0 if `upper`
 * is the end of an interval. */
double stated_error_rare_factor(double error, double upper);
/* Returns the estimate at which a render with this target stops by the rule for rare light with this factor. Factor 0
 * means that the rule is not known yet; the smaller factor, which is the more frequent one, is then assumed. */
double stated_error_rare_stop(double target, double factor);

#endif
