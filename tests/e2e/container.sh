# SPDX-License-Identifier: Apache-2.0
# deploy/container without a container engine: carries out its Containerfile line by line in two fresh Debians, and runs
# a small farm there as the image's user; then deploy/systemd, booted by systemd-nspawn. Takes minutes and downloads, so
# it runs only with FULL=1, as by deploy/test.sh --full; the daily tests and CI list it as skipped.
. "$(dirname "$0")/lib.sh"
need_debians
TREE=$(cd "$HERE/../.." && pwd)
FILE=$TREE/deploy/container/Containerfile
SUITE=$(sed -n 's/^FROM .*debian:\([a-z]*\)-slim.*/\1/p' "$FILE" | sort -u)
[ "$(echo "$SUITE" | wc -w)" = 1 ] || fail "which Debian? $SUITE"

fresh_debian "$SUITE" "$DIR/base"
stage=0 user=
while read -r word rest; do
	case $word in
	FROM)
		stage=$((stage + 1))
		ROOT=$DIR/stage$stage
		cp -a "$DIR/base" "$ROOT"
		;;
	COPY)
		to=${rest##* }
		mkdir -p "$ROOT$to"
		for from in ${rest% *}; do
			[ -d "$TREE/$from" ] && from=$from/.
			cp -a "$TREE/$from" "$ROOT$to"
		done
		;;
	RUN)
		case $rest in
		--mount=type=bind,from=build,source=/out,target=/out\ *)
			rest=${rest#* }
			cp -a "$DIR/stage1/out" "$ROOT/out"
			;;
		--*) fail "what is $rest?" ;;
		esac
		inside "$ROOT" "$rest" || fail "RUN $rest"
		;;
	USER) user=$rest ;;
	'' | '#'* | CMD) ;;
	*) fail "what is $word?" ;;
	esac
done <"$FILE"
[ $stage = 2 ] && [ -n "$user" ] || fail "$stage stages, user '$user'"
rm -rf "$ROOT/out"
[ ! -e "$ROOT/usr/bin/gcc" ] || fail "the image has a compiler"
mkdir "$ROOT/scenes"
cp -r "$HERE/../scenes/box" "$ROOT/scenes/"
inside "$ROOT" 'cd /tmp
	hslt-render /scenes/box/box.xml -o one.exr --integrator hslt --bootstrap 20000 --mutations 60000
	hslt-coordinator --listen 127.0.0.1:0 --port-file port --spool /var/lib/hslt/spool & coordinator=$!
	until [ -s port ]; do sleep 0.1; done
	export HSLT_COORDINATOR=127.0.0.1:$(cat port)
	hslt-worker --threads 1 --cache /var/cache/hslt & worker=$!
	hslt-submit /scenes/box/box.xml -o two.exr --integrator hslt --bootstrap 20000 --mutations 60000 --wait
	kill $worker $coordinator
	wait $worker
	wait $coordinator
	hslt-compare --exact one.exr two.exr' "$user" || fail "the farm in the image"
echo "image: $(du -sxm "$ROOT" | cut -f1) MB, $(wc -l <"$DIR/stage1/out/packages") packages of libraries"

# ---- the units, under a running systemd ----

command -v systemd-nspawn >/dev/null || { echo "the units were not booted: no systemd-nspawn"; exit 0; }
inside "$ROOT" 'apt-get update -qq; DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends systemd systemd-sysv dbus' ||
	fail "no systemd in the image"
