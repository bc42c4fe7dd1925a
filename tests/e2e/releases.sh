# SPDX-License-Identifier: Apache-2.0
# The Debian releases that the README names, each freshly installed and updated: setup, build, unit tests of the code
# that reads files through other libraries, the README's scene and its first farm. Their compilers and libraries differ
# from those of the daily tests (expat 2.9 of Debian 13 once broke the build). Takes minutes and downloads: runs only
# with FULL=1, as by deploy/test.sh --full.
. "$(dirname "$0")/lib.sh"
need_debians
TREE=$(cd "$HERE/../.." && pwd)
for suite in bookworm trixie; do
	ROOT=$DIR/$suite
	: >"$DIR/inside.log"
	fresh_debian $suite "$ROOT"
	# debootstrap installs no updates; libraries get new versions from the security archive.
	echo "deb http://deb.debian.org/debian-security $suite-security main" >>"$ROOT/etc/apt/sources.list"
	mkdir "$ROOT/tree"
	(cd "$TREE" && git ls-files -z | xargs -0 cp --parents -t "$ROOT/tree")
	inside "$ROOT" 'apt-get update -qq
		export HOME=/root # where a worker has its cache
		cd /tree
		sh deploy/setup.sh
		make -s -j"$(nproc)" WERROR=-Werror programs tests
		for t in worker/render/scene common/exr common/net worker/cli/plot coordinator/store; do
			HSLT_TEST_KINDS=unit sh tests/run.sh build $t
		done
		sh tests/e2e/readme.sh /tree/build
		sh tests/e2e/bits.sh /tree/build
		gcc -dumpfullversion >/version' || fail "Debian $suite: $(grep -m 3 'error:\|FAILED' "$DIR/inside.log" | tr '\n' ' ')"
	echo "$suite: $(grep -c '^ok ' "$DIR/inside.log") tests, gcc $(cat "$ROOT/version")"
	rm -rf --one-file-system "$ROOT"
done
