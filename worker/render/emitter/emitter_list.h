/* SPDX-License-Identifier: Apache-2.0 */
/* One line per emitter: EMITTER(NAME) stands for its const struct emitter_ops emitter_ops_NAME. */
EMITTER(area)
EMITTER(directionalarea)
EMITTER(constant)
EMITTER(envmap)
EMITTER(point)
EMITTER(spot)
EMITTER(projector)
EMITTER(directional)
EMITTER(collimated)
EMITTER(sky)
EMITTER(sun)
EMITTER(sunsky)
