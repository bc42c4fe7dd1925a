#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders scenes by several integrators in equal processor time and puts the pictures side by side: one PNG, a row for
each scene, a reference at its end, all of a row with the same exposure. usage: row.py BUILD OUT.png SECONDS REFERENCE_TIMES

Time is that of the whole program, scene and pilot included. The reference is a render of REFERENCE_TIMES the time by
other random numbers. Fails where a program fails or no length comes within a quarter of the time that is asked for.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

SIZE = (200, 112)
GAP = 4
SCENES = (  # file, stops of exposure, what makes the reference
    ("tests/scenes/demo/scene.xml", 0, "hslt"),
    ("tests/scenes/displaced/water.xml", 0, "hslt"),
)
INTEGRATORS = (None, "path", "bdpt", "pssmlt")
STEP = 16  # samples a pixel: one of each group


def render(build, scene, integrator, spp, seed, out):
    """Processor seconds, and what was rendered with."""
    stats = out + ".json"
    args = [build + "/bin/hslt-render", scene, "-o", out, "--size", "%dx%d" % SIZE, "--spp", str(spp), "--seed", str(seed),
            "--threads", "1", "--quiet", "--stats", stats]
    if integrator:
        args += ["--integrator", integrator]
    child = subprocess.Popen(args)
    _, status, used = os.wait4(child.pid, 0)
    if status:
        raise SystemExit("row.py: %s ended with %d" % (" ".join(args), status))
    with open(stats) as f:
        return used.ru_utime + used.ru_stime, json.load(f)["integrator"]


def render_for(build, scene, integrator, seconds, seed, out):
    """The last of a few renders, each as long as the one before it says. Programs have a start that costs as much
    whatever their length: the first two tell it."""
    spp, known = STEP, []
    for _ in range(8):
        took, name = render(build, scene, integrator, spp, seed, out)
        if abs(took - seconds) < 0.12 * seconds:
            return took, name, spp
        known.append((spp, took))
        (n, t), (m, s) = known[0], known[-1]
        rate = (s - t) / (m - n) if m > n and s > t else took / spp
        spp = max(STEP, min(8 * spp, STEP * round((spp + (seconds - took) / rate) / STEP)))
    if abs(took - seconds) > 0.25 * seconds:
        raise SystemExit("row.py: %s by %s: %.1f s where %.1f were wanted" % (scene, name, took, seconds))
    return took, name, spp


def undo_filters(kind, line, above, step):
    for i in range(len(line)):
        a = line[i - step] if i >= step else 0
        b = above[i]
        c = above[i - step] if i >= step else 0
        if kind == 1:
            x = a
        elif kind == 2:
            x = b
        elif kind == 3:
            x = (a + b) // 2
        elif kind == 4:
            p = a + b - c
            x = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
        else:
            x = 0
        line[i] = (line[i] + x) & 255
    return line


def read_png(path):
    """Lines of 8-bit RGB."""
    with open(path, "rb") as f:
        data = f.read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert (depth, color) == (8, 2), (path, depth, color)
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    raw, lines, above = zlib.decompress(packed), [], bytearray(3 * width)
    for y in range(height):
        begin = y * (3 * width + 1)
        above = undo_filters(raw[begin], bytearray(raw[begin + 1:begin + 1 + 3 * width]), above, 3)
        lines.append(above)
    return lines


def write_png(path, lines):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    raw = b"".join(b"\0" + bytes(x) for x in lines)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", len(lines[0]) // 3, len(lines), 8, 2, 0, 0, 0)))
        f.write(chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def beside(pictures):
    return [bytearray(b"\xff" * 3 * GAP).join(p[y] for p in pictures) for y in range(len(pictures[0]))]


def main():
    build, out, seconds, times = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for scene, stops, master in SCENES:
            row = []
            for integrator, length, seed in [(i, seconds, 1) for i in INTEGRATORS] + [(master, times * seconds, 2)]:
                exr, png = folder + "/a.exr", folder + "/a.png"
                took, name, spp = render_for(build, scene, integrator, length, seed, exr)
                subprocess.run([build + "/bin/hslt-tonemap", "--exposure=%g" % stops, exr, png], check=True)
                row.append(read_png(png))
                print("%s: %s, %d a pixel, %.1f s" % (scene, name if integrator else "default, " + name, spp, took), flush=True)
            if lines:
                lines += [bytearray(b"\xff" * len(lines[0]))] * GAP
            lines += beside(row)
    write_png(out, lines)


main()
