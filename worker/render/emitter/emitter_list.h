/* SPDX-License-Identifier: Apache-2.0 */
/* One line an emitter: its const struct emitter_ops is emitter_ops_NAME. */
EMITTER(area)
EMITTER(constant)
EMITTER(envmap)
EMITTER(point)
EMITTER(spot)
EMITTER(projector)
EMITTER(directional)
EMITTER(sky)
EMITTER(sun)
EMITTER(sunsky)
