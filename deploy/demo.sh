#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, and renders the demo scene on a farm of two workers on this machine: one of the two
# commands of the README. The picture: build/demo/demo.png and demo.exr. Nothing that it starts is left running.
set -eu
cd "$(dirname "$0")/.."
case "${1:-}" in
"") ;;
-h | --help)
	sed -n '2,3s/^# \{0,1\}//p' "$0"
	exit 0
	;;
*)
	echo "demo.sh: unknown option '$1' (try --help)" >&2
	exit 2
	;;
esac
sh deploy/setup.sh
echo "building, a minute or two ..."
make -s -j"$(nproc 2>/dev/null || echo 2)" programs
exec make -s demo
