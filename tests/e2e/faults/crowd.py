# SPDX-License-Identifier: Apache-2.0
"""crowd.py PORT: opens 2,000 connections that send nothing until they are disconnected; meanwhile 2,000 more send, 500 each, a
hello of another version, a hello with a wrong bit, garbage, or half a header. Prints "idle", then "gone", then "done"."""
import socket, sys
from wire import VERSION, hello


def call():
    return socket.create_connection(("127.0.0.1", int(sys.argv[1])), 60)


idle = [call() for _ in range(2000)]
print("idle", flush=True)
damaged = bytearray(hello(2, b"passer-by"))
damaged[16] ^= 1
words = [hello(2, b"passer-by", version=VERSION + 1), damaged, b"GET / HTTP/1.0\r\n\r\n", b"\0\0\0"]
for k in range(2000):
    s = call()
    s.sendall(words[k % 4])
    try:
        while k % 4 < 2 and s.recv(4096):  # until it is refused
            pass
    except ConnectionError:
        pass
    s.close()
print("gone", flush=True)
for s in idle:
    s.settimeout(60)
    try:
        while s.recv(4096):
            pass
    except ConnectionError:
        pass
print("done", flush=True)
