/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Parts of the worker daemon: the thread pool runs tasks and returns them on the loop's thread; workers share a cache
 * folder without sharing a slot, and never use another user's cache; files of an earlier run are hashed before use; a
 * job is built from the files that it needs; and the numeric fingerprint is the same each time.
 */
#include "common/base/mem.h"
#include "worker/daemon/job_cache.h"
#include "worker/daemon/cache.h"
#include "worker/daemon/thread_pool.h"
#include "worker/render/fingerprint.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- thread pool ---- */

struct job {
	struct task task;
	atomic_int *running, *max_running, *gate;
	pthread_t thread;
	int done_count;
};

static pthread_t loop_thread;

static void run_job(struct task *t)
{
	struct job *j = (struct job *)t;
	int now = atomic_fetch_add(j->running, 1) + 1, previous_max = atomic_load(j->max_running);
	while (now > previous_max && !atomic_compare_exchange_weak(j->max_running, &previous_max, now))
		continue;
	while (j->gate && !atomic_load(j->gate))
		usleep(100);
	usleep(200);
	j->thread = pthread_self();
	atomic_fetch_sub(j->running, 1);
}

static void count_done(struct task *t)
{
	assert_true(pthread_equal(pthread_self(), loop_thread));
	((struct job *)t)->done_count++;
}

static void pool_runs_tasks_and_returns_them_on_the_loop(void **state)
{
	(void)state;
	enum { JOBS = 100 };
	static struct job jobs[JOBS];
	atomic_int running = 0, max_running = 0, gate = 0;
	uv_loop_t loop;
	struct thread_pool *c;
	struct error e;
	loop_thread = pthread_self();
	assert_int_equal(uv_loop_init(&loop), 0);
	assert_int_equal(thread_pool_new(&c, &loop, 3, &e), 0);
	for (int i = 0; i < JOBS; i++) {
		jobs[i] = (struct job){.task = {.run = run_job, .on_done = count_done},
				       .running = &running,
				       .max_running = &max_running,
				       .gate = &gate};
		thread_pool_add(c, &jobs[i].task);
	}
	while (atomic_load(&running) < 3)
		usleep(100);
	assert_false(thread_pool_remove(c, &jobs[0].task)); /* it is running */
	assert_true(thread_pool_remove(c, &jobs[50].task));
	assert_true(thread_pool_remove(c, &jobs[JOBS - 1].task));
	assert_false(thread_pool_remove(c, &jobs[50].task));
	assert_int_equal(thread_pool_pending(c), JOBS - 2);
	thread_pool_add(c, &jobs[50].task); /* behind the others */
	atomic_store(&gate, 1);
	while (thread_pool_pending(c))
		uv_run(&loop, UV_RUN_ONCE);
	for (int i = 0; i < JOBS; i++)
		assert_int_equal(jobs[i].done_count, i != JOBS - 1);
	assert_false(pthread_equal(jobs[0].thread, loop_thread));
	assert_int_equal(atomic_load(&max_running), 3);
	thread_pool_close(c);
	uv_run(&loop, UV_RUN_DEFAULT);
	assert_int_equal(uv_loop_close(&loop), 0);
}

/* ---- cache ---- */

static void workers_share_a_cache_folder(void **state)
{
	(void)state;
	struct cache a, b, c;
	struct blob_hash h;
	struct blob_writer *w;
	struct error e;
	char path[128];
	snprintf(path, sizeof path, "%s/deep/er", temporary_folder);
	assert_int_equal(cache_open(&a, path, 1000, &e), 0);
	assert_int_equal(cache_open(&b, path, 1000, &e), 0);
	assert_int_equal(blob_hash_bytes("abc", 3, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, a.blobs, &h, 3, &e), 0);
	assert_int_equal(blob_write_append(w, "abc", 3, &e), 0);
	assert_int_equal(blob_write_commit(w, &e), 0);
	assert_false(blob_is_stored(b.blobs, &h, NULL)); /* each has a slot of its own */
	cache_close(&a);
	assert_int_equal(cache_open(&c, path, 1000, &e), 0); /* the free slot is used again, with its contents */
	assert_true(blob_is_stored(c.blobs, &h, NULL));
	cache_close(&b);
	cache_close(&c);
}

