/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/crash_record.h"

#include "common/base/crash.h"
#include "common/base/text.h"

#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/mman.h>

/* The work of one thread. */
struct thread_work {
	atomic_bool is_busy; /* key and scene are valid */
	struct lease_key key;
	char scene[CRASH_RECORD_SCENE_SIZE];
};

struct shared {
	unsigned thread_count;
	atomic_uint entry_count; /* entries of `entries` that belong to a thread */
	/* Written by the first thread that receives a signal, which sets `signal_claimed` first, and `signal_number`
	 * last. */
	atomic_bool signal_claimed;
	atomic_int signal_number; /* of the signal that ended the process; 0: none */
	atomic_int hit_entry;	  /* the entry of the thread that received it; -1: a thread without work */
	char text[CRASH_TEXT_MAX];
	double short_period_seconds, short_until; /* length and end of the last period of short memory; 0: none yet */
	unsigned lost_count;
	struct lost_lease lost_leases[CRASH_RECORD_THREADS_MAX];
	struct thread_work entries[CRASH_RECORD_THREADS_MAX];
};

static struct shared *shared;
static _Thread_local struct thread_work *own_entry;

int crash_record_open(unsigned threads, struct error *e)
{
	void *at = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (at == MAP_FAILED)
		return error_set(e, ENOMEM, "no memory to share with the rendering process");
	shared = at;
	shared->thread_count = threads < CRASH_RECORD_THREADS_MAX ? threads : CRASH_RECORD_THREADS_MAX;
	atomic_store(&shared->hit_entry, -1);
	return 0;
}

static void record_signal(int number, const char *text)
{
	if (atomic_exchange(&shared->signal_claimed, true))
		return; /* another thread came first. Returning may end the process before that thread is done */
	atomic_store(&shared->hit_entry,
		     own_entry && atomic_load(&own_entry->is_busy) ? (int)(own_entry - shared->entries) : -1);
	memcpy(shared->text, text, sizeof shared->text);
	atomic_store(&shared->signal_number, number);
}

void crash_record_catch_signals(void)
{
	if (shared)
		crash_install_handler(record_signal);
}

void crash_record_begin(const struct lease_key *k, const char *scene)
{
	if (!shared)
		return;
	if (!own_entry) {
		unsigned i = atomic_fetch_add(&shared->entry_count, 1);
		if (i >= CRASH_RECORD_THREADS_MAX)
			return;
		own_entry = &shared->entries[i];
		crash_init_thread();
	}
	own_entry->key = *k;
	text_copy(own_entry->scene, sizeof own_entry->scene, scene);
	atomic_store(&own_entry->is_busy, true);
}

void crash_record_end(void)
{
	if (own_entry)
		atomic_store(&own_entry->is_busy, false);
}

static void add_lost_lease(const struct thread_work *w, const char *text, bool worker_at_fault)
{
	const struct lease_key *k = &w->key;
	if (shared->lost_count == CRASH_RECORD_THREADS_MAX)
		return;
	struct lost_lease *l = &shared->lost_leases[shared->lost_count++];
	*l = (struct lost_lease){.key = *k, .is_worker_at_fault = worker_at_fault};
	text_print(l->text, sizeof l->text,
		   "%s: the rendering process was ended by %s (j%llu, %s, group %u, part %u, epoch %llu)", w->scene,
		   text, (unsigned long long)k->job, k->kind == LEASE_BOOTSTRAP ? "bootstrap" : "render", k->group,
		   k->part, (unsigned long long)k->epoch);
}

/* Removes the leases that have been reported. */
static void drop_reported(void)
{
	unsigned kept = 0;
	for (unsigned i = 0; i < shared->lost_count; i++)
		if (!shared->lost_leases[i].is_reported)
			shared->lost_leases[kept++] = shared->lost_leases[i];
	shared->lost_count = kept;
}

unsigned crash_record_add_loss(int number, double now)
{
	int recorded_signal = atomic_load(&shared->signal_number),
	    hit = recorded_signal ? atomic_load(&shared->hit_entry) : -1;
	unsigned before;
	drop_reported();
	if (number == SIGKILL)
		crash_record_note_memory_short(now);
	before = shared->lost_count;
	if (recorded_signal || number)
		for (unsigned i = 0; i < CRASH_RECORD_THREADS_MAX; i++) {
			const struct thread_work *w = &shared->entries[i];
			if (atomic_load(&w->is_busy) && (hit < 0 || (unsigned)hit == i))
				add_lost_lease(w, recorded_signal ? shared->text : crash_signal_name(number),
					       !recorded_signal);
		}
	for (unsigned i = 0; i < CRASH_RECORD_THREADS_MAX; i++)
		atomic_store(&shared->entries[i].is_busy, false);
	atomic_store(&shared->entry_count, 0);
	atomic_store(&shared->signal_number, 0);
	atomic_store(&shared->hit_entry, -1);
	atomic_store(&shared->signal_claimed, false);
	return shared->lost_count - before;
}

bool crash_record_is_memory_short(double now)
{
	return shared && now < shared->short_until;
}

void crash_record_note_memory_short(double now)
{
	static const double first_period = 600, max_period = 19200;
	if (!shared)
		return;
	bool is_repeated = shared->short_period_seconds > 0 && now < shared->short_until + shared->short_period_seconds;
	if (!is_repeated)
		shared->short_period_seconds = first_period;
	else if (now >= shared->short_until && shared->short_period_seconds < max_period)
		shared->short_period_seconds *= 2;
	shared->short_until = now + shared->short_period_seconds;
}

struct lost_lease *crash_record_lost_lease_at(unsigned index)
{
	return shared && index < shared->lost_count ? &shared->lost_leases[index] : NULL;
}
