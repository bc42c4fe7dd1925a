/* SPDX-License-Identifier: Apache-2.0 */
/* A checkpoint file has the same bytes in every build and on every machine; version 004 is read; bytes that are no
 * checkpoint are refused even if their checksum fits, and nothing is allocated for the sizes that they claim. */
#include "coordinator/live_job/checkpoint_file.h"

#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "coordinator/live_job/stored.h"
#include "common/wire/envelope.h"
#include "tests/support/canvas_batches.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/golden.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { JOB = 5, GENERATION = 7, CHAINS = 4, PREFIX_SIZE = 12, FILE_SIZE_MAX = 1 << 20 };

/* After the head: four seeds, no chain states of the first part, two of the second, the version of the films. */
static const unsigned char golden_middle[] = {
	8, 7, 6, 5, 4, 3, 2, 1, 9, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 10, 0, 0, 0,
	0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0, 'a',  'b',  'c',  1,	0,    0,    0,	  'd',	2,  0, 0, 0,
};
enum {
	STATES_OFFSET = 8 * CHAINS,
	FIRST_STATE_SIZE_OFFSET = STATES_OFFSET + 8,
	SECOND_STATE_SIZE_OFFSET = FIRST_STATE_SIZE_OFFSET + 7,
	FILMS_OFFSET = sizeof golden_middle - 4
};

static struct error e;
static struct spool *spool;
static char path[SPOOL_PATH_MAX];
static unsigned char bytes[FILE_SIZE_MAX];

static struct live_job *make_job(void)
{
	struct plan p = canvas_test_plan(PLAN_CHAINS, 1, 1, 1, 2);
	Farm__Submit submit;
	Farm__Envelope m;
	struct envelope env;
	struct live_job *job;
	unsigned char *frame;
	const unsigned char *payload;
	size_t size, payload_size;
	farm__submit__init(&submit);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &submit;
	assert_int_equal(p.chains, CHAINS);
	assert_int_equal(envelope_pack(&m, NULL, 0, &frame, &size, &e), 0);
	assert_int_equal(
		envelope_unpack_frame(&env, FARM__ENVELOPE__BODY_SUBMIT, frame, size, &payload, &payload_size, &e), 0);
	assert_int_equal(live_job_new(&job, JOB, &env, &p, "", 1, spool, &e), 0);
	mem_free(frame);
	return job;
}

static struct chain_state make_state(const char *text)
{
	struct chain_state s = {mem_alloc(strlen(text), 1), (uint32_t)strlen(text)};
	memcpy(s.bytes, text, s.size);
	return s;
}

/* Writes a checkpoint and reads its bytes; sets *size. Returns the size of the part before the seeds. */
static size_t write_file(size_t *size)
{
	static const uint64_t seeds[CHAINS] = {0x0102030405060708, 9, UINT64_MAX, 10};
	struct live_job *job = make_job();
	struct checkpoint_head h = {.job = JOB, .generation = GENERATION, .worker_count = 3, .cpu_seconds = 1.5};
	struct checked_file f;
	memcpy(job->seeds, seeds, sizeof seeds);
	job->states[1] = mem_alloc(2, sizeof *job->states[1]);
	job->states[1][0] = make_state("abc");
	job->states[1][1] = make_state("d");
	assert_int_equal(canvas_new(&job->canvas, &job->plan, canvas_grid_exponent(&job->plan, 0, 0), NULL, &e), 0);
	assert_int_equal(checked_file_create(&f, path, &e), 0);
	assert_int_equal(checkpoint_write(job, &h, &f, &e), 0);
	assert_int_equal(checked_file_finish(&f, &e), 0);
	live_job_free(job);
	FILE *in = fopen(path, "rb");
	assert_non_null(in);
	*size = fread(bytes, 1, sizeof bytes, in);
	assert_int_equal(*size, f.bytes_written);
	fclose(in);
	*size -= 4;
	return PREFIX_SIZE + get32(bytes + 8);
}

/* Loads the first `size` bytes; *job is the loaded job, which the caller frees. */
static int load_bytes(struct live_job **job, size_t size)
{
	struct checked_file f;
	uint64_t generation = 0;
	golden_write_and_open(&f, path, bytes, size);
	checked_file_close(&f);
	*job = make_job();
	int rc = checkpoint_load(spool, *job, &generation, NULL, NULL, &e);
	assert_true(rc || generation == GENERATION);
	return rc;
}

static void assert_refused(size_t size, int code)
{
	struct live_job *job;
	assert_int_equal(load_bytes(&job, size), code);
	live_job_free(job);
}

