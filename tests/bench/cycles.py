# SPDX-License-Identifier: Apache-2.0
"""Time for the same error against Cycles, the path tracer of Blender, on scenes that Blender makes and exports as glTF.

    blender -b --factory-startup -P tests/bench/cycles.py -- BUILD [SCENE ...]

Every scene is rendered SEEDS times by Cycles, by `path` and by the default, one thread each, in turns. No reference is needed:
the error is the spread of one renderer's images. So a material that the renderers interpret differently does not count as noise,
and neither would a bias. Cycles runs without clamping, caustics filter, adaptive sampling and denoiser, since these change what
the image converges to, and with a box filter, which exported scenes have here. Prints for each scene the product of error and CPU
time: relMSE (docs/design.md, rule 4, with the mean of all seeds as the reference) of all pixels and of all but the worst 0.1 %,
times the CPU seconds of rendering, without Blender's start and export. Fails if a program fails.
"""
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import bpy
import mathutils
import numpy
import OpenImageIO

SIZE = (128, 96)
SEEDS = 8
DEPTH = 64
SPP = 64
TRIM = 0.001
QUARTER = math.pi / 2


def material(name, colour, **inputs):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    node = m.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = colour + (1,)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return m


def diffuse(name, colour):
    return material(name, colour, Roughness=1, Specular=0)


def lamp(strength):
    return material("lamp", (0, 0, 0), Specular=0, Emission=(1, 1, 1, 1), Emission_Strength=strength)


def glass(name, roughness):
    return material(name, (1, 1, 1), Transmission=1, IOR=1.5, Roughness=roughness)


def metal(name, colour, roughness):
    return material(name, colour, Metallic=1, Roughness=roughness)


def plane(m, size, at, turn=(0, 0, 0)):
    bpy.ops.mesh.primitive_plane_add(size=size, location=at, rotation=turn)
    bpy.context.object.data.materials.append(m)


def ball(m, radius, at):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=radius, location=at)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(m)


def camera(at, to, angle):
    data = bpy.data.cameras.new("camera")
    data.angle = angle
    o = bpy.data.objects.new("camera", data)
    o.location = at
    o.rotation_euler = (mathutils.Vector(to) - mathutils.Vector(at)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(o)
    bpy.context.scene.camera = o


def walls():
    white = diffuse("white", (0.7, 0.7, 0.7))
    plane(white, 4, (0, 0, 0))
    plane(white, 4, (0, 0, 4), (math.pi, 0, 0))
    plane(white, 4, (0, 2, 2), (QUARTER, 0, 0))
    plane(white, 4, (0, -2, 2), (-QUARTER, 0, 0))
    plane(diffuse("red", (0.6, 0.1, 0.1)), 4, (-2, 0, 2), (0, QUARTER, 0))
    plane(diffuse("green", (0.1, 0.5, 0.1)), 4, (2, 0, 2), (0, -QUARTER, 0))
    camera((0, -1.9, 2), (0, 2, 1.7), 1.2)


def room():
    """Diffuse walls and balls, a lamp at the ceiling."""
    walls()
    plane(lamp(15), 1, (0, 0, 3.99), (math.pi, 0, 0))
    ball(diffuse("yellow", (0.6, 0.6, 0.2)), 0.7, (-0.8, 0.3, 0.7))
    ball(diffuse("blue", (0.3, 0.4, 0.7)), 0.7, (0.8, -0.3, 0.7))


def indirect():
    """A lamp that shines at the ceiling, and a golden ball."""
    walls()
    plane(lamp(60), 1, (0, 0, 3.6))
    ball(diffuse("yellow", (0.6, 0.6, 0.2)), 0.7, (-0.8, 0.3, 0.7))
    ball(metal("gold", (1, 0.77, 0.34), 0.1), 0.7, (0.8, -0.3, 0.7))


def balls():
    """Glass, frosted glass, gold and copper on stone."""
    plane(diffuse("stone", (0.5, 0.5, 0.5)), 40, (0, 0, 0))
    plane(lamp(40), 1, (-2, 2, 4), (0.5, math.pi - 0.4, 0))
    kinds = (glass("glass", 0), glass("frosted", 0.3), metal("gold", (1, 0.77, 0.34), 0.1), metal("copper", (0.95, 0.64, 0.54), 0.25))
    for i, m in enumerate(kinds):
        ball(m, 0.55, (1.2 * i - 1.8, 0, 0.55))
    camera((0, -6, 2), (0, 0, 0.5), 0.7)


def gloss():
    """Plastics of four roughnesses on a glossy floor under three lamps."""
    plane(material("floor", (0.3, 0.3, 0.3), Roughness=0.2), 40, (0, 0, 0))
    for strength, size, x in ((200, 0.2, -2), (50, 0.6, 0), (10, 1, 2)):
        plane(lamp(strength), size, (x, 1, 3), (math.pi, 0, 0))
    for i, roughness in enumerate((0.05, 0.15, 0.3, 0.5)):
        ball(material("plastic %d" % i, (0.8, 0.3, 0.1), Roughness=roughness), 0.5, (1.2 * i - 1.8, 0, 0.5))
    camera((0, -6, 2), (0, 0, 0.5), 0.7)


def shade():
    """A lamp in a box of frosted glass, a golden ball."""
    walls()
    plane(lamp(100), 0.4, (0, 0.6, 2.2), (math.pi, 0, 0))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0.6, 2.2))
    bpy.context.object.data.materials.append(glass("frosted", 0.3))
    ball(diffuse("yellow", (0.6, 0.6, 0.2)), 0.6, (-0.9, 0.3, 0.6))
    ball(metal("gold", (1, 0.77, 0.34), 0.1), 0.6, (0.9, 0.1, 0.6))


