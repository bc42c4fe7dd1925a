#include "worker/math/cie.h"

const double cie_observer[CIE_COUNT][3] = {
#include "cie_observer.inc"
};

const double cie_d65[CIE_COUNT] = {
#include "cie_d65.inc"
};
