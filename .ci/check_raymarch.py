#!/usr/bin/env python3
"""Compares `raymarch` (256 light samples, exact shadows) with `path --max-scatter 1` on real data.

  check_raymarch.py VOLUMES SCRATCH

Both see single scattering of a wide sun. What may differ is noise (of the paths, and of the few rays per pixel of the marcher), which both
write as the variance of each pixel, and the marcher's step error: blocks of 4 x 4 pixels are compared in standard errors, with an allowance
of twice the change from step 1 to step 1/2, and 1 % for the fixed light points; the mean has the same two allowances, of which the twelve
rays per pixel take most. What is left of both with a sharp sun, 64 rays and step 1/4 is held to 0.3 % of the mean.
"""
import pathlib, subprocess, sys
import numpy as np, OpenEXR

volumes, scratch = map(pathlib.Path, sys.argv[1:3])
program = pathlib.Path(__file__).parent.parent / "target/release/tyndall"
SUN = '[{"type": "directional", "direction": [0.7, 0.6, -0.8], "irradiance": 5, "angle": 20}]'
SHARP = SUN.replace("20", "0")
COMMON = ["--size", "32x32", "--max-scatter", "1", "-q", "--set", f"lights={SUN}"]
EXACT = ["--set", 'render.raymarch.shadows="exact"']
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
    march = lambda step: render(volumes / volume, "march", "--integrator", "raymarch", "--samples", "12", *EXACT, "--set",
                                f"render.raymarch.step={step}", "--set", "render.raymarch.light_samples=256")
    (coarse, _), (fine, few_rays) = march(1), march(0.5)
    allowed = 4 * np.sqrt(variance + few_rays) + 2 * abs(coarse - fine) + 0.01 * path + 1e-4
    ratio = abs(fine - path) / allowed
    share, worst = float((ratio > 1).mean()), float(ratio.max())
    mean = float(fine.mean() / path.mean() - 1)
    step_error = abs(coarse.mean() / fine.mean() - 1)
    sharp = lambda *options: render(volumes / volume, "sharp", "--set", f"lights={SHARP}", *options)[0].mean()
    truth = sharp("--integrator", "path", "--samples", "4096")
    off = float(sharp("--integrator", "raymarch", "--samples", "64", "--set", "render.raymarch.step=0.25", *EXACT) / truth - 1)
    good = abs(off) < 0.003 and share <= 0.01 and abs(mean) < 0.01 + 2 * step_error
    failed |= not good
    print(f"{'ok    ' if good else 'FAILED'} {volume:28} sharp sun: mean off by {off:+.5f}; wide sun: {mean:+.5f}, blocks off {share:.4f}, worst {worst:.2f} of what is allowed", flush=True)
sys.exit(failed)
