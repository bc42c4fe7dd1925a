# SPDX-License-Identifier: Apache-2.0
# Each fault of tests/mutants/list.txt can still be planted: the text that it replaces occurs in its file exactly once.
cd "$(dirname "$0")/../.." || exit 1
python3 tests/mutants/plant.py --check tests/mutants/list.txt || exit 1
echo "ok: each fault of tests/mutants/list.txt can be planted"
