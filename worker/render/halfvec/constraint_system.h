/* SPDX-License-Identifier: Apache-2.0 */
/* The solver of constraint.h in double, and the choice of the solver by the settings. */
#ifndef WORKER_RENDER_HALFVEC_CONSTRAINT_SYSTEM_H
#define WORKER_RENDER_HALFVEC_CONSTRAINT_SYSTEM_H

#include "worker/render/halfvec/constraint_single.h"
#include "worker/render/settings/accuracy_settings.h"

extern const struct constraint_solver constraint_double;

static inline const struct constraint_solver *constraint_solver_of(const struct accuracy_settings *k)
{
	return k->precision == SETTING_SINGLE ? &constraint_single : &constraint_double;
}

#endif
