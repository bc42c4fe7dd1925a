/* SPDX-License-Identifier: Apache-2.0 */
/* One line a shape: its const struct shape_ops is shape_ops_NAME. */
SHAPE(obj)
SHAPE(ply)
SHAPE(serialized)
SHAPE(gltf)
SHAPE(rectangle)
SHAPE(cube)
SHAPE(sphere)
SHAPE(disk)
SHAPE(cylinder)
SHAPE(merge)
SHAPE(shapegroup)
SHAPE(instance)
