#include "common/base/sealed.h"

#include "common/base/crc.h"
#include "common/base/mem.h"

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BUFFER = 1 << 16 };

static int fault(const struct sealed *s, struct error *e)
{
	int code = errno ? errno : EIO;
	return error_set(e, code, "%s: %s", s->path, strerror(code));
}

int sealed_create(struct sealed *s, const char *path, struct error *e)
{
	*s = (struct sealed){.path = path, .file = fopen(path, "wbe")};
	return s->file ? 0 : fault(s, e);
}

int sealed_write(struct sealed *s, const void *bytes, size_t size, struct error *e)
{
	s->crc = crc32c(s->crc, bytes, size);
	s->bytes += size;
	errno = 0;
	return fwrite(bytes, 1, size, s->file) == size ? 0 : fault(s, e);
}

int sealed_finish(struct sealed *s, struct error *e)
{
	uint32_t crc = s->crc;
	int rc = sealed_write(s, &crc, sizeof crc, e);
	if (!rc && (fflush(s->file) || fsync(fileno(s->file))))
		rc = fault(s, e);
	if (fclose(s->file) && !rc)
		rc = fault(s, e);
	s->file = NULL;
	return rc;
}

static int check(struct sealed *s, struct error *e)
{
	struct stat st;
	uint32_t crc = 0, want;
	if (fstat(fileno(s->file), &st))
		return fault(s, e);
	if ((uint64_t)st.st_size < sizeof want)
		return error_set(e, EBADMSG, "%s: too short", s->path);
	s->left = (uint64_t)st.st_size - sizeof want;
	unsigned char *buffer = mem_alloc(BUFFER, 1);
	if (!buffer)
		return error_set(e, ENOMEM, "no memory to read %s", s->path);
	size_t n = 1;
	for (uint64_t left = s->left; left && n; left -= n) {
		n = fread(buffer, 1, left < BUFFER ? left : BUFFER, s->file);
		crc = crc32c(crc, buffer, n);
	}
	mem_free(buffer);
	if (ferror(s->file))
		return fault(s, e);
	if (fread(&want, sizeof want, 1, s->file) != 1 || want != crc)
		return error_set(e, EBADMSG, "%s: damaged", s->path);
	rewind(s->file);
	return 0;
}

int sealed_open(struct sealed *s, const char *path, struct error *e)
{
	*s = (struct sealed){.path = path, .file = fopen(path, "rbe")};
	if (!s->file)
		return fault(s, e);
	int rc = check(s, e);
	if (rc)
		sealed_close(s);
	return rc;
}

int sealed_read(struct sealed *s, void *bytes, size_t size, struct error *e)
{
	if (size > s->left)
		return error_set(e, EBADMSG, "%s: ends too early", s->path);
	s->left -= size;
	errno = 0;
	return fread(bytes, 1, size, s->file) == size ? 0 : fault(s, e);
}

void sealed_close(struct sealed *s)
{
	if (s->file)
		fclose(s->file);
	s->file = NULL;
}
