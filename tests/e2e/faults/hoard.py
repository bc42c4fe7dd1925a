# SPDX-License-Identifier: Apache-2.0
"""hoard.py PORT FINGERPRINT: a worker of that fingerprint that claims 4,096 threads, takes all leases that it gets, sends heartbeats,
and returns no result; if it is disconnected, because the machine stood still, it reconnects. Prints a line for each lease."""
import socket, sys, time
from wire import field, frame, hello


def hoard(s):
    """Runs until the worker is disconnected."""
    s.sendall(hello(1, b"hoarder", field(4, sys.argv[2].encode()) + field(5, 4096)))
    s.sendall(frame(field(20, field(1, 4097))))
    s.settimeout(0.1)
    heard = b""
    first = 8  # bytes before the header: the first frame has only its lengths
    said = 0
    while True:
        if time.monotonic() > said + 0.1:
            s.sendall(frame(field(3, b"")))
            said = time.monotonic()
        try:
            got = s.recv(1 << 16)
        except socket.timeout:
            continue
        if not got:
            return
        heard += got
        while len(heard) >= first:
            size = first + int.from_bytes(heard[:4], "big") + int.from_bytes(heard[4:8], "big")
            if len(heard) < size:
                break
            if heard[first:first + 2] == b"\xaa\x01":  # Envelope.lease_grant = 21
                print("lease", flush=True)
            heard, first = heard[size:], 16


while True:
    try:
        with socket.create_connection(("127.0.0.1", int(sys.argv[1]))) as s:
            hoard(s)
    except OSError:
        pass
    time.sleep(0.1)
