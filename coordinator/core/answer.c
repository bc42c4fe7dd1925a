/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Handles a worker's answer to a lease: a result, a failure, or the lease returned unfinished.
 *
 * Happy path: answer_batch judges a result (judge_result). If it is the next epoch of its slot it is merged: the
 * action tells the shell to add it to the films, the worker is acknowledged, other copies of the lease are revoked,
 * and job_merge_epoch reports whether the round is complete. If the lease is verified, the result counts only once a
 * second worker has sent an equal one (verify_result). answer_stored_batch does the same for results read from a
 * journal.
 *
 * Failures: a verdict of VERDICT_REPEAT means that the lease was merged before; VERDICT_REFUSE that the result does not
 * count now, through no fault of the worker; VERDICT_FAULT that no correct worker sends such content, which counts
 * towards quarantine. A lease that failed (answer_lease_failed) makes its worker pause with the job; several workers
 * that fail alike end the job (failure_quorum.h), and refused chain states are settled in doubt.c.
 */
#include "coordinator/core/answer.h"

#include "common/base/text.h"
#include "coordinator/core/doubt.h"
#include "coordinator/core/failure_quorum.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/lost_holders.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/quarantine.h"
#include "coordinator/core/rounds.h"
#include "coordinator/core/verify.h"

#include <math.h>

enum { FAILED_ATTEMPTS_FATAL = 3 };

enum verdict { VERDICT_MERGE, VERDICT_NOTE, VERDICT_REPEAT, VERDICT_REFUSE, VERDICT_FAULT };

static struct slot *find_slot(const struct job *j, const struct lease_key *k)
{
	if ((k->kind != LEASE_BOOTSTRAP && k->kind != LEASE_RENDER) || k->group >= j->plan.groups ||
	    k->part >= j->plan.parts)
		return NULL;
	uint64_t limit = k->kind == LEASE_BOOTSTRAP ? 1 : j->plan.rounds;
	return k->epoch < limit ? job_get_slot(j, k->group, k->part) : NULL;
}

static bool is_next_lease(const struct job *j, const struct slot *s, const struct lease_key *k)
{
	return s && k->kind == j->kind && k->epoch == s->next_epoch;
}

/* Whether merging the slot's next epoch would complete the round. While the error of the complete rounds is being
 * estimated such a result is refused, because the prefix of the image must not change meanwhile. */
static bool would_complete_round(const struct job *j, const struct slot *s)
{
	return s->next_epoch == j->rounds && j->done_slot_count + 1 == j->slot_count;
}

static enum verdict judge_result(const struct peer *p, const struct job *j, const struct event *ev, const char **why)
{
	const struct lease_key *k = &ev->lease.key;
	*why = !p ? "unknown worker" : !j ? "no such job" : !job_is_live(j) ? "the job is over" : "";
	if (**why)
		return VERDICT_REFUSE;
	if (p->identity->is_quarantined) {
		*why = "the worker is quarantined: its results do not count";
		return VERDICT_REFUSE;
	}
	const struct slot *s = find_slot(j, k);
	if (!s) {
		*why = "not a lease of this job";
		return VERDICT_FAULT;
	}
	if (!ev->lease.is_valid) {
		*why = ev->text ? ev->text : "invalid content";
		return VERDICT_FAULT;
	}
	if (!job_accepts_class(j, p->class)) {
		*why = "the job belongs to workers with another fingerprint";
		return VERDICT_REFUSE;
	}
	if (k->kind != j->kind && k->kind == LEASE_RENDER) {
		*why = "the bootstrap is not complete";
		return VERDICT_REFUSE;
	}
	if (k->kind != j->kind || k->epoch < s->next_epoch) {
		*why = "merged already";
		return VERDICT_REPEAT;
	}
	if (j->pending_end != END_NONE)
		*why = "the job is ending";
	else if (k->epoch > s->next_epoch || s->next_epoch - j->rounds > 1)
		*why = "the epoch is not open";
	else if (j->is_estimating_error && would_complete_round(j, s))
		*why = "the job's error is being estimated";
	return **why ? VERDICT_REFUSE : VERDICT_MERGE;
}

