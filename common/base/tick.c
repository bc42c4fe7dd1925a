#include "common/base/tick.h"

_Thread_local atomic_ullong *tick_counter;
