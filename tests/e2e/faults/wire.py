# SPDX-License-Identifier: Apache-2.0
"""Messages of the protocol as bytes (proto/farm.proto), for peers that tests simulate."""
import os, re, struct, sys

sys.dont_write_bytecode = True
here = os.path.dirname(os.path.abspath(__file__))
VERSION = int(re.search(r"FARM_VERSION = (\d+)", open(here + "/../../../common/wire/envelope.h").read()).group(1))


def varint(n):
    out = b""
    while n > 127:
        out += bytes([n & 127 | 128])
        n >>= 7
    return out + bytes([n])


def field(number, value):
    """Returns a field: a varint for a number, otherwise bytes with their length."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def _table():
    for c in range(256):
        for _ in range(8):
            c = c >> 1 ^ (0x82F63B78 if c & 1 else 0)
        yield c


TABLE = list(_table())


def crc32c(data):
    """CRC-32C (Castagnoli), one byte at a time."""
    c = 0xFFFFFFFF
    for byte in data:
        c = c >> 8 ^ TABLE[(c ^ byte) & 255]
    return c ^ 0xFFFFFFFF


def first_frame(message):
    """Returns the first frame of a direction, which has no checksums."""
    return struct.pack(">II", len(message), 0) + message


def hello(role, name, more=b"", version=VERSION):
    """Returns a hello with the checksum of its bytes; more: its fields from 4 on."""
    def words(check):
        return field(1, field(1, version) + field(2, role) + field(3, name) + more + struct.pack("<BI", 15 << 3 | 5, check))
    return first_frame(words(crc32c(words(0)[:-4])))


def frame(message, payload=b""):
    """Returns a later frame. A message too long to be accepted gets no checksum, because its length is refused first."""
    head = struct.pack(">III", len(message), len(payload), crc32c(message + payload) if len(message) < 1 << 23 else 0)
    return head + struct.pack(">I", crc32c(head)) + message + payload