/* In /tmp any user can create the folder first, with files of the right names and wrong contents. */
static void cache_that_others_may_write_is_refused(void **state)
{
	(void)state;
	struct cache c;
	struct error e;
	char base[128], slot[160], lock[160];
	snprintf(base, sizeof base, "%s/base", temporary_folder);
	snprintf(slot, sizeof slot, "%s/slot-0", base);
	snprintf(lock, sizeof lock, "%s/slot-0.lock", base);
	assert_int_equal(mkdir(base, 0700), 0);
	assert_int_equal(mkdir(slot, 0700), 0);
	assert_int_equal(chmod(base, 0777), 0);
	assert_int_equal(cache_open(&c, base, 1000, &e), -EPERM);
	assert_non_null(strstr(e.text, "is writable for everybody"));
	assert_int_equal(chmod(base, 01777), 0);
	assert_int_equal(chmod(slot, 0777), 0);
	assert_int_equal(cache_open(&c, base, 1000, &e), -EPERM);
	assert_int_equal(chmod(slot, 0700), 0);
	assert_int_equal(cache_open(&c, base, 1000, &e), 0);
	cache_close(&c);
	unlink(lock);
	assert_int_equal(symlink("elsewhere", lock), 0);
	assert_true(cache_open(&c, base, 1000, &e) < 0);
	unlink(lock);
	if (geteuid() != 0 || (chown(slot, 65534, 65534) && errno == EINVAL)) /* no other user in this name space */
		return;
	assert_int_equal(cache_open(&c, base, 1000, &e), -EPERM);
	assert_non_null(strstr(e.text, "another user"));
	assert_int_equal(chown(slot, 0, 0), 0);
	assert_int_equal(chown(base, 65534, 65534), 0);
	assert_int_equal(cache_open(&c, base, 1000, &e), -EPERM);
}

/* ---- job cache ---- */

static void set_job_info(struct job_cache *b, const char *texts[], size_t count)
{
	Farm__JobInfo info;
	Farm__Plan plan;
	Farm__Envelope m;
	Farm__File files[4], *list[4];
	struct blob_hash hashes[4];
	struct envelope env;
	struct error e;
	unsigned char *frame;
	size_t size;
	char names[4][16];
	struct plan p;
	struct plan_request r = {.integrator = "path", .width = 8, .height = 8, .spp = 1, .max_depth = 3};
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_to_wire(&p, &plan);
	farm__job_info__init(&info);
	farm__envelope__init(&m);
	for (size_t i = 0; i < count; i++) {
		farm__file__init(&files[i]);
		snprintf(names[i], sizeof names[i], "f%zu", i);
		assert_int_equal(blob_hash_bytes(texts[i], strlen(texts[i]), &hashes[i], &e), 0);
		files[i].name = names[i];
		files[i].hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hashes[i].bytes};
		files[i].size = strlen(texts[i]);
		list[i] = &files[i];
	}
	info.scene = names[0];
	info.plan = &plan;
	info.n_files = count;
	info.files = list;
	m.body_case = FARM__ENVELOPE__BODY_JOB_INFO;
	m.job_info = &info;
	assert_int_equal(envelope_pack(&m, NULL, 0, &frame, &size, &e), 0);
	assert_int_equal(envelope_unpack(&env, frame + 8, size - 8, &e), 0);
	assert_int_equal(job_cache_set_info(b, &env, &e), 0);
	mem_free(frame);
}

static void store_text(struct cache *c, const char *text)
{
	struct blob_hash h;
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, c->blobs, &h, strlen(text), &e), 0);
	assert_int_equal(blob_write_append(w, text, strlen(text), &e), 0);
	assert_int_equal(blob_write_commit(w, &e), 0);
	blob_release(c->blobs, &h);
}

static void on_built(struct job_cache *b)
{
	assert_true(b->state == JOB_CACHE_READY || b->state == JOB_CACHE_FAILED);
}

static const bool never_stop = false;
static unsigned read_count;

static void on_read(struct job_cache *b)
{
	(void)b;
	read_count++;
}

