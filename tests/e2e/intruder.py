# SPDX-License-Identifier: Apache-2.0
"""A client with a valid certificate that violates the protocol: intruder.py PORT FOLDER ANOTHER'S prints one line per attempt,
"WHAT|ANSWER", and fails if an attempt is not refused or disconnected within a minute. If a worker is connected, there are also
scenes that name files outside the job, submitted by hand so that no client program checks them before."""
import hashlib, os, re, socket, ssl, struct, sys, time

sys.dont_write_bytecode = True
here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, "faults"))
import wire
from wire import field, frame

port, folder, another = int(sys.argv[1]), sys.argv[2], sys.argv[3]


def call(seconds, who=None):
    who = who or folder
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.load_verify_locations(who + "/ca.pem")
    context.load_cert_chain(who + "/cert.pem", who + "/key.pem")
    s = context.wrap_socket(socket.create_connection(("127.0.0.1", port)))
    s.settimeout(seconds)
    return s


def say(s, words, until):
    """Returns all bytes received until the other side hangs up, or until they contain the given ones."""
    heard = b""
    try:
        s.sendall(words)
        while until not in heard:
            got = s.recv(4096)
            if not got:
                break
            heard += got
    except (ssl.SSLEOFError, ConnectionResetError, BrokenPipeError):
        pass
    return heard


def ask(words):
    with call(60) as s:
        return say(s, words, b"scene")


def submit(*names, scene=None):
    files = b"".join(field(8, field(1, name) + field(2, bytes(32)) + field(3, 1)) for name in names)
    return frame(field(40, field(2, scene or names[0]) + files))


plan = field(1, b"path") + field(2, 0) + field(3, 48) + field(4, 40) + field(9, 1) + field(11, 4) + field(15, 1) + field(16, 8)


def announce(size):
    """Returns the submission of a file that nobody has."""
    return frame(field(40, field(2, b"a") + field(6, plan) + field(8, field(1, b"a") + field(2, os.urandom(32)) + field(3, size))))


# The box scene, with parts that a scene may not have.
here_box = open(here + "/../scenes/box/box.xml", "rb").read()
wedge = open(here + "/../scenes/box/meshes/wedge.obj", "rb").read()
known = {hashlib.sha256(c).digest() for c in (here_box, wedge)}  # files that the spool has from the job before


def box(inside, before=b""):
    return here_box.replace(b"<scene ", before + b"<scene ", 1).replace(b"</scene>", inside + b"</scene>")


def mesh(name):
    return box(b'<shape type="obj"><string name="filename" value="%s"/><bsdf type="diffuse"/></shape>' % name)


def smuggle(scene, files=(), sentence=b""):
    """Submits scene and files (name, content) by hand; returns all that is received until the job has failed."""
    sent = [(b"box.xml", scene), (b"meshes/wedge.obj", wedge), *files]
    hashed = {hashlib.sha256(c).digest(): c for _, c in sent}
    named = b"".join(field(8, field(1, n) + field(2, hashlib.sha256(c).digest()) + field(3, len(c))) for n, c in sent)
    words = hello + frame(field(40, field(1, b"smuggled") + field(2, b"box.xml") + field(6, plan) + named))
    for h, c in hashed.items():
        if h in known:
            continue
        known.add(h)
        words += frame(field(11, field(1, h) + field(3, len(c))), c)
    job = 0
    heard, end = b"", time.monotonic() + 100
    with call(100) as s:
        s.sendall(words)
        while sentence not in heard and time.monotonic() < end:
            got = s.recv(65536)
            if not got:
                break
            heard += got
            # Envelope.submit_answer = 41 with the number of the job, which other answers of that kind lack.
            found = re.search(rb"\xca\x02.{1,2}?\x08([\x01-\x7f])\x22", heard, re.S)
            if found and not job:
                job = found.group(1)[0]
                s.sendall(frame(field(46, field(1, job))))
    return heard


