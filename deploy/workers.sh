#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Starts (or stops) hslt-worker on named hosts over ssh.
set -eu

usage() {
	cat <<'TEXT'
Usage: deploy/workers.sh [OPTION...] HOST...
Starts hslt-worker on each HOST over ssh (user@host works), in the background, with its log on that host: one per host, whose
process id is in ~/.hslt-worker.HOSTNAME.pid there.

  -c, --coordinator HOST:PORT  the coordinator, as the hosts reach it (or $HSLT_COORDINATOR)
  -t, --threads N              render threads (all cores of the host)
  -p, --path PROGRAM           name or path of hslt-worker on the hosts (hslt-worker); if it has another name, give it to --stop, too
  -l, --log FILE               log on the hosts (~/hslt-worker.log)
  -k, --tls DIR                the certificate's folder on the hosts (hslt-ca worker NAME makes one; deploy/README.md)
  -i, --insecure               without TLS, even if the coordinator is on another host
  -s, --stop                   stop the workers that this script started there (SIGTERM: they finish their epochs)
  -n, --dry-run                only print what would be done
  -h, --help

Examples:
  deploy/workers.sh -c farm.lan:7700 --tls .hslt-node node1 node2 node3
  deploy/workers.sh --stop node1

$SSH is the ssh command (ssh -o BatchMode=yes). Exit code: 0 done on all hosts, 1 failed on some, 2 usage.
TEXT
}

die() {
	echo "workers.sh: $*" >&2
	exit 2
}

# quote WORD: quotes a word for the shell on the host
quote() {
	printf "'%s'" "$(printf %s "$1" | sed "s/'/'\\\\''/g")"
}

coordinator=${HSLT_COORDINATOR:-}
threads= program=hslt-worker log= tls= insecure= stop= dry=
while [ $# -gt 0 ]; do
	case $1 in
	-c | --coordinator | -t | --threads | -p | --path | -l | --log | -k | --tls)
		[ $# -ge 2 ] || die "$1 needs a value"
		case $1 in
		-c | --coordinator) coordinator=$2 ;;
		-t | --threads) threads=$2 ;;
		-p | --path) program=$2 ;;
		-l | --log) log=$2 ;;
		-k | --tls) tls=$2 ;;
		esac
		shift 2
		;;
	-i | --insecure) insecure=1 && shift ;;
	-s | --stop) stop=1 && shift ;;
	-n | --dry-run) dry=1 && shift ;;
	-h | --help) usage && exit 0 ;;
	--) shift && break ;;
	-*) die "unknown option $1 (see --help)" ;;
	*) break ;;
	esac
done
[ $# -gt 0 ] || die "no host is given (see --help)"
[ -n "$stop" ] || [ -n "$coordinator" ] || die "--coordinator HOST:PORT is needed (or \$HSLT_COORDINATOR)"
case $threads in
*[!0-9]*) die "--threads takes a number" ;;
esac

# Commands for the host. Its pid file is named after the host, because hosts may share home directories; and since process ids
# are reused, the process counts only if it is an hslt-worker of this user.
remote="f=~/.hslt-worker.\$(hostname).pid; is_running() { p=\$(cat \"\$f\" 2>/dev/null) && readlink \"/proc/\$p/exe\" >/dev/null 2>&1 &&"
remote="$remote case \$(cat \"/proc/\$p/comm\") in hslt-worker | $(quote "$(basename "$program" | cut -c 1-15)")) ;; *) false ;; esac; };"
if [ -n "$stop" ]; then
	remote="$remote if is_running; then kill \"\$p\" && rm -f \"\$f\" && echo stopped; else rm -f \"\$f\"; echo 'this script has started no worker here' >&2; exit 1; fi"
else
	command="$(quote "$program") --coordinator $(quote "$coordinator")"
	[ -z "$threads" ] || command="$command --threads $threads"
	[ -z "$tls" ] || command="$command --tls $(quote "$tls")"
	[ -z "$insecure" ] || command="$command --insecure"
	target='~/hslt-worker.log'
	[ -z "$log" ] || target=$(quote "$log")
	remote="$remote if is_running; then echo \"this script has started a worker here already (process \$p): use --stop first\" >&2; exit 1; fi;"
	remote="$remote nohup $command --name \"\$(hostname)\" >>$target 2>&1 </dev/null & echo \$! >\"\$f\";"
	remote="$remote sleep 1; kill -0 \"\$(cat \"\$f\")\" && echo started || { tail -n 3 $target; exit 1; }"
fi

failed=0
for host in "$@"; do
	echo "$host: $remote"
	[ -z "$dry" ] || continue
	# shellcheck disable=SC2086 # $SSH is a command with its options
	${SSH:-ssh -o BatchMode=yes} "$host" "$remote" || {
		echo "$host: failed" >&2
		failed=1
	}
done
exit $failed
