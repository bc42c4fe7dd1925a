/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/liveness.h"

_Thread_local atomic_ullong *liveness_counter;
