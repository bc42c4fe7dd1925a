/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/work.h"

#include "common/base/crash.h"
#include "common/base/text.h"

#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/mman.h>

/* The work of one thread. */
struct work {
	atomic_bool busy; /* key and scene are valid */
	struct lease_key key;
	char scene[WORK_SCENE];
};

struct shared {
	unsigned threads;
	atomic_uint taken; /* entries of `of` that belong to a thread */
	/* Written by the first thread that receives a signal, which sets `claimed` first, and `number` last. */
	atomic_bool claimed;
	atomic_int number; /* of the signal that ended the process; 0: none */
	atomic_int hit;	   /* the entry of the thread that received it; -1: a thread without work */
	char text[CRASH_TEXT];
	double short_seconds, short_until; /* length and end of the last period of short memory; 0: none yet */
	unsigned lost_count;
	struct lost_lease lost[WORK_THREADS];
	struct work of[WORK_THREADS];
};

static struct shared *shared;
static _Thread_local struct work *own;

int work_share(unsigned threads, struct error *e)
{
	void *at = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (at == MAP_FAILED)
		return error_set(e, ENOMEM, "no memory to share with the rendering process");
	shared = at;
	shared->threads = threads < WORK_THREADS ? threads : WORK_THREADS;
	atomic_store(&shared->hit, -1);
	return 0;
}

static void last_words(int number, const char *text)
{
	if (atomic_exchange(&shared->claimed, true))
		return; /* another thread came first. Returning may end the process before that thread is done */
	atomic_store(&shared->hit, own && atomic_load(&own->busy) ? (int)(own - shared->of) : -1);
	memcpy(shared->text, text, sizeof shared->text);
	atomic_store(&shared->number, number);
}

void work_catch(void)
{
	if (shared)
		crash_catch(last_words);
}

void work_begin(const struct lease_key *k, const char *scene)
{
	if (!shared)
		return;
	if (!own) {
		unsigned i = atomic_fetch_add(&shared->taken, 1);
		if (i >= WORK_THREADS)
			return;
		own = &shared->of[i];
		crash_thread();
	}
	own->key = *k;
	text_copy(own->scene, sizeof own->scene, scene);
	atomic_store(&own->busy, true);
}

void work_end(void)
{
	if (own)
		atomic_store(&own->busy, false);
}

static void add_lost_lease(const struct work *w, const char *text, bool machine)
{
	const struct lease_key *k = &w->key;
	if (shared->lost_count == WORK_THREADS)
		return;
	struct lost_lease *l = &shared->lost[shared->lost_count++];
	*l = (struct lost_lease){.key = *k, .own = machine};
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
		if (!shared->lost[i].reported)
			shared->lost[kept++] = shared->lost[i];
	shared->lost_count = kept;
}

unsigned work_lose(int number, double now)
{
	int said = atomic_load(&shared->number), hit = said ? atomic_load(&shared->hit) : -1;
	unsigned before;
	drop_reported();
	if (number == SIGKILL)
		work_memory_short(now);
	before = shared->lost_count;
	if (said || number)
		for (unsigned i = 0; i < WORK_THREADS; i++) {
			const struct work *w = &shared->of[i];
			if (atomic_load(&w->busy) && (hit < 0 || (unsigned)hit == i))
				add_lost_lease(w, said ? shared->text : crash_signal_name(number), !said);
		}
	for (unsigned i = 0; i < WORK_THREADS; i++)
		atomic_store(&shared->of[i].busy, false);
	atomic_store(&shared->taken, 0);
	atomic_store(&shared->number, 0);
	atomic_store(&shared->hit, -1);
	atomic_store(&shared->claimed, false);
	return shared->lost_count - before;
}

bool work_memory_was_short(double now)
{
	return shared && now < shared->short_until;
}

void work_memory_short(double now)
{
	static const double first = 600, longest = 19200;
	if (!shared)
		return;
	bool again = shared->short_seconds > 0 && now < shared->short_until + shared->short_seconds;
	if (!again)
		shared->short_seconds = first;
	else if (now >= shared->short_until && shared->short_seconds < longest)
		shared->short_seconds *= 2;
	shared->short_until = now + shared->short_seconds;
}

struct lost_lease *work_lost(unsigned index)
{
	return shared && index < shared->lost_count ? &shared->lost[index] : NULL;
}
