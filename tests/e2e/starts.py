# SPDX-License-Identifier: Apache-2.0
"""Starts of workers by hand: starts.py PORT fails if a later start of a worker does not replace the open connection of the
earlier start, if an earlier start is accepted after a later one, or if different workers replace each other."""
import os, socket, sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "faults"))
import wire
from wire import field


def hello(name, home, start):
    """Returns the connection, and the first message received."""
    s = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
    s.settimeout(60)
    s.sendall(wire.hello(1, name, field(4, b"by hand") + field(5, 1) + field(6, start) + field(7, home)))
    return s, s.recv(4096)


def expect(what, heard, sentence):
    if sentence not in heard:
        sys.exit(f"{what}: it says {heard!r}")


def is_open(s):
    s.settimeout(0.3)
    try:
        return s.recv(4096) != b""
    except socket.timeout:
        return True


first, heard = hello(b"w", b"ab12", 5)
later, heard = hello(b"other", b"ab12", 6)
expect("the earlier start", first.recv(4096), b"the same worker has reconnected")
stale, heard = hello(b"w", b"ab12", 5)
expect("a start before", heard, b"its start 6 has connected before")
again, heard = hello(b"other", b"ab12", 6)
expect("the same start on its old connection", later.recv(4096), b"the same worker has reconnected")
elsewhere, heard = hello(b"other", b"cd34", 1)
nowhere, heard = hello(b"other", b"", 0)
for what, s in (("the same start", again), ("one name, another home", elsewhere), ("one name, no home", nowhere)):
    if not is_open(s):
        sys.exit(f"{what} is disconnected")
expect("a home of words", hello(b"w", b"../home", 1)[1], b"out of bounds")
expect("a home that is too long", hello(b"w", b"0" * 40, 1)[1], b"out of bounds")
