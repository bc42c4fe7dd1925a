#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the predictions of an estimate beside the real costs of renders.

    hslt-render --estimate SCENE ... --json > estimate.json
    hslt-render SCENE ... --target-error 5% --stats render.json
    side_by_side.py "title" out.svg estimate.json render.json...

Needs gnuplot. CPU seconds include the bootstrap.
"""
import json
import math
import subprocess
import sys


def block(name, rows):
    lines = ["$%s << EOD" % name] + [" ".join("%.9g" % x for x in r) for r in rows] + ["EOD"]
    return "\n".join(lines) + "\n"


def looks(items, before):
    return [(l["cpuSeconds"] + before, 100 * math.sqrt(l["relMSE"]), 100 * math.sqrt(l["relMSEUpper"])) for l in items]


def main():
    title, out, estimate, renders = sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:]
    e = json.load(open(estimate))
    pilot = looks(e["pilot"]["looks"], e["pilot"]["bootstrapCpuSeconds"])
    rows = [r for r in e["targets"] if r["cpuSeconds"]["high"] is not None]
    targets = [(r["cpuSeconds"]["low"], r["cpuSeconds"]["expected"], r["cpuSeconds"]["high"], 100 * r["error"]) for r in rows]
    script = block("pilot", pilot) + block("targets", targets)
    plots = ["$pilot using 1:2 with points pt 7 ps 0.6 lc rgb '#009e73' title 'pilot'",
             "$targets using 2:4:1:3 with xerrorbars pt 5 ps 0.5 lw 2 lc rgb '#0072b2' title 'predicted stop (90 %)'"]
    for i, name in enumerate(renders):
        r = json.load(open(name))
        seen = looks(r["looks"], r["bootstrapCpuSeconds"])
        script += block("render%d" % i, seen) + block("stop%d" % i, seen[-1:])
        colour = ["#d55e00", "#cc79a7", "#e69f00"][i % 3]
        plots.append("$render%d using 1:2 with lines lw 2 lc rgb '%s' title 'render that stopped below %.3g %%'"
                     % (i, colour, seen[-1][2]))
        plots.append("$stop%d using 1:3 with points pt 9 ps 1.1 lc rgb '%s' title 'stopped'" % (i, colour))
    script = ("set terminal svg size 820,480 font 'sans,13' background '#ffffff'\nset output '%s'\nset title '%s'\n"
              "set logscale xy\nset grid lc rgb '#dddddd'\nset border 3\nset tics nomirror\nset key outside top center horizontal\n"
              "set xlabel 'CPU seconds'\nset ylabel 'relative error, %%'\nset yrange [0.8:*]\n" % (out, title)) + script
    subprocess.run(["gnuplot"], input=script + "plot " + ", ".join(plots) + "\n", text=True, check=True)


main()
