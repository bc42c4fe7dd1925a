# SPDX-License-Identifier: Apache-2.0
"""throng.py PORT JOB FILE: 2,000 clients, most of which only listen. Prints the largest chunk of FILE that a worker gets meanwhile, and
how many submissions of 10,000 files each wait before one is refused; once they have gone, one more must be accepted."""
import hashlib, socket, struct, sys
from wire import field, frame, hello

PORT, JOB, FILE = int(sys.argv[1]), int(sys.argv[2]), open(sys.argv[3], "rb").read()


class Peer:
    def __init__(self, role, more=b""):
        self.s = socket.create_connection(("127.0.0.1", PORT), 120)
        self.s.sendall(hello(role, b"throng", more))
        self.buffer, self.prefix = b"", 8
        self.hear()
        self.prefix = 16

    def take(self, n):
        while len(self.buffer) < n:
            got = self.s.recv(1 << 20)
            if not got:
                sys.exit("the coordinator hung up")
            self.buffer += got
        out, self.buffer = self.buffer[:n], self.buffer[n:]
        return out

    def hear(self):
        """Returns message and payload."""
        m, p = struct.unpack(">II", self.take(self.prefix)[:8])
        return self.take(m), self.take(p)


def words(message):
    """Returns the fields of a message; of several with one number, the last."""
    out, i = {}, 0

    def number():
        nonlocal i
        n = shift = 0
        while True:
            n |= (message[i] & 127) << shift
            shift, i = shift + 7, i + 1
            if message[i - 1] < 128:
                return n

    while i < len(message):
        key = number()
        if key & 7 == 2:
            size = number()
            out[key >> 3] = message[i:i + size]
            i += size
        elif key & 7 == 0:
            out[key >> 3] = number()
        else:
            size = 8 if key & 7 == 1 else 4
            out[key >> 3] = message[i:i + size]
            i += size
    return out


clients = [Peer(2) for _ in range(2000)]
worker = Peer(1, field(4, b"none") + field(5, 1))
worker.s.sendall(frame(field(25, field(1, JOB))))
whole, largest = b"", 0
name = hashlib.sha256(FILE).digest()
while len(whole) < len(FILE):
    worker.s.sendall(frame(field(10, field(1, name) + (field(2, len(whole)) if whole else b""))))
    message, piece = worker.hear()
    while 11 not in words(message):
        message, piece = worker.hear()
    largest = max(largest, len(piece))
    whole += piece
if whole != FILE:
    sys.exit("the chunks are not the file")

plan = field(1, b"path") + field(3, 16) + field(4, 16) + field(7, 16) + field(8, 16) + field(9, 2) + field(11, 1) + field(15, 1) + field(16, 9)
files = b"".join(field(8, field(1, b"f%d" % k) + field(2, hashlib.sha256(b"%d" % k).digest()) + field(3, 9)) for k in range(10000))
submission = frame(field(40, field(1, b"many") + field(2, b"f0") + field(6, plan) + files))


def is_refused(client):
    client.s.sendall(submission)
    message, _ = client.hear()
    refusal = words(words(message)[41]).get(2, b"")
    if refusal and b"try again" not in refusal:
        sys.exit("it is refused: %s" % refusal)
    return refusal != b""


waiting = 0
while waiting < 400 and not is_refused(clients[waiting]):
    waiting += 1
print("chunk", largest, "waiting", waiting, flush=True)
for c in clients[:-1]:
    c.s.close()
for _ in range(1000):  # until the coordinator has noticed
    if not is_refused(clients[-1]):
        print("accepted")
        break
