# SPDX-License-Identifier: Apache-2.0
"""picture.py PORT FOLDER: makes FOLDER/large.png, 140 KB that announce 16,000 x 16,000 pixels of one bit, and submits
FOLDER/box.xml by hand, so that no client program checks it before. Ends once the coordinator has all files."""
import hashlib, os, socket, struct, sys, zlib
from wire import field, frame, hello

SIDE = 16000


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


os.chdir(sys.argv[2])
with open("large.png", "wb") as f:
    f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIDE, SIDE, 1, 0, 0, 0, 0)))
    f.write(chunk(b"IDAT", zlib.compress(bytes((SIDE // 8 + 1) * SIDE), 1)) + chunk(b"IEND", b""))
names = ["box.xml", "meshes/wedge.obj", "large.png"]
contents = [open(n, "rb").read() for n in names]
hashes = [hashlib.sha256(c).digest() for c in contents]
# integrator, seed, width, height, ..., samples: as tests/e2e/intruder.py says it
plan = field(1, b"path") + field(2, 0) + field(3, 48) + field(4, 40) + field(9, 1) + field(11, 4) + field(15, 1) + field(16, 8)
files = b"".join(field(8, field(1, n.encode()) + field(2, h) + field(3, len(c))) for n, h, c in zip(names, hashes, contents))
s = socket.create_connection(("127.0.0.1", int(sys.argv[1])), 60)
s.sendall(hello(2, b"picture") + frame(field(40, field(1, b"large") + field(2, b"box.xml") + field(6, plan) + files)))
s.settimeout(60)


def read(n):
    got = b""
    while len(got) < n:
        piece = s.recv(n - len(got))
        if not piece:
            sys.exit(f"disconnected, after {got!r}")
        got += piece
    return got


def hear(prefix):
    """Returns the next message, skipping heartbeats, which are sent while an answer takes its time."""
    while True:
        message = read(struct.unpack(">I", read(prefix)[:4])[0])
        if message != b"\x1a\x00":
            return message


hear(8)  # the answer to hello
answer = hear(16)
for h, c in zip(hashes, contents):
    if h in answer:  # the coordinator misses its bytes
        s.sendall(frame(field(11, field(1, h) + field(3, len(c))), c))
if any(h in answer for h in hashes):
    answer = hear(16)
if not answer.startswith(b"\xca\x02") or b"\x08" not in answer[3:5]:  # SubmitAnswer, with a job
    sys.exit(f"it answers {answer!r}")
