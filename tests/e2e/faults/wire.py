"""The conversation's words, as bytes (proto/farm.proto), for peers that tests make up."""
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
    """A varint for a number, else bytes with their length."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def frame(message, payload=b""):
    return struct.pack(">II", len(message), len(payload)) + message + payload
