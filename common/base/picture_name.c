/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/picture_name.h"

#include <stddef.h>
#include <string.h>
#include <strings.h>

const char *picture_name_format(const char *name)
{
	static const char *const formats[] = {".exr",  ".png",	".jpg",	 ".jpeg", ".tif",  ".tiff", ".hdr",
					      ".webp", ".gif",	".bmp",	 ".ppm",  ".pfm",  ".tga",  ".svg",
					      ".pdf",  ".avif", ".heic", ".jxl",  ".jp2",  ".pgm",  ".pbm",
					      ".pnm",  ".psd",	".dds",	 ".ktx",  ".ktx2", ".eps"};
	size_t n = strlen(name);
	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
		size_t k = strlen(formats[i]);
		if (n > k && strcasecmp(name + n - k, formats[i]) == 0)
			return formats[i];
	}
	return NULL;
}
