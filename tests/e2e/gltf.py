# SPDX-License-Identifier: Apache-2.0
# Writes glTF scenes into a folder: one with its buffer and pictures in separate files, embedded, and as .glb; the same
# scene with the same numbers in Mitsuba's XML; and two scenes of a tilted surface, by a normal map and by normals.
import base64
import json
import math
import os
import struct
import sys
import zlib

FLOAT, SHORT = 5126, 5123
folder = sys.argv[1]


def write(name, data):
    with open(os.path.join(folder, name), "wb") as f:
        f.write(data if isinstance(data, bytes) else data.encode())


def png(side, pixel):
    rows = b"".join(b"\0" + bytes(c for x in range(side) for c in pixel(x, y)) for y in range(side))
    kind = 6 if len(pixel(0, 0)) == 4 else 2

    def chunk(tag, data):
        return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))

    header = struct.pack(">IIBBBBB", side, side, 8, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def quad(normal=(0, 0, 1)):
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    return {"p": corners, "n": [normal] * 4, "t": [(0, 1), (1, 1), (1, 0), (0, 0)], "i": [0, 1, 2, 0, 2, 3]}


def ball(across=24, down=12):
    m = {"p": [], "n": [], "t": [], "i": []}
    for a in range(down + 1):
        for b in range(across + 1):
            theta, phi = math.pi * a / down, 2 * math.pi * b / across
            d = (math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi))
            m["p"].append(d)
            m["n"].append(d)
            m["t"].append((b / across, a / down))
    for a in range(down):
        for b in range(across):
            k = a * (across + 1) + b
            m["i"] += [k, k + across + 1, k + 1, k + 1, k + across + 1, k + across + 2]
    return m


class Buffer:
    def __init__(self):
        self.bytes, self.views, self.accessors = b"", [], []

    def view(self, data):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data
        return len(self.views) - 1

    def accessor(self, rows, component, kind, **more):
        flat = [x for row in rows for x in (row if isinstance(row, tuple) else (row,))]
        data = struct.pack("<%d%s" % (len(flat), "f" if component == FLOAT else "H"), *flat)
        self.accessors.append(
            {"bufferView": self.view(data), "componentType": component, "count": len(rows), "type": kind, **more})
        return len(self.accessors) - 1

    def primitive(self, m, material):
        low = [min(p[k] for p in m["p"]) for k in range(3)]
        high = [max(p[k] for p in m["p"]) for k in range(3)]
        return {"attributes": {"POSITION": self.accessor(m["p"], FLOAT, "VEC3", min=low, max=high),
                               "NORMAL": self.accessor(m["n"], FLOAT, "VEC3"),
                               "TEXCOORD_0": self.accessor(m["t"], FLOAT, "VEC2")},
                "indices": self.accessor(m["i"], SHORT, "SCALAR"), "material": material}


def matte(colour, **more):
    return {"pbrMetallicRoughness": {"baseColorFactor": colour, "metallicFactor": 0, **more}}


def turn(axis, angle):
    return [math.sin(angle / 2) * a for a in axis] + [math.cos(angle / 2)]


PICTURES = {"base.png": png(8, lambda x, y: (200, 60, 40) if (x // 2 + y // 2) % 2 else (230, 220, 200)),
            "metal.png": png(8, lambda x, y: (0, 40 + 20 * x, 255 if y < 4 else 0)),
            "leaf.png": png(8, lambda x, y: (40, 160, 60, 255 if (x + y) % 2 else 0))}


def scene():
    b = Buffer()
    materials = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.9, 1, 1], "baseColorTexture": {"index": 0},
                                  "metallicFactor": 0, "roughnessFactor": 0.8}},
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 0.8, 0.4, 1], "metallicRoughnessTexture": {"index": 1}}},
        {**matte([0, 0, 0, 1]), "emissiveFactor": [1, 0.9, 0.8],
         "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10}}},
        {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 2}, "metallicFactor": 0}},
        {**matte([0.8, 0.2, 0.2, 0.4]), "alphaMode": "BLEND"}]
    meshes = [quad(), ball(), quad(), quad(), quad()]
    flat = turn((1, 0, 0), -math.pi / 2)
    nodes = [{"mesh": 0, "rotation": flat, "scale": [4, 4, 4]},
             {"mesh": 1, "translation": [0, 1, 0]},
             {"mesh": 2, "translation": [0, 5, 0], "rotation": turn((1, 0, 0), math.pi / 2)},
             {"mesh": 3, "translation": [-2.5, 1, -1]},
             {"mesh": 4, "translation": [2.5, 1, -1]},
             {"camera": 0, "translation": [0, 2, 8], "rotation": turn((1, 0, 0), -0.1)}]
    g = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
         "meshes": [{"primitives": [b.primitive(m, i)]} for i, m in enumerate(meshes)], "materials": materials,
         "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1}}],
         "textures": [{"source": i, "sampler": 0} for i in range(3)], "samplers": [{"magFilter": 9728}],
         "images": [{"uri": name} for name in PICTURES], "accessors": b.accessors, "bufferViews": b.views,
         "buffers": [{"uri": "scene%20data.bin", "byteLength": len(b.bytes)}]}
    return g, b


