/* SPDX-License-Identifier: Apache-2.0 */
/* Chains in primary sample space over the bidirectional path tracer (Kelemen et al. 2002). */
#ifndef WORKER_RENDER_CHAIN_PSS_CHAIN_H
#define WORKER_RENDER_CHAIN_PSS_CHAIN_H

#include "worker/render/chain/chain.h"

extern const struct chain_ops chain_pss;

#endif