/* Files of an earlier run are read before use, and not on the loop's thread: the damaged file is fetched again. */
static void files_of_an_earlier_run_are_read_before_use(void **state)
{
	(void)state;
	struct cache cache;
	struct job_cache *b;
	struct error e;
	uv_loop_t loop;
	char command[200];
	const char *texts[] = {"<scene>", "second file"};
	assert_int_equal(uv_loop_init(&loop), 0);
	assert_int_equal(cache_open(&cache, temporary_folder, 1000, &e), 0);
	store_text(&cache, texts[0]);
	store_text(&cache, texts[1]);
	cache_close(&cache);
	snprintf(command, sizeof command, "for f in $(grep -l second -r %s); do printf damaged >$f; done",
		 temporary_folder);
	assert_int_equal(system(command), 0);
	assert_int_equal(cache_open(&cache, temporary_folder, 1000, &e), 0);
	assert_int_equal(job_cache_new(&b, 5, cache.blobs, &e), 0);
	set_job_info(b, texts, 2);
	b->reading.stop_requested = &never_stop;
	b->reading.on_done = on_read;
	for (unsigned i = 0; i < 2; i++) {
		read_count = 0;
		assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_BEING_READ);
		assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_BEING_READ);
		assert_int_equal(read_count, 0);
		uv_run(&loop, UV_RUN_DEFAULT);
		assert_int_equal(read_count, 1);
	}
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_MISSING);
	assert_true(b->is_held[0] && !b->is_held[1]);
	store_text(&cache, texts[1]);
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILES_COMPLETE);
	job_cache_free(b);
	assert_int_equal(uv_loop_close(&loop), 0);
	cache_close(&cache);
}

static void job_cache_asks_for_each_missing_file(void **state)
{
	(void)state;
	struct cache cache;
	struct job_cache *b;
	struct error e;
	struct thread_pool *thread_pool;
	uv_loop_t loop;
	const char *texts[] = {"<scene>", "second file", "<scene>", ""};
	struct blob_hash first;
	assert_int_equal(cache_open(&cache, temporary_folder, 1000, &e), 0);
	assert_int_equal(job_cache_new(&b, 5, cache.blobs, &e), 0);
	set_job_info(b, texts, 4);
	assert_int_equal(blob_hash_bytes(texts[0], 7, &first, &e), 0);
	assert_int_equal(uv_loop_init(&loop), 0);
	b->reading.stop_requested = &never_stop;
	b->reading.on_done = on_read;
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_MISSING);
	assert_true(blob_hash_equal(&b->wanted_file, &first));
	store_text(&cache, texts[0]);
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_MISSING);
	assert_false(blob_hash_equal(&b->wanted_file, &first));
	store_text(&cache, texts[1]);
	/* The third equals the first; the empty one is missing. */
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILE_MISSING);
	store_text(&cache, texts[3]);
	assert_int_equal(job_cache_check_files(b, &loop), JOB_CACHE_FILES_COMPLETE);
	/* The scene is invalid: building it fails with a message. */
	assert_int_equal(thread_pool_new(&thread_pool, &loop, 1, &e), 0);
	b->on_built = on_built;
	assert_int_equal(job_cache_build(b, thread_pool, &e), 0);
	while (b->state == JOB_CACHE_BUILDING)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(b->state, JOB_CACHE_FAILED);
	assert_non_null(strstr(b->error.text, "f0"));
	job_cache_free(b);
	thread_pool_close(thread_pool);
	uv_run(&loop, UV_RUN_DEFAULT);
	assert_int_equal(uv_loop_close(&loop), 0);
	cache_close(&cache);
}

/* ---- fingerprint ---- */

static void fingerprint_is_stable(void **state)
{
	(void)state;
	char a[FINGERPRINT_MAX], b[FINGERPRINT_MAX];
	fingerprint_make(a);
	fingerprint_make(b);
	assert_string_equal(a, b);
	assert_non_null(strstr(a, "build="));
	assert_non_null(strstr(a, "embree"));
	assert_non_null(strstr(a, "libc="));
	assert_true(strlen(a) < FINGERPRINT_MAX - 1); /* not truncated */
	assert_true(fingerprint_self_test() == fingerprint_self_test());
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pool_runs_tasks_and_returns_them_on_the_loop),
		cmocka_unit_test_setup_teardown(workers_share_a_cache_folder, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(cache_that_others_may_write_is_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_cache_asks_for_each_missing_file, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(files_of_an_earlier_run_are_read_before_use, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test(fingerprint_is_stable),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
