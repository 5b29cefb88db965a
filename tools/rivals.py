"""Times Tyndall's `path` and Mitsuba 3 on the scenes of a folder of reference pictures, in one run, by turns.

    python tools/rivals.py REFERENCE [SCENE ...] [--tyndall target/release/tyndall] [--rounds 3]

Needs `pip install mitsuba numpy OpenEXR`, libLLVM 19 and DRJIT_LIBLLVM_PATH set to it. A row tells the seconds that each would
need for a relative mean squared error of 0.01: seconds times error, both of the same picture, the error less that of the reference
itself. Of the times the median counts, of the errors the mean. Tyndall's time is `wall_s - load_s`: all but reading the volume.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np

# Ours must take well over the 30 ms of starting threads and writing the picture; Mitsuba's, over its kernel's launch.
SAMPLES = {"cloud": (64, 8), "cloud-forward": (64, 8), "ramp": (64, 8), "head": (128, 8), "room": (64, 4)}
TARGET = {"cloud": 4, "cloud-forward": 4, "ramp": 4, "head": 10, "room": 20}


def ours(program, scene, samples, seed, reference):
    with tempfile.TemporaryDirectory() as folder:
        picture, stats = pathlib.Path(folder, "a.exr"), pathlib.Path(folder, "a.json")
        subprocess.run(
            [program, "render", scene / "scene.json", "-q", "-o", picture, "--stats", stats]
            + ["--samples", str(samples), "--seed", str(seed)],
            check=True,
        )
        told = json.loads(stats.read_text())
        image = reference.load_image(str(picture))
    mean = np.load(scene / "mean.npy").astype(float)
    error = np.load(scene / "stderr.npy").astype(float)
    of_reference = (error**2 / (mean**2 + 1e-2)).mean()
    return told["wall_s"] - told["load_s"], ((image - mean) ** 2 / (mean**2 + 1e-2)).mean() - of_reference


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", default=list(SAMPLES))
    parser.add_argument("--tyndall", default="target/release/tyndall")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-mitsuba", action="store_true", help="ours alone")
    options = parser.parse_args()
    sys.path.insert(0, str(options.reference))
    import reference

    print("| scene | Tyndall, s | Mitsuba, s | ratio | target |\n| --- | --- | --- | --- | --- |")
    for name in options.scenes:
        scene = options.reference / name
        samples, rival_samples = SAMPLES[name]
        rounds = [ours(options.tyndall, scene, samples, seed, reference) for seed in range(options.rounds)]
        seconds = statistics.median(t for t, _ in rounds)
        product = seconds * statistics.mean(e for _, e in rounds) / 0.01
        if options.no_mitsuba:
            print(f"| {name} | {product:.2f} ({samples} samples in {seconds:.2f} s) | | | {TARGET[name]} |", flush=True)
            continue
        run = [sys.executable, options.reference / "reference.py", "time", scene, "--spp", str(rival_samples)]
        rival = json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()[-1])
        rival = rival["seconds_to_relmse_0_01"]
        print(f"| {name} | {product:.2f} | {rival:.1f} | {rival / product:.1f} | {TARGET[name]} |", flush=True)


if __name__ == "__main__":
    main()
