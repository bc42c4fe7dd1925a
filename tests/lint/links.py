# SPDX-License-Identifier: Apache-2.0
"""links.py FILE...: prints each link of these Markdown files that leads nowhere: no such file, or no such heading in it."""
import os
import re
import sys


def text_of(path):
    """Without blocks of code, in which # begins a comment."""
    with open(path) as f:
        return re.sub(r"^```.*?^```", "", f.read(), flags=re.M | re.S)


def anchors_of(path):
    """As GitHub names headings: letters, digits, - and _ of the text in lower case, - for a space; a second one has -1."""
    seen, anchors = {}, set()
    for title in re.findall(r"^#+ +(.*)$", text_of(path), re.M):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        name = re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        anchors.add(name + ("-%d" % seen[name] if name in seen else ""))
        seen[name] = seen.get(name, 0) + 1
    return anchors


def main():
    bad = 0
    for page in sys.argv[1:]:
        for link in re.findall(r"\]\(([^)\s]+)\)", text_of(page)):
            if re.match(r"\w+:", link):
                continue
            path, _, anchor = link.partition("#")
            target = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
            if not os.path.exists(target):
                print("%s: %s is not there" % (page, link))
            elif anchor and target.endswith(".md") and anchor not in anchors_of(target):
                print("%s: %s has no heading %s" % (page, target, anchor))
            else:
                continue
            bad = 1
    return bad


sys.exit(main())