static void add_ack_action(struct farm *f, const struct event *ev, enum ack ack, const char *text)
{
	text_copy(f->answer_text, sizeof f->answer_text, text);
	struct action *a = update_add(f, ACTION_ACKNOWLEDGE);
	a->peer = ev->peer;
	a->key = ev->lease.key;
	a->job = a->key.job;
	a->ack = ack;
	a->text = f->answer_text;
}

static void merge_result(struct farm *f, struct peer *p, struct job *j, struct slot *s, const struct event *ev,
			 bool verified)
{
	struct action *a = update_add(f, ACTION_MERGE_BATCH);
	a->peer = p->id;
	a->key = ev->lease.key;
	a->job = j->id;
	a->worker_id = p->identity->id;
	a->is_verified = verified;
	add_ack_action(f, ev, ACK_MERGED, "");
	struct lease *l = lease_find(s, p);
	double duration = l ? f->now - l->sent_at : NAN;
	double sent = l ? l->sent_at : -INFINITY;
	if (l)
		lease_drop(f, l);
	for (const struct lease *k = s->leases; k; k = k->next)
		/* A copy sent later has overtaken this one. */
		if (k->sent_at < sent && !k->is_delivered && !k->is_overdue)
			peer_note_lateness(f, k->peer);
	lease_revoke_slot(f, s);
	j->counts.verified += verified;
	if (verified)
		quarantine_judge_answers(f, j, s, &ev->lease.digest);
	doubt_settle(f, j, s, p->identity, &ev->lease.key);
	peer_note_success(f, p, j->id);
	if (!j->is_mixed)
		job_pin(j, p->class);
	j->progress_floor = job_progress(j, f->now);
	if (job_merge_epoch(j, s, f->now, duration))
		rounds_handle_round_done(f, j);
}

static void count_verdict(struct peer *p, struct job *j, enum verdict v)
{
	if (p) {
		p->repeats += v == VERDICT_REPEAT;
		p->refused += v == VERDICT_REFUSE || v == VERDICT_FAULT;
	}
	if (j) {
		j->counts.repeats += v == VERDICT_REPEAT;
		j->counts.refused += v == VERDICT_REFUSE || v == VERDICT_FAULT;
		j->counts.faults += v == VERDICT_FAULT;
	}
}

/* Decides a result of a verified lease, which is merged only if another worker has sent an equal one. */
static enum verdict verify_result(struct farm *f, struct job *j, struct slot *s, struct peer *p, const struct event *ev,
				  const char **why)
{
	/* A late answer may come from a class that the job no longer belongs to. It must not be compared with answers
	 * of another class. */
	if (!j->class && !verify_class_can_begin(f, j, p->class)) {
		*why = "the job is not pinned, and cannot be to a lone worker";
		return VERDICT_REFUSE;
	}
	job_pin(j, p->class);
	switch (proof_add_answer(j, s, p->identity, &ev->lease.digest)) {
	case VERIFY_AGREES:
		return VERDICT_MERGE;
	case VERIFY_NOTED:
		return VERDICT_NOTE;
	case VERIFY_DIFFERS:
	case VERIFY_HOPELESS:
		*why = "the result differs from another worker's";
		return VERDICT_NOTE;
	case VERIFY_REPEATED:
		*why = "the result waits for another worker's";
		return VERDICT_REPEAT;
	case VERIFY_CONTRADICTS:
		*why = "the result differs from the same worker's earlier one";
		return VERDICT_FAULT;
	}
	return VERDICT_FAULT;
}

/* Ends the job if VERIFY_ANSWERS_MAX workers gave as many different answers. Either the job's workers cannot compute
 * this lease reproducibly, or some are wrong in the same way each time, and a further answer would not help. */
static void fail_if_hopeless(struct farm *f, struct job *j, struct slot *s, const struct lease_key *k)
{
	char names[160], text[256];
	if (j->proofs[s - j->slots].count < VERIFY_ANSWERS_MAX)
		return;
	proof_format_names(j, s, names, sizeof names);
	text_print(text, sizeof text, "no two of %d workers agree on " LEASE_POSITION_FORMAT ": %s", VERIFY_ANSWERS_MAX,
		   LEASE_POSITION_VALUES(k), names);
	rounds_end_job(f, j, END_FAILED, text);
}

