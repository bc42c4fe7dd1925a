/* SPDX-License-Identifier: Apache-2.0 */
/* One line per file format, in the order in which formats are tried: FORMAT(NAME) stands for its const struct
 * image_format image_format_NAME. tga comes last, because only its files do not begin with a signature. */
FORMAT(png)
FORMAT(jpeg)
FORMAT(exr)
FORMAT(hdr)
FORMAT(webp)
FORMAT(bmp)
FORMAT(pnm)
FORMAT(tga)
