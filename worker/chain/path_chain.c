#include "worker/chain/path_chain.h"

#include "worker/mutation/mixture.h"
#include "worker/path/classes.h"

#include <float.h>
#include <string.h>

#define LOG_FLT_MAX (FLT_MAX_EXP * M_LN2)