void answer_batch(struct farm *f, const struct event *ev)
{
	struct peer *p = farm_find_peer(f, ev->peer);
	struct job *j = farm_find_job(f, ev->lease.key.job);
	const char *why;
	enum verdict v = judge_result(p, j, ev, &why);
	struct slot *s = j && job_is_live(j) ? find_slot(j, &ev->lease.key) : NULL;
	bool verified = v == VERDICT_MERGE && proof_is_required(j, &ev->lease.key);
	if (verified)
		v = verify_result(f, j, s, p, ev, &why);
	if (v == VERDICT_MERGE) {
		merge_result(f, p, j, s, ev, verified);
		return;
	}
	count_verdict(p, j, v);
	add_ack_action(f, ev, v == VERDICT_NOTE ? ACK_NOTED : v == VERDICT_REPEAT ? ACK_REPEATED : ACK_REFUSED, why);
	struct lease *l = p && is_next_lease(j, s, &ev->lease.key) ? lease_find(s, p) : NULL;
	if (l)
		lease_drop(f, l);
	else if (v == VERDICT_NOTE)
		job_place_slot(j, s);
	if (v == VERDICT_FAULT)
		quarantine_note_fault(f, p, f->answer_text);
	if (v == VERDICT_NOTE)
		fail_if_hopeless(f, j, s, &ev->lease.key);
}

void answer_stored_batch(struct farm *f, const struct event *ev)
{
	const struct lease_key *k = &ev->lease.key;
	struct job *j = farm_find_job(f, k->job);
	struct slot *s = j && job_is_live(j) ? find_slot(j, k) : NULL;
	if (!is_next_lease(j, s, k) || s->next_epoch - j->rounds > 1 || j->pending_end != END_NONE ||
	    (j->is_estimating_error && would_complete_round(j, s)))
		return;
	struct action *a = update_add(f, ACTION_MERGE_BATCH);
	a->key = *k;
	a->job = j->id;
	a->is_verified = true; /* it met all requirements when it arrived */
	lease_revoke_slot(f, s);
	if (proof_is_required(j, k))
		quarantine_judge_answers(f, j, s, &ev->lease.digest);
	s->doubt = (struct doubt){0};
	j->progress_floor = job_progress(j, f->now);
	if (job_merge_epoch(j, s, f->now, NAN))
		rounds_handle_round_done(f, j);
}

bool answer_have_all_workers_failed(const struct farm *f, const struct job *j)
{
	uint32_t worker_count = 0;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state != PEER_ACTIVE || !job_accepts_class(j, p->class))
			continue;
		if (isinf(peer_backoff_end(p, j->id)) || peer_waits_for_memory(p, j->id))
			return false;
		worker_count++;
	}
	return worker_count > 0;
}

/* Nothing of the job was ever computed, and no connected worker is left that might compute it: there is nothing to
 * lose and nobody to wait for. Workers whose own machine is at fault do not count. */
static bool cannot_succeed(const struct farm *f, const struct job *j)
{
	return j->failed_attempts >= FAILED_ATTEMPTS_FATAL && answer_have_all_workers_failed(f, j);
}

/* Returns the slot whose next lease the event is about; NULL if the worker or job is unknown or this is not the next
 * lease. */
static struct slot *find_next_slot(const struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->lease.key.job);
	if (!farm_find_peer(f, ev->peer) || !j || !job_is_live(j))
		return NULL;
	struct slot *s = find_slot(j, &ev->lease.key);
	return is_next_lease(j, s, &ev->lease.key) ? s : NULL;
}

static struct lease *lease_held_by_sender(const struct farm *f, const struct event *ev)
{
	struct slot *s = find_next_slot(f, ev);
	return s ? lease_find(s, farm_find_peer(f, ev->peer)) : NULL;
}

/* Whether the refusal of the chain states concerns an earlier grant of this lease, so that the worker has, or will
 * get, a grant with the current states. */
static bool is_late_refusal(const struct slot *s, const struct event *ev)
{
	return ev->lease.has_bad_states && (ev->lease.has_outdated_states || s->doubt.starts_from_seeds);
}

/* Whether the lease was granted before the job's files were repaired: the failure is probably due to the damaged
 * files. */
static bool is_due_to_files(const struct lease *l, const struct event *ev)
{
	return l && !ev->lease.is_worker_at_fault && !ev->lease.has_bad_states && l->sent_at < l->job->files_changed_at;
}

