#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders the pictures of the documentation, panel beside panel, into FOLDER/NAME.png.
usage: pictures.py BUILD FOLDER [NAME...]; without NAME: all.

A panel takes a number of samples per pixel, or CPU seconds of the whole program, scene and pilot included. Fails if a
program fails, or if no length comes within a quarter of the requested time. Seconds depend on the machine, so pictures
of equal time differ between machines.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

STEP = 16  # samples per pixel: one of each group
BENCH, SCENES = "tests/bench/scenes/", "tests/scenes/"


def equal_time(scene, reference, seconds=9, times=5):
    """The default and three integrators in equal time, and a reference with other random numbers."""
    panels = [(scene, seconds, 1, ["--integrator", i] if i else []) for i in (None, "path", "bdpt", "pssmlt")]
    return panels + [(scene, times * seconds, 2, ["--integrator", reference])]


def with_and_without(scene, spp, option, value):
    """The path tracer with this setting and with the default."""
    return [(scene, spp, 0, ["--integrator", "path", option, value]), (scene, spp, 0, ["--integrator", "path"])]


PICTURES = {  # size of a panel, gap, stops of exposure, whether lengths are seconds, rows of (scene, length, seed, options)
    "equal-time": ((200, 112), 4, 0, True, [equal_time(SCENES + "demo/scene.xml", "hslt"), equal_time(SCENES + "displaced/water.xml", "hslt")]),
    "water": ((216, 122), 4, 0, True, [[(SCENES + "displaced/water.xml", 9, 0, ["--integrator", i, "--effects=-refracted-shadows"])
                                     for i in ("bdpt", "pssmlt", "hslt")]]),
    "emitters": ((240, 180), 0, 0, False, [with_and_without(BENCH + "hall.xml", 16, "--set", "emitter-choice=power"),
                                        with_and_without(BENCH + "daylight.xml", 16, "--set", "emitter-choice=power")]),
    "window": ((240, 180), 0, 6.5, False, [with_and_without(SCENES + "window/scene.xml", 64, "--effects", "-transparent-shadows")]),
    "refracted": ((320, 240), 0, 1, False, [with_and_without(SCENES + "bulb/scene.xml", 64, "--effects", "-refracted-shadows")]),
    "smoke": ((320, 240), 0, 0, True, [[(SCENES + "smoke/scene.xml", 118, 0, ["--integrator", "bdpt"])]]),
    "demo": ((640, 360), 0, 0, True, [[(SCENES + "demo/scene.xml", 378, 0, [])]]),
}


def render(build, size, panel, spp, out):
    """Returns the processor seconds, and the name of the integrator that rendered."""
    scene, _, seed, options = panel
    stats = out + ".json"
    args = [build + "/bin/hslt-render", scene, "-o", out, "--size", "%dx%d" % size, "--spp", str(spp), "--seed", str(seed),
            "--threads", "1", "--quiet", "--stats", stats] + options
    child = subprocess.Popen(args)
    _, status, used = os.wait4(child.pid, 0)
    if status:
        raise SystemExit("pictures.py: %s ended with %d" % (" ".join(args), status))
    with open(stats) as f:
        return used.ru_utime + used.ru_stime, json.load(f)["integrator"]


def render_for(build, size, panel, out):
    """Renders until the time is right, and returns the last render. The number of samples follows from the renders
    before: the difference of two gives the rate without the program's start, whose cost is constant."""
    scene, seconds, _, _ = panel
    spp, known = STEP, []
    for _ in range(8):
        took, name = render(build, size, panel, spp, out)
        if abs(took - seconds) < 0.12 * seconds:
            return took, name, spp
        known.append((spp, took))
        (n, t), (m, s) = known[0], known[-1]
        rate = (s - t) / (m - n) if m > n and s > t else took / spp
        spp = max(STEP, min(8 * spp, STEP * round((spp + (seconds - took) / rate) / STEP)))
    if abs(took - seconds) > 0.25 * seconds:
        raise SystemExit("pictures.py: %s by %s: %.1f s where %.1f were wanted" % (scene, name, took, seconds))
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


def beside(pictures, gap):
    return [bytearray(b"\xff" * 3 * gap).join(p[y] for p in pictures) for y in range(len(pictures[0]))]


def picture(build, folder, out, size, gap, stops, timed, rows):
    lines = []
    for row in rows:
        panels = []
        for panel in row:
            exr, png = folder + "/a.exr", folder + "/a.png"
            if timed:
                took, name, spp = render_for(build, size, panel, exr)
            else:
                spp = panel[1]
                took, name = render(build, size, panel, spp, exr)
            subprocess.run([build + "/bin/hslt-tonemap", "--exposure=%g" % stops, exr, png], check=True)
            panels.append(read_png(png))
            print("%s %s: %s, %d a pixel, %.1f s" % (panel[0], " ".join(panel[3]), name, spp, took), flush=True)
        if lines:
            lines += [bytearray(b"\xff" * len(lines[0]))] * gap
        lines += beside(panels, gap)
    write_png(out, lines)


def main():
    build, out, names = sys.argv[1], sys.argv[2], sys.argv[3:] or list(PICTURES)
    unknown = [n for n in names if n not in PICTURES]
    if unknown:
        raise SystemExit("pictures.py: no picture %s; there are %s" % (", ".join(unknown), ", ".join(PICTURES)))
    os.makedirs(out, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            picture(build, folder, "%s/%s.png" % (out, name), *PICTURES[name])


main()
