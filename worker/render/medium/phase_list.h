/* SPDX-License-Identifier: Apache-2.0 */
/* One line per phase function: PHASE(NAME) stands for its const struct phase_ops phase_ops_NAME. */
PHASE(isotropic)
PHASE(hg)
PHASE(rayleigh)
PHASE(blendphase)
PHASE(mixturephase)
PHASE(tabphase)
PHASE(sggx)
