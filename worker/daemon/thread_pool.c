/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/thread_pool.h"

#include "common/base/mem.h"
#include "common/base/liveness.h"

#include <pthread.h>
#include <signal.h>
#include <string.h>

struct queue {
	struct task *first, **last;
};

struct thread_pool {
	uv_async_t finished_async;
	pthread_mutex_t lock;
	pthread_cond_t work_available;
	struct queue waiting_tasks, finished_tasks;
	unsigned pending_count, thread_count;
	bool is_stopping;
	pthread_t threads[];
};

static void queue_push(struct queue *q, struct task *t)
{
	t->next = NULL;
	*q->last = t;
	q->last = &t->next;
}

static struct task *queue_pop(struct queue *q)
{
	struct task *t = q->first;
	if (t) {
		q->first = t->next;
		if (!q->first)
			q->last = &q->first;
	}
	return t;
}

static void *thread_main(void *user)
{
	struct thread_pool *c = user;
	pthread_mutex_lock(&c->lock);
	for (;;) {
		struct task *t = NULL;
		while (!c->is_stopping && !(t = queue_pop(&c->waiting_tasks)))
			pthread_cond_wait(&c->work_available, &c->lock);
		if (!t)
			break;
		pthread_mutex_unlock(&c->lock);
		liveness_counter = &t->ticks;
		liveness_tick();
		t->run(t);
		liveness_counter = NULL;
		pthread_mutex_lock(&c->lock);
		queue_push(&c->finished_tasks, t);
		uv_async_send(&c->finished_async);
	}
	pthread_mutex_unlock(&c->lock);
	return NULL;
}

static void on_tasks_finished(uv_async_t *a)
{
	struct thread_pool *c = a->data;
	for (;;) {
		pthread_mutex_lock(&c->lock);
		struct task *t = queue_pop(&c->finished_tasks);
		pthread_mutex_unlock(&c->lock);
		if (!t)
			return;
		c->pending_count--;
		t->on_done(t);
	}
}

static void on_closed(uv_handle_t *h)
{
	mem_free(h->data);
}

void thread_pool_close(struct thread_pool *c)
{
	pthread_mutex_lock(&c->lock);
	c->is_stopping = true;
	pthread_cond_broadcast(&c->work_available);
	pthread_mutex_unlock(&c->lock);
	for (unsigned i = 0; i < c->thread_count; i++)
		pthread_join(c->threads[i], NULL);
	pthread_mutex_destroy(&c->lock);
	pthread_cond_destroy(&c->work_available);
	uv_close((uv_handle_t *)&c->finished_async, on_closed);
}

int thread_pool_new(struct thread_pool **out, uv_loop_t *loop, unsigned threads, struct error *e)
{
	struct thread_pool *c = mem_alloc(1, sizeof *c + threads * sizeof *c->threads);
	if (!c)
		return error_set(e, ENOMEM, "no memory for %u threads", threads);
	int rc = uv_async_init(loop, &c->finished_async, on_tasks_finished);
	if (rc) {
		mem_free(c);
		return error_set(e, -rc, "no event loop: %s", uv_strerror(rc));
	}
	c->finished_async.data = c;
	c->waiting_tasks.last = &c->waiting_tasks.first;
	c->finished_tasks.last = &c->finished_tasks.first;
	pthread_mutex_init(&c->lock, NULL);
	pthread_cond_init(&c->work_available, NULL);
	sigset_t all, before;
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	for (; !rc && c->thread_count < threads; c->thread_count += !rc)
		rc = pthread_create(&c->threads[c->thread_count], NULL, thread_main, c);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	if (rc) {
		thread_pool_close(c);
		return error_set(e, rc, "%u threads cannot be created: %s", threads, strerror(rc));
	}
	*out = c;
	return 0;
}

void thread_pool_add(struct thread_pool *c, struct task *t)
{
	atomic_store(&t->ticks, 0);
	pthread_mutex_lock(&c->lock);
	queue_push(&c->waiting_tasks, t);
	pthread_cond_signal(&c->work_available);
	pthread_mutex_unlock(&c->lock);
	c->pending_count++;
}

bool thread_pool_remove(struct thread_pool *c, struct task *t)
{
	bool found = false;
	pthread_mutex_lock(&c->lock);
	for (struct task **at = &c->waiting_tasks.first; *at; at = &(*at)->next)
		if (*at == t) {
			*at = t->next;
			if (!*at)
				c->waiting_tasks.last = at;
			found = true;
			break;
		}
	pthread_mutex_unlock(&c->lock);
	c->pending_count -= found;
	return found;
}

unsigned thread_pool_pending(const struct thread_pool *c)
{
	return c->pending_count;
}
