/* SPDX-License-Identifier: Apache-2.0 */
/* One line a texture: its const struct texture_ops is texture_ops_NAME. */
TEXTURE(bitmap)
TEXTURE(checkerboard)
TEXTURE(scale)
TEXTURE(mesh_attribute)
TEXTURE(vertexcolors)
