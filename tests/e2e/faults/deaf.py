# SPDX-License-Identifier: Apache-2.0
"""deaf.py PORT JOB STATUS-SOCKET: a client that asks for a job's log again and again, a worker that asks for the job, and a reader
of the status socket that subscribes; none of them reads. Fails unless each is cut off within two minutes."""
import socket, sys, time
from wire import field, frame, hello


def is_cut_off(s, words, most):
    """Sends words until the other side hangs up; most: bytes that it may accept before."""
    s.settimeout(0.2)
    said, end = 0, time.monotonic() + 120
    while time.monotonic() < end:
        time.sleep(0.005)
        try:
            said += s.send(words)
        except socket.timeout:
            continue
        except OSError:
            return True
        if said > most:
            return False
    return False


def call(role):
    s = socket.socket()
    s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    s.connect(("127.0.0.1", int(sys.argv[1])))
    s.sendall(hello(role, b"deaf", field(4, b"none") + field(5, 1)))
    s.recv(4)
    return s


client = call(2)
asks = frame(field(46, field(1, int(sys.argv[2])))) + 100 * frame(field(48, field(1, int(sys.argv[2])) + field(2, 1)))
if not is_cut_off(client, asks, 1 << 26):
    sys.exit("the client is not cut off")

if not is_cut_off(call(1), 1000 * frame(field(25, field(1, int(sys.argv[2])))), 1 << 26):
    sys.exit("the worker is not cut off")

reader = socket.socket(socket.AF_UNIX)
reader.connect(sys.argv[3])
if not is_cut_off(reader, 100 * b'{"subscribe":["jobs","workers","snapshot"]}\n' + 100 * b'rubbish\n', 1 << 26):
    sys.exit("the reader of the status is not cut off")
