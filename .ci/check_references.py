#!/usr/bin/env python3
"""Renders the scenes of an independent renderer twice with `path` and scores them by its own script.

  check_references.py REFERENCES SCRATCH

At most 0.5 % of the 8 x 8 blocks may lie past 4 sigma, and each channel's mean radiance within 0.3 % plus three standard
errors of the reference's mean.
"""
import json, pathlib, subprocess, sys

references, scratch = map(pathlib.Path, sys.argv[1:3])
program = pathlib.Path(__file__).parent.parent / "target/release/tyndall"
SAMPLES = {"cloud": 96, "cloud-forward": 96, "ramp": 192, "head": 128, "room": 192}
failed = False
for scene in sorted(p.parent for p in references.glob("*/scene.json")):
    pictures = [str(scratch / f"{scene.name}-{seed}.exr") for seed in (1, 2)]
    for seed, picture in enumerate(pictures, 1):
        subprocess.run([program, "render", scene / "scene.json", "-q", "--samples", str(SAMPLES.get(scene.name, 128)),
                        "--seed", str(seed), "-o", picture], check=True)
    output = subprocess.run([sys.executable, references / "reference.py", "score", scene, *pictures],
                            check=True, capture_output=True, text=True).stdout
    score = json.loads(output)
    error = json.loads((scene / "reference.json").read_text())["rel_error_of_mean_picture"]
    off = max(abs(ratio - 1) for ratio in score["mean_ratio"])
    good = score["blocks_past_4_sigma"] <= 0.005 and off <= 0.003 + 3 * error
    failed |= not good
    print(f"{'ok    ' if good else 'FAILED'} {scene.name:14} mean off by {off:.5f} (allowed {0.003 + 3 * error:.5f}), "
          f"blocks past 4 sigma {score['blocks_past_4_sigma']:.5f}, relMSE {score['relmse']:.2e}", flush=True)
sys.exit(failed)
