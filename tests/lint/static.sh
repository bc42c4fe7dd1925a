# SPDX-License-Identifier: Apache-2.0
# Static analysis of the product's code by cppcheck: errors, warnings and portability. Its false positives are listed in static.txt, with
# reasons; static.cfg declares macros of libraries. First cppcheck has to find a planted fault.
cd "$(dirname "$0")/../.." || exit 1
if ! command -v cppcheck > /dev/null; then
	echo "cppcheck is not installed"
	exit 77
fi
check() {
	cppcheck --quiet --error-exitcode=1 --std=c11 --enable=warning,portability -D_GNU_SOURCE -I. -j "$(nproc)" --max-configs=1 \
		--suppressions-list=tests/lint/static.txt --library=tests/lint/static.cfg "$@"
}
planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
cat > "$planted/fault.c" << 'FAULT'
int last(void);
int last(void)
{
	int numbers[4] = {0};
	return numbers[4];
}
FAULT
if check "$planted/fault.c" 2> /dev/null; then
	echo "WRONG: cppcheck does not find an index out of bounds"
	exit 1
fi
check common coordinator worker || exit 1
echo "ok: cppcheck finds nothing"
