"""Light paths and segments computed again for the same result, by bits and groups of histories: python3 tools/false_positives.py

Needs the release build. Each edit recolours one band of data values, or makes it thinner by a tenth; printed is what was computed again
in vain over all paths and segments, under `spatial = "cells"`, where photons that changed ask for segments too."""

import json
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).parent.parent
TYNDALL = ROOT / "target/release/tyndall"
PHOTONS, SIZE, SEGMENTS = 200_000, 200, 7
WARM, COLD = [0.85, 0.2, 0.15], [0.2, 0.35, 0.9]
KINDS = [(bits, bins) for bits in (32, 64, 128) for bins in ("quantile", "uniform")]


def ramp(color, share, low, high, top):
    """Opacity that rises with the value, and a band of it in a colour and with a share of the opacity."""
    grey, opacity = ([0.8] * 3, 1), lambda value: max(0, value / top - 0.15) * 1.1
    band = (color, share)
    points = [(0.15 * top, grey), (low, grey), (low, band), (high, band), (high, grey), (top, grey)]
    return {"points": [{"value": v, "opacity": opacity(v) * s, "albedo": a} for v, (a, s) in points]}


def scene(volume, band, top):
    return {
        "volume": volume,
        "transfer_function": ramp(WARM, 1, *band, top),
        "film": {"size": [SIZE, SIZE]},
        "render": {"integrator": "photon", "samples": 1, "max_scatter": 2},
    }


MRI = {"path": str(ROOT / "examples/data/mri_head.nii.gz")}
CLOUD = {"procedural": {"kind": "cloud", "size": [128] * 3}}
SHELLS = {"procedural": {"kind": "shells", "size": [128] * 3}}
CASES = [
    ("MRI, values 60 to 64 of 254", MRI, [60, 64], 254),
    ("MRI, values 150 to 180 of 254", MRI, [150, 180], 254),
    ("cloud, values 0.5 to 0.52", CLOUD, [0.5, 0.52], 1),
    ("shells, values 0.7 to 0.8", SHELLS, [0.7, 0.8], 1),
]


def in_vain(case, after, bits, bins):
    _, volume, band, top = case
    photon = {"photons": PHOTONS, "segments": SEGMENTS, "history_bits": bits, "bins": bins}
    before = scene(volume, band, top)
    before["render"]["photon"] = photon
    edit = {"patch": {"transfer_function": ramp(*after, *band, top)}}
    with tempfile.TemporaryDirectory() as folder:
        files = [pathlib.Path(folder, name) for name in ("scene.json", "edits.json", "stats.json")]
        files[0].write_text(json.dumps(before))
        files[1].write_text(json.dumps([edit]))
        command = [TYNDALL, "replay", *files[:2], "--verify", "--quiet", "--stats", files[2]]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        report = json.loads(files[2].read_text())["edits"][0]
    done = report["recomputed"]
    all_done = done["photons"] * PHOTONS + done["segments"] * SIZE**2 * SEGMENTS
    return f"{report['false_positives'] / (PHOTONS + SIZE**2 * SEGMENTS):.1%} of {all_done / (PHOTONS + SIZE**2 * SEGMENTS):.1%}"


for name, after in (("recoloured", (COLD, 1)), ("thinner", (WARM, 0.9))):
    print(f"| {name} |", " | ".join(f"{bits} {bins}" for bits, bins in KINDS), "|")
    print("| --- |" + " --- |" * len(KINDS))
    for case in CASES:
        print(f"| {case[0]} |", " | ".join(in_vain(case, after, *kind) for kind in KINDS), "|", flush=True)