def fine():
    """Two million triangles, diffuse, under a large lamp."""
    plane(lamp(10), 3, (0, 0, 4), (math.pi, 0, 0))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=8)
    bpy.ops.object.shade_smooth()
    mesh = bpy.context.object.data
    mesh.materials.append(diffuse("sand", (0.6, 0.5, 0.4)))
    p = numpy.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", p)
    x, y = p[0::3], p[1::3]
    p[2::3] = 0.1 * numpy.sin(7 * x + 3 * numpy.sin(2 * y)) * numpy.sin(9 * y) + 0.02 * numpy.sin(61 * x) * numpy.sin(53 * y + x)
    mesh.vertices.foreach_set("co", p)
    mesh.update()
    camera((0, -5, 2.5), (0, 0, 0), 0.8)


SCENES = (room, indirect, balls, gloss, shade, fine)


def set_up_cycles():
    scene = bpy.context.scene
    r, c = scene.render, scene.cycles
    r.engine = "CYCLES"
    r.resolution_x, r.resolution_y, r.resolution_percentage = SIZE[0], SIZE[1], 100
    r.threads_mode, r.threads = "FIXED", 1
    r.image_settings.file_format, r.image_settings.color_depth, r.image_settings.color_mode = "OPEN_EXR", "32", "RGB"
    c.device, c.samples = "CPU", SPP
    c.use_adaptive_sampling = c.use_denoising = c.use_auto_tile = False
    c.pixel_filter_type = "BOX"
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = c.light_sampling_threshold = 0
    c.caustics_reflective = c.caustics_refractive = True
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(c, kind + "_bounces", DEPTH)


def by_cycles(seed, out):
    bpy.context.scene.cycles.seed = seed
    bpy.context.scene.render.filepath = out
    start = time.process_time()
    bpy.ops.render.render(write_still=True)
    return time.process_time() - start


def by_us(build, file, integrator, seed, out):
    stats = out + ".json"
    subprocess.run([build + "/bin/hslt-render", file, "-o", out, "--integrator", integrator, "--size", "%dx%d" % SIZE, "--spp", str(SPP),
                    "--max-depth", str(DEPTH + 1), "--seed", str(seed), "--set", "colour=rgb", "--threads", "1", "--quiet",
                    "--stats", stats], check=True, stderr=subprocess.DEVNULL)
    with open(stats) as f:
        s = json.load(f)
    return s["cpuSeconds"], s["integrator"]


def pixels(file):
    image = OpenImageIO.ImageBuf(file)
    channels = [image.spec().channelnames.index(c) for c in "RGB"]
    return image.get_pixels(OpenImageIO.FLOAT)[:, :, channels].reshape(-1, 3).astype(float)


def relmse(images):
    """Returns the error of one renderer's images: over all pixels, and without the worst ones."""
    a = numpy.array(images)
    n, mean = len(a), a.mean(0)
    floor = (0.01 * mean.mean(0)) ** 2
    each = ((a - mean) ** 2).sum(0) / (n - 1) / (mean**2 + floor)
    each = numpy.sort(each.mean(1))
    return each.mean(), each[: len(each) - math.ceil(TRIM * len(each))].mean()


def measure(build, folder, make):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    make()
    set_up_cycles()
    file = os.path.join(folder, make.__name__ + ".glb")
    bpy.ops.export_scene.gltf(filepath=file, export_cameras=True, export_lights=True, export_apply=True)
    seconds = {"cycles": [], "path": [], "auto": []}
    images = {"cycles": [], "path": [], "auto": []}
    chosen = ""
    for seed in range(SEEDS):
        for how in seconds:
            out = os.path.join(folder, "%s-%s-%d.exr" % (make.__name__, how, seed))
            if how == "cycles":
                took = by_cycles(seed, out)
            else:
                took, chosen = by_us(build, file, how, seed, out)
            seconds[how].append(took)
            images[how].append(pixels(out))
    base = None
    for how in seconds:
        all_pixels, trimmed = relmse(images[how])
        took = sorted(seconds[how])[SEEDS // 2]
        base = base or (all_pixels * took, trimmed * took)
        print("RESULT %-9s %-12s %6.2f s  relMSE %9.4g %9.4g  times seconds, over Cycles %7.3g %7.3g  brightness over Cycles %.4f" % (
            make.__name__, "auto: " + chosen if how == "auto" else how, took, all_pixels, trimmed, all_pixels * took / base[0],
            trimmed * took / base[1], numpy.mean(images[how]) / numpy.mean(images["cycles"])), flush=True)


def main():
    args = sys.argv[sys.argv.index("--") + 1:]
    build, names = os.path.abspath(args[0]), args[1:] or [s.__name__ for s in SCENES]
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            measure(build, folder, {s.__name__: s for s in SCENES}[name])


main()
