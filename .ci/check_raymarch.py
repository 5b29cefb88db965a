#!/usr/bin/env python3
"""Compares `raymarch` (256 light samples) with `path --max-scatter 1` on real data.

  check_raymarch.py VOLUMES SCRATCH

Both see single scattering. What may differ is the noise of `path` and the step error of `raymarch`: blocks of 4 x 4 pixels
are compared in standard errors, with an allowance of twice the change from step 1/2 to step 1/4, and 1 % for 256 fixed light points.
"""
import pathlib, subprocess, sys
import numpy as np, OpenEXR

volumes, scratch = map(pathlib.Path, sys.argv[1:3])
program = pathlib.Path(__file__).parent.parent / "target/release/tyndall"
COMMON = ["--size", "32x32", "--max-scatter", "1", "-q"]
B = 4

def render(volume, name, *options):
    picture = scratch / f"{name}.exr"
    subprocess.run([program, "render", volume, *COMMON, *options, "-o", picture], check=True)
    with OpenEXR.File(str(picture)) as f:
        channels = f.parts[0].channels
        rgb = np.asarray(channels["RGBA"].pixels)[..., :3].astype(float)
        variance = np.asarray(channels["variance"].pixels)[..., :3].astype(float)
    block = lambda x: x.reshape(x.shape[0] // B, B, x.shape[1] // B, B, 3).mean((1, 3))
    return block(rgb), block(variance) / B**2

failed = False
for volume in ["ct_head_promed_i16.nrrd", "mri_head_ch2.nii.gz"]:
    path, variance = render(volumes / volume, "path", "--integrator", "path", "--samples", "1024")
    march = lambda step: render(volumes / volume, "march", "--integrator", "raymarch", "--samples", "4", "--set",
                                f"render.raymarch.step={step}", "--set", "render.raymarch.light_samples=256")[0]
    coarse, fine = march(0.5), march(0.25)
    allowed = 4 * np.sqrt(variance) + 2 * abs(coarse - fine) + 0.01 * path + 1e-4
    off = abs(fine - path)
    share = float((off > allowed).mean())
    mean = float(fine.mean() / path.mean() - 1)
    good = share <= 0.01 and abs(mean) < 0.005
    failed |= not good
    print(f"{'ok    ' if good else 'FAILED'} {volume:28} mean off by {mean:+.5f}, blocks off {share:.4f}", flush=True)
sys.exit(failed)
