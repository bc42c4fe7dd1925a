#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs the packages that building and testing need, with apt (Debian 12 or 13, or a system like them).
# Prints what it installs; does nothing if nothing is missing.
#
#   sh deploy/setup.sh            packages for `make` and `make test`
#   sh deploy/setup.sh --full     also those for the longer kinds of tests: clang for fuzzers, valgrind for profiles, Slurm
#                                 and checkers of units and manifests for deploy/ (Debian starts munge when it is installed)
set -eu

build="make gcc libc6-dev pkg-config libembree-dev libopenexr-dev libuv1-dev libprotobuf-c-dev protobuf-c-compiler
protobuf-compiler libssl-dev libexpat1-dev zlib1g-dev libpng-dev libjpeg62-turbo-dev libwebp-dev libmeshoptimizer-dev gltfpack libjansson-dev libsqlite3-dev librandom123-dev libcmocka-dev python3
gnuplot-nox"
full="clang clang-format-14 cppcheck libclang-rt-dev valgrind socat strace slurm-wlm munge systemd systemd-container python3-kubernetes debootstrap locales"

case "${1:-}" in
"") wanted=$build ;;
--full) wanted="$build $full" ;;
-h | --help)
	sed -n '3,/^set /s/^# \{0,1\}//p' "$0"
	exit 0
	;;
*)
	echo "setup.sh: unknown option '$1' (try --help)" >&2
	exit 2
	;;
esac

if ! command -v dpkg-query >/dev/null 2>&1 || ! command -v apt-get >/dev/null 2>&1; then
	echo "setup.sh: this system has no apt; install the equivalents of:" $wanted >&2
	exit 1
fi

missing=""
for p in $wanted; do
	[ "$(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null)" = installed ] || missing="$missing $p"
done
[ -n "$missing" ] || exit 0

root=""
if [ "$(id -u)" != 0 ]; then
	if ! command -v sudo >/dev/null 2>&1; then
		echo "setup.sh: run as root, or install sudo; missing:$missing" >&2
		exit 1
	fi
	root=sudo
fi
echo "setup.sh: installing$missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
install() {
	$root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing >"$log" 2>&1
}
# apt's lists may be missing or outdated: they are fetched only if the first attempt fails.
if ! install; then
	if ! $root apt-get update >"$log" 2>&1 || ! install; then
		tail -n 20 "$log" >&2
		echo "setup.sh: the packages could not be installed" >&2
		exit 1
	fi
fi
