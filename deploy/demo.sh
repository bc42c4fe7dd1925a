#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs missing packages, builds, and renders the demo scene with a coordinator and two workers on this machine: one of
# the two commands of the README. Writes build/demo/demo.png and demo.exr. Leaves nothing running that it has started.
set -eu
cd "$(dirname "$0")/.."
case "${1:-}" in
"") ;;
-h | --help)
	sed -n '3,/^set /s/^# \{0,1\}//p' "$0"
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
