/* SPDX-License-Identifier: Apache-2.0 */
/* The solver of constraint.h whose matrices and vectors are float. */
#ifndef WORKER_RENDER_HALFVEC_CONSTRAINT_SINGLE_H
#define WORKER_RENDER_HALFVEC_CONSTRAINT_SINGLE_H

#include "worker/render/halfvec/constraint.h"

extern const struct constraint_solver constraint_single;

#endif
