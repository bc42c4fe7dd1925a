# SPDX-License-Identifier: Apache-2.0
# Sorts the attempts that tls.sh writes ("tried|WHAT" before, "refused|WHAT" or "cut off|WHAT" after) by kind, and
# prints a row "KIND|HOW|TRIED|REFUSED" for each kind, in this order. The exit code is 1 if an attempt belongs to no
# kind, or was not refused.
function kind_of(what) {
	if (what ~ /without TLS|no certificate|HTTP|port without/) return "no certificate, or no TLS"
	if (what ~ /another authority|trusts this farm/) return "a certificate of another authority"
	if (what ~ /^a (worker|client|coordinator).s certificate/) return "wrong role"
	if (what ~ /expire/) return "expired"
	if (what ~ /revoked/) return "revoked"
	if (what ~ /key that everybody/) return "a key in the open"
	if (what ~ /somebody else|^its /) return "jobs of somebody else"
	if (what ~ /quota|without a bound/) return "beyond a quota"
	return substr(what, 1, index(what, ":") - 1)
}

BEGIN {
	FS = "|"
	count = split("no certificate, or no TLS;a certificate of another authority;wrong role;expired;revoked;a key in the open;jobs of somebody else;oversized;replayed;out of order;invalid scene files;path tricks;a scene sent past the client;beyond a quota", order, ";")
	for (i = 1; i <= count; i++)
		place[order[i]] = i
}

$1 == "tried" {
	k = kind_of($2)
	if (!(k in place)) {
		print "of no kind: " $2
		bad = 1
	}
	what = $2
	sub(/^[a-z ]*: /, "", what)
	tried[k]++
	how[k] = how[k] (how[k] ? "; " : "") what
}

$1 == "refused" || $1 == "cut off" { refused[kind_of($2)]++ }

END {
	for (i = 1; i <= count; i++) {
		k = order[i]
		printf "%s|%s|%d|%d\n", k, how[k], tried[k], refused[k]
		bad = bad || !tried[k] || tried[k] != refused[k]
	}
	exit bad
}
