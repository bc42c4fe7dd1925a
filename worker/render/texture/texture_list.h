/* SPDX-License-Identifier: Apache-2.0 */
/* One line per texture: TEXTURE(NAME) stands for its const struct texture_ops texture_ops_NAME. */
TEXTURE(bitmap)
TEXTURE(checkerboard)
TEXTURE(gridtexture)
TEXTURE(scale)
TEXTURE(mesh_attribute)
TEXTURE(vertexcolors)
TEXTURE(wireframe)
TEXTURE(volume)
