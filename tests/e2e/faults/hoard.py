# SPDX-License-Identifier: Apache-2.0
"""hoard.py PORT FINGERPRINT: a worker of that fingerprint that claims 4,096 threads, takes all leases that it gets, says its heartbeats,
and answers nothing; until it is hung up on. Prints a line for each lease."""
import socket, sys
from wire import field, frame, hello

s = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
s.sendall(hello(1, b"hoarder", field(4, sys.argv[2].encode()) + field(5, 4096)))
s.sendall(frame(field(20, field(1, 4097))))
s.settimeout(0.1)
heard = b""
first = 8  # of the first frame the lengths alone
while True:
    try:
        got = s.recv(1 << 16)
        if not got:
            break
        heard += got
    except socket.timeout:
        s.sendall(frame(field(3, b"")))
    while len(heard) >= first:
        size = first + int.from_bytes(heard[:4], "big") + int.from_bytes(heard[4:8], "big")
        if len(heard) < size:
            break
        if heard[first:first + 2] == b"\xaa\x01":  # Envelope.lease_grant = 21
            print("lease", flush=True)
        heard, first = heard[size:], 16
