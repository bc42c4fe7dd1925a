#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The two steps that make an image, each run as root on a bare Debian 12 or 13. Containerfile combines them.
#
#   steps.sh build SOURCE OUT    installs the packages for building, builds, and leaves in OUT the programs, the names of the
#                                packages whose libraries they use, and this script
#   steps.sh install OUT         installs those packages and the programs, and creates the user hslt (10001)
set -eu

# libraries PROGRAM...: prints the names of the packages whose libraries the programs load
libraries() {
	ldd "$@" | sed -n 's/.*=> \(\/[^ ]*\) .*/\1/p' | sort -u | while read -r path; do
		# If /lib is a link to /usr/lib, a package may list the file under either name.
		owner=$(dpkg-query -S "$path" "/usr$path" "${path#/usr}" 2>/dev/null | head -n 1)
		[ -n "$owner" ] || { echo "steps.sh: no package has $path" >&2; exit 1; }
		echo "${owner%%:*}"
	done | sort -u
}

build() {
	source=$1 out=$2
	sh "$source/deploy/setup.sh"
	make -s -C "$source" -j"$(nproc 2>/dev/null || echo 2)" programs
	make -s -C "$source" install DESTDIR="$out" PREFIX=/usr/local
	strip "$out"/usr/local/bin/*
	libraries "$out"/usr/local/bin/* >"$out/packages"
	[ -s "$out/packages" ] || exit 1
	cp "$source/LICENSE" "$source/deploy/container/steps.sh" "$out/"
}

install_in() {
	out=$1
	apt-get update -qq
	DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $(cat "$out/packages")
	rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin
	cp "$out"/usr/local/bin/* /usr/local/bin/
	mkdir -p /usr/local/share/doc/hslt-farm
	cp "$out/LICENSE" /usr/local/share/doc/hslt-farm/
	groupadd --gid 10001 hslt
	useradd --uid 10001 --gid hslt --home-dir /var/lib/hslt --create-home --shell /usr/sbin/nologin hslt
	install -d -o hslt -g hslt -m 700 /var/cache/hslt
	for p in /usr/local/bin/hslt-*; do
		"$p" --version >/dev/null # fails if a library is missing
	done
}

case "${1:-} $#" in
"build 3") build "$2" "$3" ;;
"install 2") install_in "$2" ;;
*)
	sed -n '3,/^set /s/^# \{0,1\}//p' "$0" >&2
	exit 2
	;;
esac
