# deploy/container without a container engine: its Containerfile carried out line by line in two fresh Debians, and a small farm
# as the image's user. Minutes and downloads: only with FULL=1.
. "$(dirname "$0")/lib.sh"
[ "${FULL:-0}" != 0 ] || skip "downloads two Debians: FULL=1, or deploy/test.sh --full"
command -v debootstrap >/dev/null || skip "no debootstrap (deploy/setup.sh --full installs it)"
[ "$(id -u)" = 0 ] || skip "debootstrap wants root"
unshare --mount --pid --fork true 2>/dev/null || skip "no namespaces for mounts and processes here"
TREE=$(cd "$HERE/../.." && pwd)
FILE=$TREE/deploy/container/Containerfile
SUITE=$(sed -n 's/^FROM .*debian:\([a-z]*\)-slim.*/\1/p' "$FILE" | sort -u)
[ "$(echo "$SUITE" | wc -w)" = 1 ] || fail "which Debian? $SUITE"

# inside ROOT [USER] COMMAND: with /proc, with the network's names, with nothing of it left afterwards
inside() {
	unshare --mount --pid --fork --kill-child sh -c 'mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" && exec chroot \
		${3:+--userspec="$3"} "$1" /usr/bin/env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh -ec "$2"' \
		sh "$1" "$2" "${3:-}" >>"$DIR/inside.log" 2>&1
}

debootstrap --variant=minbase "$SUITE" "$DIR/base" "${HSLT_DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$DIR/debootstrap.log" 2>&1 ||
	skip "debootstrap: $(tail -n 1 "$DIR/debootstrap.log")"
cp /etc/resolv.conf /etc/hosts "$DIR/base/etc/"
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
