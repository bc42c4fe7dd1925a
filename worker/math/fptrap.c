#include "worker/math/fptrap.h"

#include <signal.h>
#include <stdlib.h>

#if defined(__x86_64__)
_Thread_local bool fptrap_watching;

void fptrap_fault(void)
{
	raise(SIGFPE);
	abort();
}
#endif
