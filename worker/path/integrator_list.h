/* One line an integrator: INTEGRATOR(name) stands for `const struct integrator integrator_<name>`. */
INTEGRATOR(path)
INTEGRATOR(bdpt)
INTEGRATOR(pssmlt)
INTEGRATOR(hslt)
