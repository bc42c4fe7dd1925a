/* SPDX-License-Identifier: Apache-2.0 */
/* One line per strategy: MUTATION(name) stands for `const struct mutation_ops mutation_<name>`. */
MUTATION(bidirectional)
MUTATION(independent)
MUTATION(hslt)
MUTATION(halfvec)
MUTATION(multichain)
MUTATION(rejoin)
MUTATION(wavelength)
MUTATION(lens)
MUTATION(light)
