/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator that starts on a damaged spool. The first byte says which file is damaged and how: the file's whole
 * content, changes at some places, or content behind valid checksums. The coordinator may refuse to start, begin a job
 * anew or fail it; if it starts, it must answer.
 */
#include "common/base/mem.h"
#include "common/base/checked_file.h"
#include "common/wire/batch_wire.h"
#include "coordinator/store/journal.h"
#include "coordinator/store/ledger.h"
#include "proto/stored.pb-c.h"
#include "tests/fuzz/farm_world.h"
#include "tests/fuzz/folders.h"
#include "tests/fuzz/seeds.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum damage_kind {
	RECORD,
	JOURNAL,
	JOURNAL_CHANGED,
	JOURNAL_BODIES,
	CHECKPOINT_CHANGED,
	CHECKPOINT_BODY,
	DATABASE_CHANGED,
	SUBMISSION,
	ASIDE,
	OLD_ROW,
	DAMAGE_KINDS
};
enum { EDIT_BYTES = 4, EDITS_MAX = 32, SEED_BYTES_MAX = 16000, FILE_BYTES_MAX = 1 << 20 };

static uint8_t file_bytes[FILE_BYTES_MAX];

static size_t load_file(const char *path)
{
	FILE *f = fopen(path, "rb");
	size_t n = f ? fread(file_bytes, 1, sizeof file_bytes, f) : 0;
	if (f)
		fclose(f);
	return n;
}

static void write_file(const char *path, const void *bytes, size_t size)
{
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(bytes, 1, size, f) != size || fclose(f))
		abort();
}

static void make_spool_path(const char *spool, const char *name, char path[512])
{
	snprintf(path, 512, "%s/%s", spool, name);
}

/* The path of the journal of the job in its bootstrap, which has no checkpoint yet. */
static void journal_path(const char *spool, char path[512])
{
	snprintf(path, 512, "%s/jobs/j%d/journal.0", spool, FARM_JOB_BOOTSTRAP);
}

/* Each edit: u24 BE position, one byte to xor. */
static void apply_edits(const uint8_t *edits, size_t size, uint8_t *bytes, size_t count)
{
	for (size_t i = 0; i + EDIT_BYTES <= size && i < EDIT_BYTES * EDITS_MAX && count; i += EDIT_BYTES) {
		size_t at = (size_t)edits[i] << 16 | (size_t)edits[i + 1] << 8 | edits[i + 2];
		bytes[at % count] ^= edits[i + 3];
	}
}

static void change_file(const char *path, const uint8_t *edits, size_t size)
{
	size_t n = load_file(path);
	apply_edits(edits, size, file_bytes, n);
	write_file(path, file_bytes, n);
}

static void write_checked(const char *path, const void *bytes, size_t size)
{
	struct checked_file s;
	struct error e;
	unlink(path);
	if (checked_file_create(&s, path, &e) || checked_file_write(&s, bytes, size, &e) || checked_file_finish(&s, &e))
		abort();
	checked_file_close(&s);
}

/* Each record: kind, u16 BE size, body. */
static void write_journal(const char *spool, const uint8_t *bytes, size_t size)
{
	char path[512], folder[512];
	struct journal *j;
	struct error e;
	journal_path(spool, path);
	unlink(path);
	snprintf(folder, sizeof folder, "%s/jobs/j%d", spool, FARM_JOB_BOOTSTRAP);
	if (journal_create(&j, folder, FARM_JOB_BOOTSTRAP, 0, &e))
		abort();
	while (size > 3) {
		size_t n = (size_t)bytes[1] << 8 | bytes[2];
		n = n < size - 3 ? n : size - 3;
		journal_append(j, (enum journal_kind)(*bytes % 5), NULL, *bytes, bytes + 3, n, NULL, &e);
		bytes += 3 + n;
		size -= 3 + n;
	}
	journal_release(j);
}

/* Writes the submission and plan of a new job, as the database would hold them; the first two bytes say where the first
 * one ends. */
