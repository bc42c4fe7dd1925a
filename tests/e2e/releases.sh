# SPDX-License-Identifier: Apache-2.0
# The releases of Debian that the README names, each fresh, with its updates: setup, build, unit tests of what reads files through
# other libraries, the README's own scene and its first farm. Their compilers and libraries are others than those the project is
# written with (expat 2.9 of Debian 13 once ended the build). Minutes and downloads: only with FULL=1, as by deploy/test.sh --full.
. "$(dirname "$0")/lib.sh"
need_debians
TREE=$(cd "$HERE/../.." && pwd)
for suite in bookworm trixie; do
	ROOT=$DIR/$suite
	: >"$DIR/inside.log"
	fresh_debian $suite "$ROOT"
	# debootstrap knows no updates; security is where libraries get new versions.
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
