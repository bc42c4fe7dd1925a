/* SPDX-License-Identifier: Apache-2.0 */
/* One line per file format, in the order in which they are tried: FORMAT(NAME) stands for its const struct image_format
 * image_format_NAME. tga is last, because the others have a beginning of their own. */
FORMAT(png)
FORMAT(jpeg)
FORMAT(exr)
FORMAT(hdr)
FORMAT(webp)
FORMAT(bmp)
FORMAT(pnm)
FORMAT(tga)
