# SPDX-License-Identifier: Apache-2.0
# Writes smoke.vol, the grid of this scene: a column of puffs that leans and widens, as bytes.
import math
import struct

WIDE, HIGH = 24, 40


def lumps(x, y, z):
    return sum(math.sin(f * x + p) * math.sin(f * y + 2 * p) * math.sin(f * z + 3 * p) / f
               for f, p in ((7, 1), (13, 2), (23, 4)))


def density(x, y, z):
    """x, z from -1 to 1, y from 0 to 1."""
    lean, width = 0.35 * math.sin(4 * y) * y, 0.25 + 0.45 * y
    away = math.hypot(x - lean, z - 0.5 * lean) / width
    return (1.1 - 1.3 * away + 9 * lumps(x + 0.3 * y, 2 * y, z)) * min(1, 8 * y) * (1 - y) ** 0.7


def byte(x, y, z):
    return max(0, min(255, int(255 * density(x, y, z))))


def middle(i, n):
    return (i + 0.5) / n


with open("smoke.vol", "wb") as out:
    out.write(b"VOL\x03" + struct.pack("<5i6f", 3, WIDE, HIGH, WIDE, 1, 0, 0, 0, 1, 1, 1))
    out.write(bytes(byte(2 * middle(i, WIDE) - 1, middle(j, HIGH), 2 * middle(k, WIDE) - 1)
                    for k in range(WIDE) for j in range(HIGH) for i in range(WIDE)))