def write_forms():
    g, b = scene()
    write("scene data.bin", b.bytes)
    for name, data in PICTURES.items():
        write(name, data)
    write("files.gltf", json.dumps(g, indent=1))
    embedded = json.loads(json.dumps(g))
    embedded["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(b.bytes).decode()
    for image in embedded["images"]:
        image["uri"] = "data:image/png;base64," + base64.b64encode(PICTURES[image["uri"]]).decode()
    write("embedded.gltf", json.dumps(embedded))
    for image in g["images"]:
        image["bufferView"] = b.view(PICTURES[image.pop("uri")])
        image["mimeType"] = "image/png"
    g["buffers"] = [{"byteLength": len(b.bytes)}]
    write("one.glb", glb(g, b.bytes))


def glb(g, binary):
    text = json.dumps(g).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x4E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def obj(m):
    lines = ["v %.9g %.9g %.9g" % p for p in m["p"]] + ["vt %.9g %.9g" % (u, 1 - v) for u, v in m["t"]]
    lines += ["vn %.9g %.9g %.9g" % n for n in m["n"]]
    for k in range(0, len(m["i"]), 3):
        lines.append("f " + " ".join("%d/%d/%d" % ((i + 1,) * 3) for i in m["i"][k:k + 3]))
    return "\n".join(lines) + "\n"


def write_twin():
    write("quad.obj", obj(quad()))
    write("ball.obj", obj(ball()))
    picture = '<texture type="bitmap"%s><string name="filename" value="%s"/>%s<string name="filter_type" value="nearest"/></texture>'
    raw = '<boolean name="raw" value="true"/><string name="channel" value="%s"/>'
    principled = '<bsdf type="principled"><float name="eta" value="1.5"/><boolean name="lambertian" value="true"/>%s</bsdf>'
    colour = '<rgb name="base_color" value="%s"/><float name="roughness" value="1"/>'
    floor = ('<texture type="scale" name="base_color"><rgb name="scale" value="0.9 0.9 1"/>%s</texture>'
             '<float name="roughness" value="0.8"/>' % (picture % ("", "base.png", "")))
    metal = ('<rgb name="base_color" value="1 0.8 0.4"/>' + picture % (' name="metallic"', "metal.png", raw % "b") +
             picture % (' name="roughness"', "metal.png", raw % "g"))
    leaf = ('<bsdf type="mask">' + picture % (' name="opacity"', "leaf.png", raw % "a") +
            principled % (picture % (' name="base_color"', "leaf.png", "") + '<float name="roughness" value="1"/>') +
            "</bsdf>")
    veil = '<bsdf type="mask"><float name="opacity" value="0.4"/>%s</bsdf>' % (principled % (colour % "0.8 0.2 0.2"))
    lamp = (principled % (colour % "0 0 0") +
            '<emitter type="area"><rgb name="radiance" value="10 9 8"/></emitter>')
    move = '<translate x="%g" y="%g" z="%g"/>'
    shapes = [("quad", '<scale value="4"/><rotate x="1" angle="-90"/>', principled % floor),
              ("ball", move % (0, 1, 0), principled % metal),
              ("quad", '<rotate x="1" angle="90"/>' + move % (0, 5, 0), lamp),
              ("quad", move % (-2.5, 1, -1), leaf), ("quad", move % (2.5, 1, -1), veil)]
    text = '<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="%.17g"/>' % math.degrees(0.7)
    text += ('<string name="fov_axis" value="y"/><transform name="to_world"><rotate y="1" angle="180"/>'
             '<rotate x="1" angle="%.17g"/><translate y="2" z="8"/></transform>' % math.degrees(-0.1))
    text += '<film type="hdrfilm"><integer name="width" value="768"/><integer name="height" value="512"/></film></sensor>'
    for mesh, place, rest in shapes:
        text += ('<shape type="obj"><string name="filename" value="%s.obj"/><transform name="to_world">%s</transform>'
                 "%s</shape>" % (mesh, place, rest))
    write("twin.xml", text + "</scene>")


def write_tilted():
    pixel = (150, 200, 220)
    n = [2 * c / 255 - 1 for c in pixel]
    length = math.sqrt(sum(x * x for x in n))
    for name, normal, mapped in (("map", (0, 0, 1), True), ("normals", tuple(x / length for x in n), False)):
        b = Buffer()
        material = matte([0.7, 0.7, 0.7, 1])
        if mapped:
            material["normalTexture"] = {"index": 0}
        g = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1, 2]}], "scene": 0,
             "extensionsUsed": ["KHR_lights_punctual"],
             "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 5]},
                       {"translation": [1, 3, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
             "meshes": [{"primitives": [b.primitive(quad(normal), 0)]}], "materials": [material],
             "cameras": [{"type": "orthographic", "orthographic": {"xmag": 0.8, "ymag": 0.8, "znear": 0, "zfar": 9}}],
             "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 50}]}},
             "textures": [{"source": 0}], "images": [{"bufferView": b.view(png(2, lambda x, y: pixel))}],
             "accessors": b.accessors, "bufferViews": b.views, "buffers": [{"byteLength": len(b.bytes)}]}
        write(name + ".glb", glb(g, b.bytes))


write_forms()
write_twin()
write_tilted()
