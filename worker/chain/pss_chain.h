/* SPDX-License-Identifier: Apache-2.0 */
/* Chains in primary sample space over the bidirectional path tracer (Kelemen et al. 2002). */
#ifndef WORKER_CHAIN_PSS_CHAIN_H
#define WORKER_CHAIN_PSS_CHAIN_H

#include "worker/chain/chain.h"

extern const struct chain_ops chain_pss;

#endif
