#!/usr/bin/env python3
"""Do two builds render the same light? To be run whenever the bits of pictures change.

  z_test.py OLD NEW SCENE...

OLD and NEW are two builds of the program. Each scene is rendered by each method of NEW with each of them, with different seeds, and the differences of blocks of 4 x 4
pixels are divided by their standard error. For two estimates of the same light such a score has mean 0 and a mean square of at most 1, and rarely
exceeds 4. In `raymarch` samples differ only by their position in the pixel; the variance of these is its error. Exits with 1 if any of these is out of bounds, or if
blocks without noise differ.
"""
import json, pathlib, subprocess, sys, tempfile
import numpy as np, OpenEXR

old, new = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
B = 4
LIGHT = {"photon": ["--samples", "48", "--set", "render.photon.photons=20000"], "raymarch": ["--samples", "16", "--set", "render.raymarch.light_samples=4"],
         "path": ["--samples", "256"]}

def render(program, scene, method, seed, folder):
    picture = pathlib.Path(folder) / "a.exr"
    subprocess.run([program, "render", scene, "--integrator", method, "--size", "64x64", "--seed", str(seed), "-q", "-o", picture, *LIGHT[method]], check=True)
    with OpenEXR.File(str(picture)) as f:
        channels = f.parts[0].channels
        rgb = np.asarray(channels["RGBA"].pixels)[..., :3].astype(float)
        variance = np.asarray(channels["variance"].pixels)[..., :3].astype(float)
    block = lambda x: x.reshape(x.shape[0] // B, B, x.shape[1] // B, B, 3).mean((1, 3))
    return block(rgb), block(variance) / B**2

schema = json.loads(subprocess.run([new, "schema"], check=True, capture_output=True, text=True).stdout)
failed = False
for scene in sys.argv[3:]:
    for method in [m["const"] for m in schema["$defs"]["Integrator"]["oneOf"]]:
        with tempfile.TemporaryDirectory() as folder:
            (a, va), (b, vb) = render(old, scene, method, 1, folder), render(new, scene, method, 2, folder)
        # Channels are correlated: their sum is tested. Blocks that see the background alone have no variance and must be equal.
        difference, error = (a - b).sum(-1), np.sqrt((va + vb).sum(-1) * 3)
        flat = error < 1e-6 * a.sum(-1).max()
        if not np.allclose(a.sum(-1)[flat], b.sum(-1)[flat], rtol=1e-4, atol=1e-6):
            print(f"{scene}, {method}: blocks without noise differ")
            failed = True
        # The sum of three channels has between one and three times the sum of their variances.
        z = difference[~flat] / error[~flat]
        n = z.size
        mean = z.mean() * np.sqrt(n)
        bad = abs(mean) > 4 or (z**2).mean() > 1.25 or abs(z).max() > 5
        failed |= bool(bad)
        print(f"{scene}, {method}: {n} blocks, mean {mean:+.2f}, mean square {(z**2).mean():.2f}, worst {abs(z).max():.2f}, light {b.mean() / a.mean() - 1:+.2%}{'  <-- differs' if bad else ''}")
sys.exit(failed)
