/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/fingerprint.h"

#include "common/base/fnv.h"
#include "common/base/version.h"
#include "worker/render/world/world.h"

#include <elf.h>
#include <gnu/libc-version.h>
#include <link.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { INPUTS = 512, ID_BYTES = 20 };

static void hash_double(uint64_t *hash, double x)
{
	*hash = fnv_add(*hash, &x, sizeof x);
}

uint64_t fingerprint_self_test(void)
{
	uint64_t hash = FNV_OFFSET_BASIS;
	/* volatile: computed at run time by the installed library, not by the compiler */
	volatile double seed = 0.123456789;
	double x = seed;
	for (int i = 0; i < INPUTS; i++) {
		x = x * 3.9 * (1 - x); /* chaotic in (0,1): any difference in a bit grows */
		hash_double(&hash, sin(100 * x));
		hash_double(&hash, cos(100 * x));
		hash_double(&hash, tan(x));
		hash_double(&hash, exp(20 * x - 10));
		hash_double(&hash, log(x));
		hash_double(&hash, pow(x, 2.2));
		hash_double(&hash, atan2(x, 1 - x));
		hash_double(&hash, acos(x));
		hash_double(&hash, sinh(x));
		hash_double(&hash, asinh(x));
		hash_double(&hash, log1p(-x));
		hash_double(&hash, cbrt(x));
		hash_double(&hash, erf(x));
		hash_double(&hash, hypot(x, 0.3));
		hash_double(&hash, fma(x, x, -0.1));
		hash_double(&hash, (double)expf((float)x));
		hash_double(&hash, (double)powf((float)x, 0.45f));
	}
	return hash;
}

struct build_id {
	unsigned char bytes[ID_BYTES];
	size_t size;
};

static void find_build_id(const char *at, size_t size, struct build_id *id)
{
	while (size >= sizeof(ElfW(Nhdr))) {
		ElfW(Nhdr) note;
		memcpy(&note, at, sizeof note);
		size_t name_size = (note.n_namesz + 3u) & ~3u, content_size = (note.n_descsz + 3u) & ~3u;
		size_t note_size = sizeof note + name_size + content_size;
		if (note_size > size)
			return;
		if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && memcmp(at + sizeof note, "GNU", 4) == 0) {
			id->size = note.n_descsz < ID_BYTES ? note.n_descsz : ID_BYTES;
			memcpy(id->bytes, at + sizeof note + name_size, id->size);
			return;
		}
		at += note_size;
		size -= note_size;
	}
}

/* Only looks at the first object, which is the program itself. */
static int read_program_notes(struct dl_phdr_info *info, size_t size, void *user)
{
	(void)size;
	for (int i = 0; i < info->dlpi_phnum; i++) {
		const ElfW(Phdr) *h = &info->dlpi_phdr[i];
		if (h->p_type == PT_NOTE)
			find_build_id((const char *)(uintptr_t)(info->dlpi_addr + h->p_vaddr), h->p_memsz, user);
	}
	return 1;
}

static int has_fma(void)
{
#if defined(__x86_64__) || defined(__i386__)
	return __builtin_cpu_supports("fma") ? 1 : 0;
#else
	return 1;
#endif
}

const char *fingerprint_embree(void)
{
	return accel_version();
}

void fingerprint_make(char text[FINGERPRINT_MAX])
{
	struct build_id id = {.size = 0};
	char build[2 * ID_BYTES + 1] = HSLT_VERSION; /* fallback for a program linked without a build id */
	dl_iterate_phdr(read_program_notes, &id);
	for (size_t i = 0; i < id.size; i++)
		snprintf(build + 2 * i, 3, "%02x", id.bytes[i]);
	snprintf(text, FINGERPRINT_MAX, "build=%s %s libc=%s fma=%d self=%016llx", build, fingerprint_embree(),
		 gnu_get_libc_version(), has_fma(), (unsigned long long)fingerprint_self_test());
}
