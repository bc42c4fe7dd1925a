# SPDX-License-Identifier: Apache-2.0
"""skew.py PORT: workers and clients of the previous and the next version, the latter with unknown fields. Fails unless each is told
which side is the older one."""
import socket, sys
from wire import VERSION, field, first_frame

for role, who in ((1, b"worker"), (2, b"client")):
    for version, older in ((VERSION - 1, who), (VERSION + 1, b"coordinator")):
        hello = field(1, version) + field(2, role) + field(3, b"skewed") + field(4, b"x") + field(5, 1)
        if version > VERSION:
            hello += field(99, b"what comes next")
        s = socket.create_connection(("127.0.0.1", int(sys.argv[1])), 60)
        s.sendall(first_frame(field(1, hello)))
        heard = b""
        while True:
            got = s.recv(4096)
            if not got:
                break
            heard += got
        wanted = b"the %s speaks version %d of the protocol, the coordinator version %d: the %s is older" % (who, version, VERSION, older)
        if wanted not in heard:
            sys.exit(f"a {who.decode()} of version {version} hears {heard!r}")