cp "$TREE"/deploy/systemd/*.service "$TREE"/deploy/systemd/*.socket "$ROOT/etc/systemd/system/"
printf '%s\n' '[Unit]' 'After=multi-user.target' '[Service]' 'ExecStart=sh /try' '[Install]' 'WantedBy=multi-user.target' \
	>"$ROOT/etc/systemd/system/try.service"
# Over TLS: each service reads the folder that its settings name, with a group of its unit's.
inside "$ROOT" 'export HSLT_CA=/root/ca
	hslt-ca init
	hslt-ca worker node
	hslt-ca client root
	mkdir -p /etc/hslt
	cp -r /root/ca/coordinator /etc/hslt/tls
	cp -r /root/ca/node /etc/hslt/tls-node
	chgrp -R hslt /etc/hslt/tls /etc/hslt/tls-node
	chmod 750 /etc/hslt/tls /etc/hslt/tls-node
	chmod 640 /etc/hslt/tls/key.pem /etc/hslt/tls-node/key.pem
	echo HSLT_TLS=/etc/hslt/tls >/etc/hslt/coordinator.conf
	echo HSLT_TLS=/etc/hslt/tls-node >/etc/hslt/worker.conf
	for u in hslt-coordinator hslt-worker@; do
		mkdir -p /etc/systemd/system/$u.service.d
		printf "[Service]\nSupplementaryGroups=hslt\n" >/etc/systemd/system/$u.service.d/tls.conf
	done' || fail "no certificates"
cat >"$ROOT/try" <<'TEXT'
set -eux
exec >/tried 2>&1
trap 'systemctl poweroff' EXIT
until [ "$(systemctl is-active hslt-coordinator.socket hslt-coordinator.service hslt-worker@1.service | grep -cx active)" = 3 ]; do
	sleep 0.2
done
pid() {
	systemctl show -P MainPID "$1"
}
for s in hslt-coordinator hslt-worker@1; do
	[ "$(sed -n 's/^Uid:[[:space:]]*\([0-9]*\).*/\1/p' /proc/$(pid $s)/status)" != 0 ]
	grep -q '^NoNewPrivs:.1$' /proc/$(pid $s)/status
	grep -q '^Seccomp:.2$' /proc/$(pid $s)/status
	grep -q '^CapBnd:.0*$' /proc/$(pid $s)/status
done
export HSLT_COORDINATOR=127.0.0.1:7700 HSLT_TLS=/root/ca/root HSLT_STATUS_SOCKET=/run/hslt/status
[ "$(stat -c %a /run/hslt/status)" = 600 ]
hslt-status
cd /root
hslt-render /scenes/box/box.xml -o one.exr --integrator hslt --bootstrap 20000 --mutations 60000
hslt-submit /scenes/box/box.xml -o two.exr --integrator hslt --bootstrap 20000 --mutations 60000 --wait
hslt-compare --exact one.exr two.exr
journalctl --no-pager -u hslt-coordinator | grep -q 'event=listen .*tls=yes'
journalctl --no-pager -u hslt-coordinator | grep -q 'event=peer_hello .*certificate=node'
HSLT_TLS= hslt-job list && exit 1 # nobody without a certificate
# A blocked loop is detected by the watchdog; finished jobs are still there afterwards.
mkdir -p /run/systemd/system/hslt-coordinator.service.d
printf '[Service]\nWatchdogSec=3\n' >/run/systemd/system/hslt-coordinator.service.d/try.conf
systemctl daemon-reload
systemctl restart hslt-coordinator
kill -STOP "$(pid hslt-coordinator)"
for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do
	[ "$(systemctl show -P NRestarts hslt-coordinator)" = 0 ] || break
	sleep 1
done
[ "$(systemctl show -P NRestarts hslt-coordinator)" = 1 ]
journalctl --no-pager -u hslt-coordinator | grep -q 'Watchdog timeout'
hslt-status | grep -q '^j1 *done'
systemctl stop hslt-worker@1
[ "$(systemctl show -P Result hslt-worker@1)" = success ]
echo all is well
TEXT
for u in try hslt-coordinator.service hslt-coordinator.socket hslt-worker@1; do
	systemctl --root="$ROOT" enable "$u" >>"$DIR/inside.log" 2>&1 || fail "systemctl enable $u"
done
timeout -k 5 120 systemd-nspawn --register=no --keep-unit -D "$ROOT" --boot --private-network --console=pipe </dev/null >"$DIR/boot.log" 2>&1 ||
	fail "systemd-nspawn ended with $?"
tail -n 1 "$ROOT/tried" | grep -q 'systemctl poweroff' && grep -qx 'all is well' "$ROOT/tried" || fail "the units: $(cat "$ROOT/tried")"
echo "units: started, confined, watched, over TLS"