/* Keeps the text of the failure, which the status shows. */
static void note_failure(struct farm *f, struct peer *p, struct job *j, const struct event *ev)
{
	text_copy(p->last_fault, sizeof p->last_fault, ev->text ? ev->text : "");
	text_print(f->answer_text, sizeof f->answer_text, "%s: %s", p->name, p->last_fault);
	if (!ev->lease.is_memory_full) /* this is no failure, and it passes: status.c reads the text from the worker */
		text_copy(j->explanation, sizeof j->explanation, f->answer_text);
}

void answer_lease_failed(struct farm *f, const struct event *ev)
{
	struct slot *s = find_next_slot(f, ev);
	if (s && is_late_refusal(s, ev))
		return;
	struct peer *p = farm_find_peer(f, ev->peer);
	struct lease *l = s ? lease_find(s, p) : NULL;
	/* A worker's supervisor may report, after reconnecting, a lease that ended the previous process. */
	bool was_lost = s && lost_holders_remove(&s->lost_holders, p->identity);
	if (!l && !was_lost)
		return;
	if (is_due_to_files(l, ev)) {
		lease_drop(f, l);
		return;
	}
	struct job *j = farm_find_job(f, ev->lease.key.job);
	if (l)
		lease_drop(f, l);
	if (l && ev->lease.has_bad_states && j->kind == LEASE_RENDER && j->plan.kind == PLAN_CHAINS &&
	    s->next_epoch > 0) {
		j->counts.failures++;
		doubt_handle_refusal(f, j, s, p, ev->lease.can_roll_back, ev->text ? ev->text : "");
		return;
	}
	if (ev->lease.is_worker_at_fault && ev->lease.is_memory_full) {
		peer_note_memory_full(f, p, j->id);
		note_failure(f, p, j, ev);
		return;
	}
	/* Several leases that fail at once count as one. */
	bool is_repeat = peer_backoff_end(p, j->id) > f->now && !peer_is_at_fault(p, j->id);
	peer_note_failure(f, p, j->id, ev->lease.is_worker_at_fault);
	note_failure(f, p, j, ev);
	j->counts.failures++;
	if (ev->lease.is_worker_at_fault) /* a fault of the worker's machine says nothing about the job */
		return;
	j->failed_attempts += !is_repeat;
	bool is_lease_fatal = failure_quorum_add(&s->failure_quorum, f, p->identity),
	     is_job_fatal = failure_quorum_add(&j->failure_quorum, f, p->identity);
	if (!is_lease_fatal && (job_has_answers(j) || !(is_job_fatal || cannot_succeed(f, j))))
		return;
	if (was_lost)
		owner_limit(j->owner, f->now);
	rounds_end_job(f, j, END_FAILED, f->answer_text);
}

void answer_batch_delivered(struct farm *f, const struct event *ev)
{
	struct lease *l = lease_held_by_sender(f, ev);
	if (l)
		lease_mark_delivered(f, l);
}

void answer_lease_returned(struct farm *f, const struct event *ev)
{
	struct lease *l = lease_held_by_sender(f, ev);
	if (l)
		lease_drop(f, l);
}

bool answer_failure_counts(const struct farm *f, uint64_t peer, const struct lease_key *k)
{
	const struct event ev = {.peer = peer, .lease = {.key = *k}};
	const struct slot *s = find_next_slot(f, &ev);
	const struct peer *p = farm_find_peer(f, peer);
	return s && (lease_find(s, p) || lost_holders_contain(&s->lost_holders, p->identity));
}

enum farm_delivery answer_judge_delivery(const struct farm *f, uint64_t peer, const struct lease_key *k)
{
	const struct event ev = {.peer = peer, .lease = {.key = *k}};
	const struct peer *p = farm_find_peer(f, peer);
	const struct job *j = farm_find_job(f, k->job);
	const struct lease *l = lease_held_by_sender(f, &ev);
	if (l && !l->is_delivered)
		return DELIVERY_AWAITED;
	bool open = p && !p->identity->is_quarantined && j && job_is_live(j) && j->pending_end == END_NONE &&
		    job_accepts_class(j, p->class);
	return open && is_next_lease(j, find_slot(j, k), k) ? DELIVERY_OPEN : DELIVERY_REFUSED;
}
