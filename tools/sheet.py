#!/usr/bin/env python3
"""Renders every preset over the given volumes and lays the pictures out as one sheet.

  python3 tools/sheet.py SHEET.jpg VOLUME[:PRESET,PRESET...]...      (pip install pillow; `tyndall` built in target/release)
"""
import pathlib, subprocess, sys, tempfile
from PIL import Image, ImageDraw

SIZE, SAMPLES = 300, 64
tyndall = pathlib.Path(__file__).parent.parent / "target/release/tyndall"
sheet, cells = sys.argv[1], []
for argument in sys.argv[2:]:
    volume, _, presets = argument.partition(":")
    cells += [(volume, preset) for preset in presets.split(",")]
columns = 4
rows = -(-len(cells) // columns)
out = Image.new("RGB", (columns * SIZE, rows * SIZE))
with tempfile.TemporaryDirectory() as folder:
    for i, (volume, preset) in enumerate(cells):
        picture = f"{folder}/{i}.png"
        subprocess.run([tyndall, "render", volume, "--preset", preset, "--samples", str(SAMPLES),
                        "--size", f"{SIZE}x{SIZE}", "-o", picture], check=True)
        tile = Image.open(picture).convert("RGB")
        ImageDraw.Draw(tile).text((6, 4), f"{preset}  ({pathlib.Path(volume).name.split('.')[0]})", fill="white")
        out.paste(tile, (i % columns * SIZE, i // columns * SIZE))
out.save(sheet, quality=88)
