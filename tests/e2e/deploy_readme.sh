# SPDX-License-Identifier: Apache-2.0
# Runs the commands of deploy/README.md for a farm of several machines as they are written: each host is a home folder
# here, ssh and scp are shells and copies on this machine, and the coordinator listens on loopback only, at its own
# port. Its other commands have tests elsewhere, or need things that are missing here: demo.sh and crops.sh are tests by
# these names; services: install.sh and units.sh; Slurm: sbatch.sh and slurm.sh; the image: container.sh; Kubernetes:
# kubernetes.sh (against the API, without a cluster); a tunnel would need a running sshd.
. "$(dirname "$0")/lib.sh"
need hslt-ca hslt-coordinator hslt-worker hslt-submit hslt-status
ROOT=$(cd "$HERE/../.." && pwd)
BIN=$(cd "$BIN" && pwd)
mkdir "$DIR/bin"
cat >"$DIR/bin/ssh" <<TEXT
#!/bin/sh
# ssh [-o OPTION] HOST COMMAND
while [ "\$1" = -o ]; do shift 2; done
export HOME="$DIR/\$1"
cd "\$HOME" && exec sh -c "\$2"
TEXT
cat >"$DIR/bin/scp" <<TEXT
#!/bin/sh
# scp -r FROM HOST:TO
exec cp -r "\$2" "$DIR/\${3%%:*}/\${3#*:}"
TEXT
chmod +x "$DIR/bin/ssh" "$DIR/bin/scp"
free_ports 1

# commands AFTER: prints the indented lines that follow the one that begins with AFTER
commands() {
	awk -v after="$1" 'index($0, after) == 1 { on = 1; next }
		on && /^    / { begun = 1; print substr($0, 5); next }
		on && begun && NF { exit }' "$ROOT/deploy/README.md" | grep -v '^#'
}

answers() {
	"$BIN/hslt-status" --socket "$1" >/dev/null 2>&1
}

# at HOST FOLDER LINE: runs the line as typed at that host. Daemons continue in the background, and the next line waits
# until they are ready.
at() {
	line=$(echo "$3" | sed -e "s/0\.0\.0\.0:7700/127.0.0.1:$port/" -e "s/farm:7700/127.0.0.1:$port/")
	count=$((count + 1))
	case $line in
	hslt-coordinator* | hslt-worker*)
		(cd "$2" && HOME="$DIR/$1" exec sh -c "exec $line") >>"$DIR/daemons.log" 2>&1 &
		PIDS="$PIDS $!"
		case $line in
		hslt-coordinator*)
			coordinator=$!
			until_true 10 sh -c "grep -q ':$(printf '%04X' "$port") 00000000:0000 0A' /proc/net/tcp" || fail "the coordinator does not listen"
			;;
		esac
		;;
	*) (cd "$2" && HOME="$DIR/$1" exec sh -c "$line") >"$DIR/line.log" 2>&1 || fail "$1: $line" ;;
	esac
}

# farm_of AFTER HOST...: runs the commands of that block, each at the host of its prompt, those without a prompt at the
# first host
farm_of() {
	after=$1
	shift
	for host in "$@"; do
		rm -rf "${DIR:?}/$host"
		mkdir "$DIR/$host"
		cp "$ROOT/tests/scenes/box/box.xml" "$DIR/$host/room.xml"
		cp -r "$ROOT/tests/scenes/box/meshes" "$DIR/$host/"
		ln -s "$ROOT/deploy" "$DIR/$host/deploy"
	done
	first=$1 count=0
	commands "$after" >"$DIR/block"
	[ "$(grep -c . "$DIR/block")" -gt 3 ] || fail "deploy/README.md has lost the commands of $after"
	while read -r line; do
		[ -n "$line" ] || continue
		case $line in
		*'$ '*)
			# The host that makes the certificates copies them to the other hosts.
			for host in "$@"; do
				[ ! -d "$DIR/$first/.hslt-ca" ] || cp -r "$DIR/$first/.hslt-ca/." "$DIR/$host/"
			done
			at "${line%%\$ *}" "$DIR/${line%%\$ *}" "$(echo "$line" | sed 's/^[a-z0-9]*\$ *//')"
			;;
		*) at "$first" "$DIR/$first" "$line" ;;
		esac
	done <"$DIR/block"
	[ -s "$(find "$DIR"/*/ -maxdepth 2 -name room.exr | head -n 1)" ] || fail "no image: $after"
	for host in "$@"; do
		for p in "$DIR/$host"/.hslt-worker.*.pid; do
			[ ! -e "$p" ] || PIDS="$PIDS $(cat "$p")"
		done
		rm -f "$DIR/$host/room.exr"
	done
	kill "$coordinator"
	wait "$coordinator" 2>/dev/null || :
	echo "$count commands: $after"
}

export PATH="$DIR/bin:$BIN:$PATH" USER="${USER:-somebody}"
unset HSLT_TLS HSLT_COORDINATOR HSLT_INSECURE SSH
farm_of '**With TLS**' you farm node1 node2
farm_of '**On a trusted network**' you farm node1 node2 node3
farm_of 'certificates, one folder each:' farm node1 ann
