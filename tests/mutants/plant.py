# SPDX-License-Identifier: Apache-2.0
"""Plants a fault: plant.py FILE OLD NEW prints FILE with OLD replaced by NEW; plant.py --check LIST prints the faults of a list
that cannot be planted. OLD must occur exactly once. White space is ignored, because the formatter breaks lines."""
import re
import sys


def pattern(old):
    tokens = re.findall(r"\w+|[^\w\s]", old)
    out = re.escape(tokens[0])
    for before, token in zip(tokens, tokens[1:]):
        both_words = re.match(r"\w", before) and re.match(r"\w", token)
        out += (r"\s+" if both_words else r"\s*") + re.escape(token)
    return re.compile(out)


def plant(path, old, new):
    """Returns the text with the fault; None: OLD does not occur exactly once."""
    with open(path) as f:
        text, count = pattern(old).subn(lambda _: new, f.read())
    return text if count == 1 else None


def check(path):
    wrong = 0
    with open(path) as f:
        for line in f:
            if line.startswith("#") or not line.strip():
                continue
            file, old, new, _ = line.rstrip("\n").split("\t")
            try:
                there = plant(file, old, new)
            except OSError as e:
                there, old = None, e
            if there is None:
                print(f"{file}: '{old}' does not stand there once")
                wrong = 1
    return wrong


if len(sys.argv) == 3 and sys.argv[1] == "--check":
    sys.exit(check(sys.argv[2]))
if len(sys.argv) != 4:
    sys.exit(__doc__)
result = plant(*sys.argv[1:])
if result is None:
    sys.exit(1)
sys.stdout.write(result)
