/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sentences about an image's error, the same in every program. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_STATED_ERROR_H
#define COMMON_ESTIMATE_STATED_ERROR_H

#include "common/estimate/image.h"

/* What the numbers mean; hslt-compare uses the same definition, with its reference as B. */
#define REL_MSE_DEFINITION \
	"mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B; the relative error is its square root"

enum { STATED_ERROR_TEXT = 384 };

/* Why the interval is not known: "78 % of it comes from pixels ...". Empty: it is known, or there is no estimate. */
void stated_error_doubt(const struct canvas_image *img, char *text, size_t size);

/* Why b's standard error is not known (chains): between few groups of means with infinite variance, the spread says
 * too little until the rarest light has come. Empty: it is known. */
void stated_b_doubt(const struct canvas_image *img, char *text, size_t size);

/* "relative error 8.60 % (95 %: 8.41 to 8.90 %)", or "relative error about 38 %, its interval is not known: ...",
 * or "relative error not known: ...";
 * also how many pixels no chain visited. Empty: there is no estimate. */
void stated_error(const struct canvas_image *img, char *text, size_t size);

/*
 * What a target error is compared with, relative: the upper end of the 90 % interval. If an image made of samples is in
 * doubt because of rare light, the doubt may last forever, since the variance is infinite: then it is five times the
 * estimate where single groups outweigh all others, once that is 10 % or less, and two and a half times where the tail
 * of the errors is too long, once that is 20 % or less (tests/image/README.md, "Where the render stops"). Few groups in
 * few pixels may hide single ones that outweigh the others, and count as these do, also of chains. If light is unseen
 * that may leave either bound, that includes twice what it adds. doubtful: of no use for that.
 */
double stated_error_upper(const struct canvas_image *img, bool *doubtful);
/* That is below or at the target: what ends a render. */
bool stated_error_meets(const struct canvas_image *img, double target);
/* The factor by which a relative error was multiplied to give this `upper`; 0: it is the end of an interval. */
double stated_error_rare_factor(double error, double upper);
/* The estimate at which a render stops while its light is rare, by this factor; 0: it is not known yet,
 * and taken to be the smaller one, as it is most often. */
double stated_error_rare_stop(double target, double factor);

#endif