hello = wire.hello(2, b"intruder")
again = frame(hello[8:])
request = frame(field(20, field(1, 8)))
too_long = struct.pack(">III", 2, 1 << 30, 0)
too_long += struct.pack(">I", wire.crc32c(too_long))
attempts = [
    ("oversized: a header of 2 GB", struct.pack(">II", 1 << 31, 0), b""),
    ("oversized: a payload before hello", struct.pack(">II", 2, 1 << 30) + field(3, b""), b""),
    ("oversized: a payload that nobody asked for", hello + too_long + field(3, b""), b""),
    ("out of order: work before hello", wire.first_frame(field(20, field(1, 8))), b"hello"),
    ("out of order: a client asks for leases", hello + request, b"not a message for a client to send"),
    ("out of order: a piece of a file without a job", hello + frame(field(11, field(1, bytes(32)))), b"without a submission"),
    ("replayed: hello twice", hello + again, b"not a message for a client to send"),
    ("path tricks: ../../etc/passwd", hello + submit(b"../../etc/passwd"), b"no valid name"),
    ("path tricks: /etc/passwd", hello + submit(b"/etc/passwd"), b"no valid name"),
    ("path tricks: a//b", hello + submit(b"a//b"), b"no valid name"),
    ("path tricks: a/./b", hello + submit(b"a/./b"), b"no valid name"),
    ("path tricks: a/..", hello + submit(b"a/.."), b"no valid name"),
    ("path tricks: a/", hello + submit(b"a/"), b"no valid name"),
    ("path tricks: a name of nothing", hello + submit(b"a", b"", scene=b"a"), b"no valid name"),
    ("path tricks: a zero in a name, .. behind it", hello + submit(b"a\0/../../b", scene=b"a\0/../../b"), b"no plan"),
    ("path tricks: control characters", hello + submit(b"a\nb", scene=b"a"), b"no valid name"),
    ("path tricks: no UTF-8", hello + submit(b"a", b"\xc0\xae\xc0\xae/b"), b""),
    ("path tricks: a name of 2,000 bytes", hello + submit(b"a", b"x" * 2000), b"no valid name"),
    ("invalid scene files: two files of one name", hello + submit(b"a", b"b", b"a"), b"two files of that name"),
    ("invalid scene files: a scene of another case than its file", hello + submit(b"A.xml", scene=b"a.xml"), b"not among the scene's files"),
    ("invalid scene files: 10,001 files", hello + submit(*[b"%d" % i for i in range(10001)]), b"files, not 10001"),
    ("invalid scene files: 10^6 files", hello + submit(*[b"%d" % i for i in range(10 ** 6)]), b""),
]
# Files that a worker could open if names were used as paths: absolute, and relative to where it was started.
at = os.getcwd().encode()
open("beside.obj", "w").write("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
os.mkfifo("pipe.obj")


def unsent(what, name):
    return what, mesh(name), (), name.replace(b"..", b"%2e%2e") + b": the file was not sent with the job"


entity = b'<!DOCTYPE scene [<!ENTITY e SYSTEM "file:///proc/self/environ">]>'
laughs = b"<!DOCTYPE scene [<!ENTITY a0 'ha'>" + b"".join(
    b"<!ENTITY a%d '%s'>" % (i, b"&a%d;" % (i - 1) * 10) for i in range(1, 12)) + b"]>"
scenes = [
    unsent("a scene sent past the client: names /dev/zero", b"/dev/zero"),
    unsent("a scene sent past the client: names /proc/self/environ", b"/proc/self/environ"),
    ("a scene sent past the client: names ../../../../etc/passwd", mesh(b"../../../../etc/passwd"), (),
     b"%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd: the file was not sent with the job"),  # as a client encodes the name in a job
    unsent("a scene sent past the client: names a file by its whole name", at + b"/beside.obj"),
    unsent("a scene sent past the client: names a file where the worker was started", b"LICENSE"),
    unsent("a scene sent past the client: names a pipe", at + b"/pipe.obj"),
    ("a scene sent past the client: names one of its files in another case", mesh(b"A.obj"), ((b"a.obj", b"v 0 0 0\n"),),
     b"A.obj: the file was not sent with the job"),
    unsent("a scene sent past the client: names another job's file by its hash", hashlib.sha256(here_box).hexdigest().encode()),
    ("a scene sent past the client: includes /etc/passwd", box(b'<include filename="/etc/passwd"/>'), (), b"/etc/passwd: the file was not sent"),
    ("a scene sent past the client: a define that names /etc/passwd", box(b'<default name="p" value="/etc/passwd"/><include filename="$p"/>'), (), b"/etc/passwd: the file was not sent"),
    ("a scene sent past the client: an entity of a file", box(b'<default name="q" value="x"/>&e;', entity), (), b"must not declare"),
    ("a scene sent past the client: nested entities", box(b'<default name="q" value="&a11;"/>', laughs), (), b"must not declare"),
]
for what, words, sentence in attempts:
    heard = ask(words)
    if sentence not in heard:
        sys.exit(f"{what}: it says {heard!r}")
    print(f"{what}|{sentence.decode() or 'hung up'}")
# One owner's unfinished uploads count over all connections, those of others do not.
what, goes_on = "files beyond the quota, on two connections", b"samples per pixel"
with call(60) as first, call(60) as second, call(60, another) as other:
    for s, sentence in (first, goes_on), (second, b"quota: its files"), (other, goes_on):
        heard = say(s, hello + announce(60000), sentence)
        if sentence not in heard:
            sys.exit(f"{what}: it says {heard!r}")
print(f"{what}|quota: its files")
if b"done" not in smuggle(box(b""), (), b"done"):
    sys.exit("a box that is as it should be is refused, too")
for what, scene, files, sentence in scenes:
    heard = smuggle(scene, files, sentence)
    if sentence not in heard or b"PATH=" in heard:
        sys.exit(f"{what}: it says {heard[-600:]!r}")
    print(f"{what}|{sentence.decode()}")
