#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the height maps of the displaced scene (they are in the repository; run this to change them)."""
import math
import random
import struct
import zlib


def png16(path, size, height):
    """16-bit grey of height(u, v) in [0, 1]."""
    rows = b"".join(b"\0" + b"".join(struct.pack(">H", round(65535 * min(max(height((x + 0.5) / size, (y + 0.5) / size), 0), 1)))
                                     for x in range(size)) for y in range(size))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 16, 0, 0, 0, 0)))
        f.write(chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def ripples():
    """Twelve plane waves that repeat on the unit square."""
    rng = random.Random(3)
    waves = [(rng.randint(-4, 4), rng.randint(-4, 4), rng.random()) for _ in range(12)]
    waves = [w for w in waves if w[:2] != (0, 0)]

    def height(u, v):
        return 0.5 + 0.5 * sum(math.sin(2 * math.pi * (a * u + b * v + p)) for a, b, p in waves) / len(waves)
    return height


def dents():
    """Round dents on a sphere's (u, v), evenly spread (a spiral), quantised to 12 bits so that the file stays small."""
    n = 90
    centres = []
    for k in range(n):
        z = 1 - (2 * k + 1) / n
        a = k * math.pi * (3 - math.sqrt(5))
        centres.append((math.sqrt(1 - z * z) * math.cos(a), math.sqrt(1 - z * z) * math.sin(a), z))

    def height(u, v):
        s = math.sin(math.pi * v)
        d = (s * math.cos(2 * math.pi * u), s * math.sin(2 * math.pi * u), math.cos(math.pi * v))
        x = max(sum(a * b for a, b in zip(d, c)) for c in centres)
        t = min(math.acos(min(x, 1)) / 0.17, 1)
        return round(4095 * (1 - (1 - t * t) ** 2)) / 4095
    return height


png16("textures/ripples.png", 64, ripples())
png16("textures/dents.png", 192, dents())