static int set_up(void **state)
{
	char name[128];
	int rc = temporary_folder_set_up(state);
	snprintf(name, sizeof name, "%s/spool", temporary_folder);
	if (rc || spool_open(&spool, name, &e) || spool_create_job_folder(spool, JOB, &e))
		return -1;
	spool_job_path(spool, JOB, "checkpoint", path);
	return 0;
}

static int tear_down(void **state)
{
	spool_close(spool);
	spool = NULL;
	return temporary_folder_tear_down(state);
}

static void assert_loaded(const struct live_job *job, double cpu_seconds)
{
	assert_int_equal(job->worker_count, 3);
	assert_true(job->record.cpu_seconds == cpu_seconds);
	assert_true(job->seeds[0] == 0x0102030405060708 && job->seeds[2] == UINT64_MAX && job->seeds[3] == 10);
	assert_null(job->states[0]);
	assert_true(job->states[1][0].size == 3 && job->states[1][1].size == 1);
	assert_memory_equal(job->states[1][0].bytes, "abc", 3);
	assert_int_equal(*job->states[1][1].bytes, 'd');
	assert_int_equal(canvas_complete_rounds(job->canvas), 0);
}

static void bytes_of_files_never_change(void **state)
{
	(void)state;
	struct live_job *job;
	size_t size, seeds = write_file(&size);
	assert_memory_equal(bytes, "hsltC005", 8);
	assert_memory_equal(bytes + seeds, golden_middle, sizeof golden_middle);
	assert_int_equal(load_bytes(&job, size), 0);
	assert_loaded(job, 1.5);
	live_job_free(job);
	/* Replaces the head by that of version 004, whose first 16 bytes are magic number, size and worker_count. */
	enum { OLD_HEAD_SIZE = 16 + STORED_OLD_HEAD_SIZE };
	memmove(bytes + OLD_HEAD_SIZE, bytes + seeds, size - seeds);
	memset(bytes, 0, OLD_HEAD_SIZE);
	memcpy(bytes, "hsltC004", 8);
	put32(bytes + 8, OLD_HEAD_SIZE);
	put32(bytes + 12, 3);
	put64(bytes + 16, JOB);
	put64(bytes + 24, GENERATION);
	put_double(bytes + 32, 2.5);
	assert_int_equal(load_bytes(&job, OLD_HEAD_SIZE + size - seeds), 0);
	assert_loaded(job, 2.5);
	live_job_free(job);
	assert_refused(OLD_HEAD_SIZE - 1, -EBADMSG);
	bytes[16]++;
	assert_refused(OLD_HEAD_SIZE + size - seeds, -EBADMSG);
	put32(bytes + 8, OLD_HEAD_SIZE + 8);
	assert_refused(OLD_HEAD_SIZE + size - seeds, -EPROTO);
}

static void cut_and_longer_files_are_refused(void **state)
{
	(void)state;
	size_t size, seeds = write_file(&size);
	for (size_t cut = 0; cut < seeds + sizeof golden_middle; cut += cut < 16 || cut + 4 > seeds ? 1 : 13)
		assert_refused(cut, -EBADMSG);
	assert_refused(size - 1, -EBADMSG);
	for (size_t more = 1; more < 200000; more *= 7) {
		memset(bytes + size, 0, more);
		assert_refused(size + more, -EBADMSG);
	}
}

/* Any flipped bit before the head gives another version or another size. Also sizes of states that no chain has. */
static void files_with_wrong_sizes_are_refused(void **state)
{
	(void)state;
	size_t size, seeds = write_file(&size);
	for (int bit = 0; bit < 8 * PREFIX_SIZE; bit++) {
		struct live_job *job;
		bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
		int rc = load_bytes(&job, size);
		assert_true(rc == -EPROTO || rc == -EBADMSG);
		live_job_free(job);
		bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
	}
	static const uint32_t sizes[] = {0, 1217 /* paths have up to 8 edges */, 1u << 31, UINT32_MAX};
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		put32(bytes + seeds + FIRST_STATE_SIZE_OFFSET, sizes[i]);
		assert_refused(size, -EBADMSG);
		put32(bytes + seeds + FIRST_STATE_SIZE_OFFSET, 3);
		put32(bytes + seeds + SECOND_STATE_SIZE_OFFSET, sizes[i]);
		assert_refused(size, -EBADMSG);
		put32(bytes + seeds + SECOND_STATE_SIZE_OFFSET, 1);
	}
	put32(bytes + seeds + FILMS_OFFSET, 3);
	assert_refused(size, -EPROTO);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(bytes_of_files_never_change, set_up, tear_down),
		cmocka_unit_test_setup_teardown(cut_and_longer_files_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(files_with_wrong_sizes_are_refused, set_up, tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
