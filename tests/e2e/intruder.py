"""A client with a good certificate and bad manners: intruder.py PORT FOLDER prints one line an attempt, "WHAT|ANSWER", and
fails when one of them is not hung up on or refused within four seconds."""
import os, re, socket, ssl, struct, sys

here = os.path.dirname(os.path.abspath(__file__))
VERSION = int(re.search(r"FARM_VERSION = (\d+)", open(here + "/../../common/wire/envelope.h").read()).group(1))
port, folder = int(sys.argv[1]), sys.argv[2]


def field(number, value):
    """Protobuf: a varint for a number, else bytes with their length."""
    def varint(n):
        out = b""
        while n > 127:
            out += bytes([n & 127 | 128])
            n >>= 7
        return out + bytes([n])
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def frame(message, payload=b""):
    return struct.pack(">II", len(message), len(payload)) + message + payload


def ask(words):
    """All that comes back until it hangs up, or until an answer to a submission is in it."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.load_verify_locations(folder + "/ca.pem")
    context.load_cert_chain(folder + "/cert.pem", folder + "/key.pem")
    heard = b""
    with socket.create_connection(("127.0.0.1", port)) as plain:
        plain.settimeout(4)
        with context.wrap_socket(plain) as s:
            s.sendall(words)
            try:
                while b"bundle" not in heard:
                    got = s.recv(4096)
                    if not got:
                        break
                    heard += got
            except (ssl.SSLEOFError, ConnectionResetError, BrokenPipeError):
                pass
    return heard


def submit(name):
    file = field(1, name) + field(2, bytes(32)) + field(3, 1)
    return frame(field(40, field(2, name) + field(8, file)))


hello = frame(field(1, field(1, VERSION) + field(2, 2) + field(3, b"intruder")))
request = frame(field(20, field(1, 8)))
attempts = [
    ("oversized: a header of 2 GB", struct.pack(">II", 1 << 31, 0), b""),
    ("oversized: a payload before hello", struct.pack(">II", 2, 1 << 30) + field(3, b""), b""),
    ("oversized: a payload that nobody asked for", hello + struct.pack(">II", 2, 1 << 30) + field(3, b""), b""),
    ("out of order: work before hello", request, b"hello"),
    ("out of order: a client asks for leases", hello + request, b"not a message that a client says"),
    ("out of order: a piece of a file without a job", hello + frame(field(11, field(1, bytes(32)))), b"without a submission"),
    ("replayed: hello twice", hello + hello, b"not a message that a client says"),
    ("path tricks: ../../etc/passwd", hello + submit(b"../../etc/passwd"), b"no proper name"),
    ("path tricks: /etc/passwd", hello + submit(b"/etc/passwd"), b"no proper name"),
    ("path tricks: a//b", hello + submit(b"a//b"), b"no proper name"),
]
for what, words, sentence in attempts:
    heard = ask(words)
    if sentence not in heard:
        sys.exit(f"{what}: it says {heard!r}")
    print(f"{what}|{sentence.decode() or 'hung up'}")