static void write_submission(const char *spool, const uint8_t *bytes, size_t size)
{
	struct ledger *l;
	struct error e;
	size_t first = size < 2 ? 0 : (size_t)bytes[0] << 8 | bytes[1];
	if (size < 2)
		return;
	bytes += 2;
	size -= 2;
	first = first < size ? first : size;
	struct ledger_job job = {.id = 9,
				 .owner = "",
				 .name = "n",
				 .version = "1",
				 .record = "",
				 .submitted = 1,
				 .submission = bytes,
				 .submission_size = first,
				 .plan = bytes + first,
				 .plan_size = size - first};
	if (ledger_open(&l, spool, &e))
		abort();
	ledger_add(l, &job, &e);
	ledger_close(l);
}

static void damage_spool(const char *spool, enum damage_kind kind, const uint8_t *bytes, size_t size)
{
	char path[512];
	size_t n;
	switch (kind) {
	case RECORD: /* of a job that an earlier version finished */
		make_spool_path(spool, "jobs/j7", path);
		mkdir(path, 0777);
		make_spool_path(spool, "jobs/j7/job.json", path);
		write_file(path, bytes, size);
		break;
	case OLD_ROW:
		make_spool_path(spool, "jobs/j7", path);
		mkdir(path, 0777);
		make_spool_path(spool, "jobs/j7/order", path);
		write_checked(path, bytes, size);
		break;
	case JOURNAL:
		journal_path(spool, path);
		write_file(path, bytes, size);
		break;
	case JOURNAL_CHANGED:
		journal_path(spool, path);
		change_file(path, bytes, size);
		break;
	case JOURNAL_BODIES:
		write_journal(spool, bytes, size);
		break;
	case CHECKPOINT_CHANGED:
		make_spool_path(spool, "jobs/j2/checkpoint", path);
		n = load_file(path);
		if (n < 4)
			abort();
		apply_edits(bytes, size, file_bytes, n - 4);
		write_checked(path, file_bytes, n - 4);
		break;
	case CHECKPOINT_BODY:
		make_spool_path(spool, "jobs/j2/checkpoint", path);
		write_checked(path, bytes, size);
		break;
	case DATABASE_CHANGED:
		make_spool_path(spool, "jobs.db", path);
		change_file(path, bytes, size);
		break;
	case ASIDE:
		make_spool_path(spool, "aside", path);
		write_file(path, bytes, size);
		break;
	default:
		write_submission(spool, bytes, size);
	}
}

static void send_requests(struct farm_world *w)
{
	Farm__JobList list;
	Farm__LeaseRequest request;
	Farm__Envelope m;
	farm__job_list__init(&list);
	farm__lease_request__init(&request);
	farm__envelope__init(&m);
	farm_world_connect(w, 0, false);
	farm_world_send_hello(w, 0, FARM__ROLE__ROLE_CLIENT);
	m.body_case = FARM__ENVELOPE__BODY_JOB_LIST;
	m.job_list = &list;
	farm_world_send_message(w, 0, &m, NULL, 0);
	farm_world_connect(w, 1, false);
	farm_world_send_hello(w, 1, FARM__ROLE__ROLE_WORKER);
	request.want = 20;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_REQUEST;
	m.lease_request = &request;
	farm_world_send_message(w, 1, &m, NULL, 0);
	farm_world_run_once(w);
	if (w->peers[0].fd < 0)
		abort();
	farm_world_settle(w);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct farm_world w = {0};
	struct error e;
	if (!size)
		return 0;
	snprintf(w.spool, sizeof w.spool, "%s/damaged", folders_base());
	farm_world_copy_spool(w.spool);
	damage_spool(w.spool, (enum damage_kind)(*bytes % DAMAGE_KINDS), bytes + 1, size - 1);
	if (farm_world_open(&w, &e) == 0) {
		send_requests(&w);
		farm_world_close(&w);
	}
	folders_remove(w.spool);
	return 0;
}

/* ---- seeds ---- */

static uint8_t seed_bytes[FILE_BYTES_MAX];

static void write_seed(enum damage_kind kind, size_t size)
{
	seed_bytes[0] = (uint8_t)kind;
	seed_write_file("spool", kind, seed_bytes, size + 1);
}

static size_t seed_size;

