/* SPDX-License-Identifier: Apache-2.0 */
/* The report's plots, as SVG inside the page. If one cannot be drawn, the reason replaces it. */
#ifndef WORKER_CLI_ACCURACY_PLOTS_H
#define WORKER_CLI_ACCURACY_PLOTS_H

#include "worker/cli/accuracy/accuracy.h"
#include "worker/cli/base/text_file.h"

/* Error at equal time and bias against the parameter's values. */
void accuracy_plot_sweep(struct text_file *p, const struct accuracy_context *x, const struct accuracy_sweep *s);
/* All settings: bias against error at equal time. */
void accuracy_plot_front(struct text_file *p, const struct accuracy_context *x);

#endif
