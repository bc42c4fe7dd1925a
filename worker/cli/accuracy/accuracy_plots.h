/* SPDX-License-Identifier: Apache-2.0 */
/* Draws the plots of the HTML report, as SVG inside the page. If one cannot be drawn, the reason is printed in its
 * place. One thread. */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_PLOTS_H
#define WORKER_CLI_ACCURACY_ACCURACY_PLOTS_H

#include "worker/cli/accuracy/accuracy.h"
#include "worker/cli/base/text_file.h"

/* Plots the error at equal time, and the bias, against the values of a parameter. */
void accuracy_plot_sweep(struct text_file *p, const struct accuracy_context *x, const struct accuracy_sweep *s);
/* Plots the bias of all settings against their error at equal time. */
void accuracy_plot_front(struct text_file *p, const struct accuracy_context *x);

#endif
