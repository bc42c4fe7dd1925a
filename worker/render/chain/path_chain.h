/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chains whose states are whole paths, moved by a mixture of mutations (Veach and Guibas 1997; worker/render/mutation).
 * The target is I = X+Y+Z of the path's contribution per area; independent proposals also estimate b by f / T.
 */
#ifndef WORKER_RENDER_CHAIN_PATH_CHAIN_H
#define WORKER_RENDER_CHAIN_PATH_CHAIN_H

#include "worker/render/chain/chain.h"

extern const struct chain_ops chain_path;

#endif
