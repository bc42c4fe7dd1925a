# SPDX-License-Identifier: Apache-2.0
"""Prints the header of an OpenEXR file, one `name type value` per line, without the library that wrote it.

The layout is that of "Technical Introduction to OpenEXR" (openexr.com): magic number, version and flags, then attributes up to an
empty name. An attribute is a name and a type, each ending with a zero byte, a 32-bit size and the value; little endian."""
import struct
import sys

FORMATS = {"chromaticities": "<8f", "float": "<f", "double": "<d", "int": "<i", "box2i": "<4i", "v2f": "<2f"}


def attributes(data):
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version & 0xFF != 2:
        sys.exit("not an OpenEXR file of version 2")
    at = 8
    while data[at]:
        name, kind = (text.decode() for text in data[at:].split(b"\0", 2)[:2])
        at += len(name.encode()) + len(kind.encode()) + 2
        (size,) = struct.unpack_from("<I", data, at)
        at += 4
        value = data[at : at + size]
        if len(value) != size:
            sys.exit("the file ends within " + name)
        at += size
        yield name, kind, value


def shown(kind, value):
    if kind == "string":
        return value.decode()
    if kind in FORMATS:
        return " ".join("%.7g" % x for x in struct.unpack(FORMATS[kind], value))
    return "%d bytes" % len(value)


with open(sys.argv[1], "rb") as file:
    for name, kind, value in attributes(file.read()):
        print(name, kind, shown(kind, value))
