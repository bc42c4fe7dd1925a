/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job arrives as JobInfo (job_cache_set_info). job_cache_check_files checks which of its files are in the cache and
 * undamaged; the caller fetches the others. Once all are there, a thread of the pool reads the scene from the cached
 * files and builds the world (job_cache_build). Film, integrator, settings and mixture as this worker reads them are
 * compared with the plan before any lease runs.
 *
 * Failures: a scene that cannot be built, or that differs from the plan, puts the job into JOB_CACHE_FAILED with the
 * reason. A file that is missing in the cache or damaged is fetched again.
 */
#include "worker/daemon/job_cache.h"

#include "common/base/clock.h"
#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "common/wire/batch_wire.h"
#include "worker/daemon/crash_record.h"
#include "worker/render/settings/accuracy_settings.h"

#include <assert.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
	PATH_BYTES = 4200,
	DEFINES_MAX = 256,
	CHECKED_SECONDS = 60 /* a file that was verified within this time is not read again */
};

static const Farm__JobInfo *get_info(const struct job_cache *cache)
{
	return cache->info.message->job_info;
}

struct job_cache *job_cache_find(struct job_cache *all, uint64_t job)
{
	for (struct job_cache *cache = all; cache; cache = cache->next)
		if (cache->job == job)
			return cache;
	return NULL;
}

int job_cache_new(struct job_cache **out, uint64_t job, struct blob_store *blobs, struct error *e)
{
	struct job_cache *cache = mem_alloc(1, sizeof *cache);
	if (!cache)
		return error_set(e, ENOMEM, "no memory for a job");
	cache->job = job;
	cache->blobs = blobs;
	*out = cache;
	return 0;
}

void job_cache_free(struct job_cache *cache)
{
	assert(cache->state != JOB_CACHE_BUILDING && !cache->reading.check);
	for (size_t i = 0; cache->info.message && cache->is_held && i < get_info(cache)->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(get_info(cache)->files[i]);
		if (cache->is_held[i])
			blob_release(cache->blobs, &h);
		if (cache->paths)
			mem_free(cache->paths[i]);
	}
	mem_free(cache->is_held);
	mem_free(cache->paths);
	render_brightness_map_free(cache->brightness_map);
	if (cache->world)
		world_free(cache->world);
	envelope_fini(&cache->info);
	mem_free(cache);
}

static int check_info(const Farm__JobInfo *m, struct error *e)
{
	bool ok = envelope_text_is_valid(m->name, 1024) && envelope_text_is_valid(m->scene, 1024) &&
		  m->n_defines <= DEFINES_MAX;
	for (size_t i = 0; ok && i < m->n_files; i++)
		ok = envelope_text_is_valid(m->files[i]->name, 1024) && m->files[i]->hash.len == BLOB_HASH_SIZE;
	return ok ? 0 : error_set(e, EBADMSG, "the coordinator's description of the job is invalid");
}

int job_cache_set_info(struct job_cache *cache, struct envelope *info, struct error *e)
{
	const Farm__JobInfo *m = info->message->job_info;
	int rc = check_info(m, e);
	if (!rc)
		rc = plan_from_wire(m->plan, &cache->plan, e);
	if (rc)
		return rc;
	bool *held = mem_alloc(m->n_files, sizeof *held);
	char **paths = mem_alloc(m->n_files, sizeof *paths);
	if (!held || !paths) {
		mem_free(held);
		mem_free(paths);
		return error_set(e, ENOMEM, "no memory for a job");
	}
	cache->plan.rounds = UINT64_MAX; /* the bound may be changed while the job runs, and no lease depends on it */
	cache->is_held = held;
	cache->paths = paths;
	cache->info = *info;
	memset(info, 0, sizeof *info);
	cache->state = JOB_CACHE_FETCHING;
	return 0;
}

/* Packs a description without the job's bounds, for comparison. NULL if memory is out. */
static unsigned char *pack_unbounded(const Farm__JobInfo *m, size_t *size)
{
	Farm__JobInfo job = *m;
	Farm__Plan plan = *m->plan;
	plan.rounds = 0;
	plan.seconds = plan.target_error = 0;
	job.plan = &plan;
	*size = farm__job_info__get_packed_size(&job);
	unsigned char *bytes = mem_alloc(*size, 1);
	if (bytes)
		farm__job_info__pack(&job, bytes);
	return bytes;
}

bool job_cache_matches(const struct job_cache *cache, const Farm__JobInfo *info)
{
	size_t expected_size, size;
	if (!cache->info.message)
		return true;
	if (!info->plan)
		return false;
	unsigned char *expected = pack_unbounded(get_info(cache), &expected_size),
		      *received = pack_unbounded(info, &size);
	bool same = expected && received && size == expected_size && memcmp(expected, received, size) == 0;
	mem_free(expected);
	mem_free(received);
	return same;
}

static void read_part(uv_work_t *work)
{
	struct job_cache *cache = work->data;
	cache->reading.has_more = blob_check_read(cache->reading.check);
}

