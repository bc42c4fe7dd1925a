# SPDX-License-Identifier: Apache-2.0
# Counts what happened to a job's results. Reads the coordinator's log of all its runs (-v), then the workers' logs (-v),
# and prints "LOST DOUBLED RESULTS AGAIN".
#   awk -v job=j1 -f count.awk coordinator.log w1.log ...
# The film of a run contains the results that the coordinator found on the disk when it started, and those that it merged
# from then on.
# LOST: acknowledged results that the coordinator had to merge again in a later run, or that the last film does not
# contain; and results that a worker was told were merged but that never were on the disk. A result that a run merged and
# lost before it was acknowledged is computed again and is no loss, nor is one that the coordinator took back, before or
# after it was on the disk.
# DOUBLED: how often a film contained a result beyond the first time. RESULTS: the number of results in the last film.
# AGAIN: for one chain, the largest number of epochs that were given out again because one worker, or one run of the
# coordinator, was lost. An epoch that is given to two workers at once, as at the end of a round, does not count.

function get(name) {
	return match($0, " " name "=[^ ]*") ? substr($0, RSTART + length(name) + 2, RLENGTH - length(name) - 2) : ""
}

function key(kind, epoch) {
	return kind " " get("group") " " get("part") " " epoch
}

function add(k, fresh) {
	if (!fresh)
		stored[k] = 1
	else if (!(k in film) && (k in stored))
		lost++
	if (k in film)
		doubled++
	film[k] = 1
}

/ event=start / && /program=hslt-coordinator/ {
	started = 1
	run++
	split("", unstored)
	split("", void)
}

/ event=(peer_closed|peer_accept) .*text=/ { gone[run, get("peer")] = 1 }

/ event=lease_granted / && get("job") == job {
	k = key(get("kind"), get("epoch"))
	if (k in holder && (split(holder[k], had, SUBSEP) && had[1] != run || holder[k] in gone)) {
		n = ++repeats[had[1] != run ? had[1] : holder[k], get("group"), get("part")]
		again = n > again ? n : again
	}
	holder[k] = run SUBSEP get("peer")
}

/ event=batch_/ && get("job") == job {
	event = get("event")
	if (event == "batch_acknowledged")
		told[key(get("kind"), get("epoch"))] = 1
	else if (event == "batch_stored") {
		k = key(get("kind"), get("epoch"))
		unstored[k]--
		if (void[k] > 0) # on the disk, but taken back before
			void[k]--
		else
			stored[k] = 1
	} else if (event == "batch_taken_back") {
		k = key(get("kind"), get("epoch"))
		void[k] = unstored[k]
		delete film[k]
		delete stored[k]
	} else if (event == "batch_restored" || event == "batch_merged") {
		if (started)
			split("", film)
		started = 0
		if (event == "batch_merged" && get("late") == "")
			unstored[key(get("kind"), get("epoch"))]++
		if (event == "batch_merged")
			add(key(get("kind"), get("epoch")), get("late") == "") # late: from the journal
		for (e = 0; event == "batch_restored" && e < get("epochs") + 0; e++)
			add(key(get("kind"), e))
		if (event == "batch_restored" && get("kind") == "render") # after the bootstrap
			add(key("bootstrap", 0))
	}
}

END {
	for (k in stored)
		lost += !(k in film)
	for (k in told)
		lost += !(k in stored)
	for (k in film)
		results++
	print lost + 0, doubled + 0, results + 0, again + 0
}
