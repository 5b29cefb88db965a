#!/usr/bin/env python3
"""Renders the pictures of docs/gallery and writes docs/gallery.md, which shows each with its command.

  python3 tools/gallery.py DATA [--quick FOLDER]      (`tyndall` built in target/release, or where TYNDALL says)

DATA is the folder with the files that are not in this repository (docs/images/SOURCES.md tells where they come from). `--quick`
renders all of them tiny into FOLDER instead, to see that every command works.
"""
import os, pathlib, shlex, subprocess, sys, time

ROOT = pathlib.Path(__file__).resolve().parent.parent
TYNDALL = os.environ.get("TYNDALL", ROOT / "target/release/tyndall")
CHEST, ROCK, MRI = "ct_chest_aorta_i16.nrrd", "rock_bentheimer_u8.nrrd", "examples/data/mri_head.nii.gz"
CLOUD = "examples/cloud.toml"


def plane(point, normal):
    return f'--set clip=\'[{{"type": "plane", "point": {point}, "normal": {normal}}}]\''


def view(azimuth, elevation, zoom=1):
    return f"--set camera.auto.azimuth={azimuth} --set camera.auto.elevation={elevation} --set camera.auto.zoom={zoom}"


# Name, what is seen, input, options.
PICTURES = [
    ("mri-half", "Half a head: the cut shows the folds of the brain, the skin its own shine.", MRI,
     f"--integrator raymarch {plane([-5, 0, 0], [-1, 0, 0])} {view(-55, 15, 1.2)}"),
    ("mri-crown", "The same under all orders of scattering, cut above the eyes.", MRI,
     f"--samples 160 {plane([0, 10, 40], [0, -0.5, 1])} {view(20, 30, 1.3)}"),
    ("mri-head", "What a bare file gets.", MRI, "--samples 100"),
    ("mri-phantom", "Brain and eyes in blue glass.", MRI, "--samples 200 --look phantom"),
    ("chest", "What a bare file gets: bone, and vessels with contrast agent.", CHEST, "--samples 200"),
    ("chest-ivory", "Bone as ivory.", CHEST, f"--look ivory {view(25, 5)}"),
    ("chest-atlas", "Bone on paper.", CHEST, f"--look atlas {view(25, 5)}"),
    ("chest-angio", "Vessels with contrast agent, from the left.", CHEST, f"--look angio {view(60, 10)}"),
    ("chest-anatomy", "Muscle, with the fat removed.", CHEST, f"--look anatomy {view(30, 10)}"),
    ("chest-glass", "Bone within skin of glass.", CHEST, "--samples 200 --look glass"),
    ("chest-lungs", "Lungs under a veil of skin.", CHEST, "--samples 150 --look lungs"),
    ("rock", "Sandstone in raking light.", ROCK, f"--samples 120 --look stone {view(35, 25)}"),
    ("rock-paper", "The same on paper, by single scattering.", ROCK, f"--integrator raymarch --look paper {view(35, 30)}"),
    ("cloud-smoke", "A generated cloud between a warm and a cool light.", CLOUD, "--samples 200 --look smoke"),
    ("cloud-veils", "The same as four veils.", CLOUD, "--samples 200 --look veils"),
    ("cloud-dye", "The same as glowing dye.", CLOUD, "--samples 64 --look dye"),
]


def main():
    data, quick = pathlib.Path(sys.argv[1]), None
    if len(sys.argv) == 4 and sys.argv[2] == "--quick":
        quick = pathlib.Path(sys.argv[3])
    elif len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = quick or ROOT / "docs/gallery"
    folder.mkdir(exist_ok=True)
    lines = ["# Gallery", "", "Each picture with the command that made it, by `python3 tools/gallery.py DATA`, which also wrote this page. Seconds are",
             "of two cores. Where the data come from: [SOURCES.md](images/SOURCES.md).", ""]
    for name, text, source, options in PICTURES:
        path = ROOT / source if (ROOT / source).exists() else data / source
        command = ["render", source, *shlex.split(options), "--size", "400x400", "-o", f"{name}.jpg"]
        asked = [str(path) if word == source else word for word in command]
        asked[-1] = str(folder / asked[-1])
        if quick:
            asked = ["4" if before == "--samples" else word for before, word in zip([""] + asked, asked)]
            asked[asked.index("400x400")] = "24x24"
        # A link, so that the metadata name the file and not where it lies here.
        link = folder / pathlib.Path(source).name
        if not (ROOT / source).exists():
            link.unlink(missing_ok=True)
            link.symlink_to(path.resolve())
            asked[1] = str(link)
        begun = time.time()
        subprocess.run([TYNDALL, *asked, "--quiet"], check=True)
        seconds = time.time() - begun
        if link.is_symlink():
            link.unlink()
        print(f"{name}: {seconds:.0f} s")
        shown = " ".join(["tyndall render", source, options, "--size", "400x400", "-o", f"{name}.jpg"])
        lines += [f"![{text}](gallery/{name}.jpg)", "", f"{text} {seconds:.0f} s.", "", "```sh", shown, "```", ""]
    if not quick:
        (ROOT / "docs/gallery.md").write_text("\n".join(lines))


main()