static void on_part_read(uv_work_t *work, int status)
{
	struct job_cache *cache = work->data;
	if (status == 0 && cache->reading.has_more && !*cache->reading.stop_requested &&
	    uv_queue_work(work->loop, work, read_part, on_part_read) == 0)
		return;
	int rc = blob_check_end(cache->reading.check, NULL);
	cache->reading.check = NULL;
	cache->is_held[cache->reading.file_index] = rc == 0 && blob_hold(cache->blobs, &cache->wanted_file);
	cache->reading.has_failed = rc != 0;
	cache->reading.on_done(cache);
}

/* Looks for one file in the cache. It may have been damaged since it arrived, so it is read again, by libuv's pool,
 * unless that was done recently; a damaged file counts as missing. */
static enum job_cache_files check_file(struct job_cache *cache, size_t i, uv_loop_t *loop)
{
	cache->wanted_file = file_hash_from_wire(get_info(cache)->files[i]);
	bool failed = cache->reading.has_failed && cache->reading.file_index == i;
	cache->reading.has_failed = false;
	int rc = failed ? -EBADMSG
			: blob_check_begin(&cache->reading.check, cache->blobs, &cache->wanted_file, CHECKED_SECONDS,
					   NULL);
	if (rc > 0) {
		cache->reading.file_index = i;
		cache->reading.work.data = cache;
		if (uv_queue_work(loop, &cache->reading.work, read_part, on_part_read) == 0)
			return JOB_CACHE_FILE_BEING_READ;
		rc = blob_check_end(cache->reading.check, NULL);
		cache->reading.check = NULL;
	}
	cache->is_held[i] = rc == 0 && blob_hold(cache->blobs, &cache->wanted_file);
	return cache->is_held[i] ? JOB_CACHE_FILES_COMPLETE : JOB_CACHE_FILE_MISSING;
}

enum job_cache_files job_cache_check_files(struct job_cache *cache, uv_loop_t *loop)
{
	if (cache->reading.check)
		return JOB_CACHE_FILE_BEING_READ;
	for (size_t i = 0; i < get_info(cache)->n_files; i++) {
		enum job_cache_files found = cache->is_held[i] ? JOB_CACHE_FILES_COMPLETE : check_file(cache, i, loop);
		if (found != JOB_CACHE_FILES_COMPLETE)
			return found;
	}
	return JOB_CACHE_FILES_COMPLETE;
}

/* ---- assets: the builder's thread ---- */

struct mapping {
	void *address;
	size_t size;
};

static int open_asset(void *user, const char *name, struct asset *out, struct error *e)
{
	struct job_cache *cache = user;
	const Farm__JobInfo *m = get_info(cache);
	size_t i = 0;
	liveness_tick();
	while (i < m->n_files && strcmp(m->files[i]->name, name) != 0)
		i++;
	if (i == m->n_files)
		return error_set(e, ENOENT, "%s: the file was not sent with the job", name);
	int fd = open(cache->paths[i], O_RDONLY | O_CLOEXEC);
	struct stat st;
	if (fd < 0 || fstat(fd, &st)) {
		int rc = error_set(e, errno, "%s: %s", name, strerror(errno));
		cache->is_worker_at_fault = true;
		if (fd >= 0)
			close(fd);
		return rc;
	}
	struct mapping *map = mem_alloc(1, sizeof *map);
	void *address = MAP_FAILED;
	if (map && st.st_size > 0)
		address = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
	close(fd);
	if (!map || (st.st_size > 0 && address == MAP_FAILED)) {
		mem_free(map);
		cache->is_worker_at_fault = true;
		return error_set(e, ENOMEM, "%s: cannot be mapped", name);
	}
	*map = (struct mapping){st.st_size > 0 ? address : NULL, (size_t)st.st_size};
	*out = (struct asset){.bytes = st.st_size > 0 ? address : (const unsigned char *)"",
			      .size = (size_t)st.st_size,
			      .handle = map};
	return 0;
}

static void close_asset(void *user, struct asset *a)
{
	(void)user;
	struct mapping *map = a->handle;
	if (map && map->address)
		munmap(map->address, map->size);
	mem_free(map);
	memset(a, 0, sizeof *a);
}

/* ---- the world ---- */

/* Compares film, integrator and settings, as this worker reads them from the scene, with the plan, which holds what the
 * client read: with a difference, the image would not be the planned one. */
