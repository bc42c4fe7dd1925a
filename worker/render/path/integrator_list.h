/* SPDX-License-Identifier: Apache-2.0 */
/* One line per integrator: INTEGRATOR(name) stands for `const struct integrator integrator_<name>`. */
INTEGRATOR(path)
INTEGRATOR(bdpt)
INTEGRATOR(bdpt8)
INTEGRATOR(pssmlt)
INTEGRATOR(hslt)
INTEGRATOR(erpt)
INTEGRATOR(erpt4)
