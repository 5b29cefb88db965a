"""Error of `photon` against `path` by photons, radius and passes, as a plot: python3 tools/photon_error.py

Needs the release build, and numpy, OpenEXR and matplotlib from PyPI; takes some minutes. The scene has layers, fog between them and
two scatterings; errors are the root of the mean square over the mean of the picture, beside what of it is noise alone."""

import json
import pathlib
import subprocess
import tempfile

import matplotlib.pyplot as plt
import numpy as np
import OpenEXR

ROOT = pathlib.Path(__file__).parent.parent
TYNDALL = ROOT / "target/release/tyndall"
SCENE = {
    "version": 1,
    "volume": {"procedural": {"kind": "shells", "size": [128] * 3}},
    "transfer_function": {
        "points": [
            {"value": 0.0, "opacity": 0.01, "albedo": [0.8, 0.85, 0.9]},
            {"value": 0.55, "opacity": 0.01, "albedo": [0.8, 0.85, 0.9]},
            {"value": 0.7, "opacity": 0.3, "albedo": [0.9, 0.8, 0.6]},
            {"value": 0.9, "opacity": 1.0, "albedo": [0.8, 0.3, 0.2]},
        ]
    },
    "medium": {"density": 0.5},
    "lights": [{"type": "directional", "direction": [1, -1, -1], "irradiance": [3, 3, 3]}],
    "film": {"size": [200, 200]},
    "render": {"integrator": "photon", "max_scatter": 2, "samples": 1},
}
PHOTONS = [1 << i for i in range(14, 24)]
RADII = [0.75, 1.5, 3.0, 6.0]
PASSES = [1, 2, 4, 8, 16, 32, 64]


def render(folder, seed=0, samples=1, **settings):
    """The picture, in rays of one kind: all through the middles of their pixels in a first pass."""
    scene = json.loads(json.dumps(SCENE))
    scene["render"].update(seed=seed, samples=samples, **settings)
    files = [folder / "scene.json", folder / "picture.exr"]
    files[0].write_text(json.dumps(scene))
    subprocess.run([TYNDALL, "render", files[0], "--quiet", "-o", files[1]], check=True)
    return OpenEXR.File(str(files[1])).channels()["RGBA"].pixels[..., :3].astype(np.float64)


def errors(pictures, truth):
    """The error of pictures that differ by their seed, and that of their mean, which has little noise."""
    rms = lambda x: np.sqrt(np.mean(x**2)) / truth.mean()
    whole = np.sqrt(np.mean([rms(picture - truth) ** 2 for picture in pictures]))
    noise = rms(np.std(pictures, axis=0, ddof=1))
    return whole, np.sqrt(max(whole**2 - noise**2, 0))


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        truth = render(folder, integrator="path", samples=1024)
        seen = lambda seeds, **how: errors([render(folder, seed, **how) for seed in seeds], truth)
        figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
        print("photons, radius: error, of which not noise")
        for radius in RADII:
            found = []
            for photons in PHOTONS:
                found.append(seen((1, 2), photon={"photons": photons, "radius": radius}))
                print(f"{photons}, {radius}: {found[-1][0]:.4f}, {found[-1][1]:.4f}", flush=True)
            line = axes[0].loglog(PHOTONS, [whole for whole, _ in found], marker="o", label=f"{radius:g} voxels")[0]
            axes[0].axhline(found[-1][1], color=line.get_color(), linestyle=":", linewidth=1)
        axes[0].set(xlabel="light paths", ylabel="error against path", title="base map, by radius")
        print("passes, radius: error, of which not noise")
        for radius in RADII[1:3]:
            found = []
            for passes in PASSES:
                found.append(seen((1, 2), samples=passes, photon={"photons": 1 << 18, "radius": radius}))
                print(f"{passes}, {radius}: {found[-1][0]:.4f}, {found[-1][1]:.4f}", flush=True)
            axes[1].loglog(PASSES, [whole for whole, _ in found], marker="o", label=f"from {radius:g} voxels")
        axes[1].set(xlabel="passes of 262 144 light paths", title="refinement while idle")
        for axis in axes:
            axis.grid(which="both", alpha=0.3)
            axis.legend()
        figure.savefig(ROOT / "docs/images/photon-error.png", dpi=100)


main()
