/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/cie.h"

const double cie_observer[CIE_COUNT][3] = {
#include "cie_observer.inc"
};

const struct wavelength_cell wavelength_cells[CIE_COUNT - 1] = {
#include "wavelength_cells.inc"
};

const unsigned short wavelength_guide[WAVELENGTH_GUIDE_COUNT] = {
#include "wavelength_guide.inc"
};

const double cie_d65[CIE_COUNT] = {
#include "cie_d65.inc"
};