static int check_plan(const struct job_cache *cache, const struct scene *s, const struct render_options *o,
		      struct error *e)
{
	struct scene_settings set;
	const struct plan *p = &cache->plan;
	struct accuracy_settings accuracy;
	int rc = accuracy_settings_read(o->accuracy, &accuracy, e);
	if (!rc)
		rc = scene_settings_read(s, o->width, o->height, (uint32_t)accuracy.sensor, &set, e);
	if (rc)
		return rc;
	if (set.width != p->width || set.height != p->height || set.border != p->border)
		return error_set(
			e, EINVAL,
			"this worker reads a film of %ux%u with a border of %u from the scene, the plan has %ux%u and "
			"%u: different versions?",
			set.width, set.height, set.border, p->width, p->height, p->border);
	const struct integrator_properties *i = render_integrator_find(p->integrator);
	if (!i || i->kind != p->kind)
		return error_set(e, EINVAL, "this worker has no integrator '%s' of that kind", p->integrator);
	char canonical[PLAN_ACCURACY_MAX];
	rc = accuracy_settings_canonicalize(p->accuracy, canonical, e);
	if (!rc && strcmp(canonical, p->accuracy) != 0)
		rc = error_set(e, EINVAL, "this worker has the settings '%s', the plan '%s': different versions?",
			       canonical, p->accuracy);
	return rc;
}

static int check_mutations(const struct job_cache *cache, struct error *e)
{
	const struct plan *p = &cache->plan;
	char canonical[PLAN_MUTATIONS_MAX] = "";
	struct render_summary summary;
	world_summary(cache->world, &summary);
	int rc = render_integrator_find(p->integrator)->has_mutations
			 ? render_canonical_mutations(p->mutations, &summary, canonical, e)
			 : 0;
	if (!rc && strcmp(canonical, p->mutations) != 0)
		rc = error_set(e, EINVAL,
			       "this worker has the mixture of mutations '%s', the plan '%s': different versions?",
			       canonical, p->mutations);
	return rc;
}

static int build_world(struct job_cache *cache, struct error *e)
{
	const Farm__JobInfo *m = get_info(cache);
	struct scene_define defines[DEFINES_MAX];
	struct asset_source assets = {.user = cache, .open = open_asset, .close = close_asset};
	struct render_options options = {
		.width = m->render_width, .height = m->render_height, .max_depth = cache->plan.max_depth};
	memcpy(options.accuracy, cache->plan.accuracy, sizeof options.accuracy);
	memcpy(options.effects, cache->plan.effects, sizeof options.effects);
	struct scene scene;
	for (size_t i = 0; i < m->n_defines; i++)
		defines[i] = (struct scene_define){m->defines[i]->name, m->defines[i]->value};
	int rc = render_scene_read(&scene, &assets, m->scene, defines, m->n_defines, &options, e);
	if (rc)
		return rc;
	rc = check_plan(cache, &scene, &options, e);
	if (!rc)
		rc = world_new(&cache->world, &scene, &assets, &options, e);
	scene_fini(&scene);
	if (rc)
		return rc;
	rc = check_mutations(cache, e);
	if (!rc)
		rc = render_brightness_map_new(cache->world, &cache->plan, &cache->brightness_map, e);
	if (rc) {
		world_free(cache->world);
		cache->world = NULL;
	}
	return rc;
}

static void run_build(struct task *t)
{
	struct job_cache *cache = (struct job_cache *)t; /* its first member */
	uint64_t begun = uv_hrtime();
	if (cache->waiting_lease.job)
		crash_record_begin(&cache->waiting_lease, get_info(cache)->scene);
	int rc = build_world(cache, &cache->error);
	if (rc)
		cache->world = NULL;
	cache->is_out_of_memory = rc == -ENOMEM;
	crash_record_end();
	cache->build_seconds = (double)(uv_hrtime() - begun) * 1e-9;
}

static void on_world_built(struct task *t)
{
	struct job_cache *cache = (struct job_cache *)t;
	cache->state = cache->world ? JOB_CACHE_READY : JOB_CACHE_FAILED;
	cache->on_built(cache);
}

int job_cache_build(struct job_cache *cache, struct thread_pool *pool, struct error *e)
{
	const Farm__JobInfo *m = get_info(cache);
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (!cache->paths[i])
			cache->paths[i] = mem_alloc(PATH_BYTES, 1);
		if (!cache->paths[i])
			return error_set(e, ENOMEM, "no memory for a job");
		blob_path(cache->blobs, &h, cache->paths[i], PATH_BYTES);
	}
	cache->state = JOB_CACHE_BUILDING;
	cache->task.run = run_build;
	cache->task.on_done = on_world_built;
	thread_pool_add(pool, &cache->task);
	return 0;
}

static bool has_world_in_memory(const struct job_cache *cache)
{
	/* The world is not read while BUILDING, since the thread writes it. */
	return cache->state == JOB_CACHE_BUILDING || cache->world;
}

void job_cache_note_other_worlds(struct job_cache *cache, struct job_cache *all, bool building)
{
	cache->had_other_worlds = false;
	for (struct job_cache *o = all; o; o = o->next)
		if (o != cache && has_world_in_memory(o)) {
			cache->had_other_worlds = true;
			o->had_other_worlds |= building;
		}
}

void job_cache_note_memory_failure(const struct job_cache *cache)
{
	if (cache->had_other_worlds)
		crash_record_note_memory_short(clock_seconds());
}
