#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the meshes and the texture of the demo scene (they are in the repository; run this to change them)."""
import math
import random
import struct
import zlib


def grid_obj(path, comment, nu, nv, point):
    """A surface closed in both directions: point(u, v) -> position; smooth normals by central differences."""
    def sub(a, b):
        return [x - y for x, y in zip(a, b)]

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    h = 1e-4
    with open(path, "w") as f:
        f.write("# %s\n" % comment)
        for i in range(nu):
            for j in range(nv):
                u, v = i / nu, j / nv
                f.write("v %.5f %.5f %.5f\n" % tuple(point(u, v)))
        for i in range(nu):
            for j in range(nv):
                u, v = i / nu, j / nv
                n = cross(sub(point(u + h, v), point(u - h, v)), sub(point(u, v + h), point(u, v - h)))
                l = math.sqrt(sum(x * x for x in n))
                f.write("vn %.4f %.4f %.4f\n" % tuple(x / l for x in n))
        for i in range(nu):
            for j in range(nv):
                a, b = i * nv + j + 1, ((i + 1) % nu) * nv + j + 1
                c, d = ((i + 1) % nu) * nv + (j + 1) % nv + 1, i * nv + (j + 1) % nv + 1
                f.write("f %d//%d %d//%d %d//%d %d//%d\n" % (a, a, b, b, c, c, d, d))


def ring(u, v):
    """A band with rounded edges: a superellipse turned round the y axis."""
    a, p = 2 * math.pi * u, 2 * math.pi * v
    c, s = math.cos(p), math.sin(p)
    r = 0.72 + 0.05 * math.copysign(abs(c) ** 0.5, c)
    y = 0.26 + 0.26 * math.copysign(abs(s) ** 0.5, s)
    return [r * math.cos(a), y, r * math.sin(a)]


def knot(u, v):
    """A trefoil knot: a tube along (2 + cos 3t) (cos 2t, sin 2t), sin 3t."""
    def centre(t):
        return [(2 + math.cos(3 * t)) * math.cos(2 * t), (2 + math.cos(3 * t)) * math.sin(2 * t), math.sin(3 * t)]

    def unit(a):
        l = math.sqrt(sum(x * x for x in a))
        return [x / l for x in a]

    t = 2 * math.pi * u
    c, d = centre(t), [x - y for x, y in zip(centre(t + 1e-4), centre(t - 1e-4))]
    d = unit(d)
    out = unit([c[0], c[1], 0])
    k = sum(x * y for x, y in zip(out, d))
    n = unit([x - k * y for x, y in zip(out, d)])
    b = [d[1] * n[2] - d[2] * n[1], d[2] * n[0] - d[0] * n[2], d[0] * n[1] - d[1] * n[0]]
    p = -2 * math.pi * v
    return [0.26 * (x + 0.55 * (math.cos(p) * y + math.sin(p) * z)) for x, y, z in zip(c, n, b)]


def noise(seed):
    rng = random.Random(seed)
    table = [rng.random() for _ in range(256 * 256)]

    def at(x, y, period):
        i, j = math.floor(x), math.floor(y)
        fx, fy = x - i, y - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)

        def g(a, b):
            return table[(a % period) * 256 + b % period]
        return ((g(i, j) * (1 - fx) + g(i + 1, j) * fx) * (1 - fy) + (g(i, j + 1) * (1 - fx) + g(i + 1, j + 1) * fx) * fy)
    return at


def floor_png(path, size=512):
    """Four by four stone tiles with dark joints and veins; repeats without a seam."""
    at = noise(1)
    tint = random.Random(7)
    tints = [[0.85 + 0.15 * tint.random() for _ in range(3)] for _ in range(16)]
    rows = []
    for y in range(size):
        row = bytearray([0])
        for x in range(size):
            u, v = x / size, y / size
            n = sum(at(u * 8 * 2 ** k, v * 8 * 2 ** k, 8 * 2 ** k) / 2 ** k for k in range(4)) / 1.875
            vein = abs(math.sin(2 * math.pi * (3 * u + 2 * v + 0.9 * n)))
            edge = max(abs((u * 4) % 1 - 0.5), abs((v * 4) % 1 - 0.5))
            t = tints[int(u * 4) * 4 + int(v * 4)]
            base = [0.62, 0.56, 0.48] if (int(u * 4) + int(v * 4)) % 2 else [0.40, 0.44, 0.47]
            shade = (0.75 + 0.35 * n) * (0.82 + 0.18 * vein ** 0.35)
            if edge > 0.485:
                shade *= 0.35
            row += bytes(min(255, int(255 * (b * s * shade) ** (1 / 2.2))) for b, s in zip(base, t))
        rows.append(bytes(row))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)))
        f.write(chunk(b"IDAT", zlib.compress(b"".join(rows), 9)) + chunk(b"IEND", b""))


grid_obj("meshes/ring.obj", "a band with rounded edges", 128, 24, ring)
grid_obj("meshes/knot.obj", "a trefoil knot", 240, 20, knot)
floor_png("textures/floor.png")