static int add_record(void *user, const struct journal_item *item, struct error *e)
{
	size_t size = item->body_size;
	(void)user;
	(void)e;
	if (item->damaged_count || size > 0xffff || seed_size + 3 + size > sizeof seed_bytes - 1)
		return 0;
	uint8_t *at = seed_bytes + 1 + seed_size;
	at[0] = (uint8_t)item->kind;
	at[1] = (uint8_t)(size >> 8);
	at[2] = (uint8_t)size;
	memcpy(at + 3, item->body, size);
	seed_size += 3 + size;
	return 0;
}

static size_t copy_file_to_seed(const char *path)
{
	size_t n = load_file(path);
	memcpy(seed_bytes + 1, file_bytes, n);
	return n;
}

/* Writes the files that an earlier version kept of such a job, as j7. */
static void write_old_seeds(const struct ledger_job *job)
{
	Stored__Row m;
	struct job_record *r = mem_alloc(1, sizeof *r);
	char *text;
	struct error e;
	stored__row__init(&m);
	m.id = 7;
	m.submission = (ProtobufCBinaryData){job->submission_size, file_bytes};
	m.plan = (ProtobufCBinaryData){job->plan_size, file_bytes + job->submission_size};
	memcpy(file_bytes, job->submission, job->submission_size);
	memcpy(file_bytes + job->submission_size, job->plan, job->plan_size);
	memcpy(seed_bytes + 1, "hsltO003", 8);
	write_seed(OLD_ROW, 8 + stored__row__pack(&m, seed_bytes + 9));
	if (!r)
		abort();
	record_init(r, 7, "n", "");
	strcpy(r->state, "done");
	if (record_to_json(r, &text, &e))
		abort();
	memcpy(seed_bytes + 1, text, strlen(text));
	write_seed(RECORD, strlen(text));
	mem_free(text);
	mem_free(r);
}

static void write_seeds(const char *spool)
{
	static const char aside[] =
		"{\"schema\":1,\"workers\":[{\"certificate\":\"\",\"name\":\"w1-0\",\"home\":\"h\",\"restarts\":2,\"why\":\"x\"}]}";
	memcpy(seed_bytes + 1, aside, sizeof aside - 1);
	write_seed(ASIDE, sizeof aside - 1);
	char path[512], folder[512];
	struct journal *j;
	struct ledger *l;
	struct ledger_job job;
	struct error e;
	struct journal_damage found;
	make_spool_path(spool, "jobs/j2/checkpoint", path);
	size_t n = copy_file_to_seed(path);
	if (n < 4)
		abort(); /* the world has no checkpoint */
	write_seed(CHECKPOINT_BODY, n - 4 < SEED_BYTES_MAX ? n - 4 : SEED_BYTES_MAX);
	journal_path(spool, path);
	write_seed(JOURNAL, copy_file_to_seed(path));
	for (int i = 0; i < 3; i++) {
		static const enum damage_kind changed[] = {JOURNAL_CHANGED, CHECKPOINT_CHANGED, DATABASE_CHANGED};
		memcpy(seed_bytes + 1, "\0\0\60\1", EDIT_BYTES);
		write_seed(changed[i], EDIT_BYTES);
	}
	snprintf(folder, sizeof folder, "%s/jobs/j%d", spool, FARM_JOB_BOOTSTRAP);
	if (journal_open(&j, folder, FARM_JOB_BOOTSTRAP, 0, add_record, NULL, &found, &e))
		abort();
	journal_release(j);
	write_seed(JOURNAL_BODIES, seed_size);
	if (ledger_open(&l, spool, &e) || ledger_read_row(l, FARM_JOB_BOOTSTRAP, &job, &e) <= 0)
		abort();
	write_old_seeds(&job);
	seed_bytes[1] = (uint8_t)(job.submission_size >> 8);
	seed_bytes[2] = (uint8_t)job.submission_size;
	memcpy(seed_bytes + 3, job.submission, job.submission_size);
	memcpy(seed_bytes + 3 + job.submission_size, job.plan, job.plan_size);
	write_seed(SUBMISSION, 2 + job.submission_size + job.plan_size);
	ledger_close(l);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	char spool[128];
	(void)argc;
	(void)argv;
	if (!seeds_are_requested())
		return 0;
	snprintf(spool, sizeof spool, "%s/seeds", folders_base());
	farm_world_copy_spool(spool);
	write_seeds(spool);
	exit(0);
}
