"""Times Tyndall's `raymarch` without shadows and VTK's CPU ray caster on one volume, view and size, by turns.

    python tools/rival_vtk.py [--tyndall target/release/tyndall] [--rounds 5]

Needs `pip install vtk numpy`. Both take one-voxel steps at 512 x 512 through 256^3 bytes, a mostly empty head of shells, unshaded,
on all cores. Tyndall's time is `stages.render`, VTK's that of `Render()` after a first frame.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy as np
import vtk
from vtk.util import numpy_support

N = 256


def shells():
    axis = (np.arange(N) + 0.5) / N * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", copy=False)
    radius = np.sqrt(x * x + y * y + z * z)
    skull = np.clip(1 - abs(radius - 0.8) / 0.03, 0, 1)
    brain = 0.35 * np.clip(1 - abs(radius - 0.4) / 0.05, 0, 1)
    return np.rint(255 * np.maximum(skull, brain)).astype(np.uint8)


def vtk_window(voxels):
    image = vtk.vtkImageData()
    image.SetDimensions(N, N, N)
    image.SetOrigin(*[-(N - 1) / 2] * 3)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(voxels.ravel(), deep=True))
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetSampleDistance(1.0)
    mapper.SetImageSampleDistance(1.0)
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    color.AddRGBPoint(0, 0.9, 0.8, 0.7)
    opacity.AddPoint(20, 0)
    opacity.AddPoint(255, 0.5)
    look = vtk.vtkVolumeProperty()
    look.SetColor(color)
    look.SetScalarOpacity(opacity)
    look.SetInterpolationTypeToLinear()
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(volume)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(380, 160, 740)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewAngle(24)
    renderer.ResetCameraClippingRange()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(512, 512)
    window.AddRenderer(renderer)
    window.Render()
    return window, camera


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tyndall", default="target/release/tyndall")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    voxels = shells()
    window, camera = vtk_window(voxels)
    ours, theirs = [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "shells.raw").write_bytes(voxels.tobytes())
        dull = {"albedo": [0, 0, 0], "emission": [0.9, 0.8, 0.7]}
        points = [{"value": 20, "opacity": 0, **dull}, {"value": 255, "opacity": 1, **dull}]
        scene = {
            "version": 1,
            "volume": {"path": "shells.raw", "raw": {"dims": [N] * 3, "dtype": "u8"}},
            # VTK's opacity of 1/2 per voxel as an extinction.
            "medium": {"density": 0.693},
            "transfer_function": {"points": points},
            "camera": {"type": "perspective", "position": [380, 160, 740], "target": [0, 0, 0], "fov": 24},
            "film": {"size": [512, 512]},
            "render": {"integrator": "raymarch", "max_scatter": 0, "samples": 1, "raymarch": {"step": 1}},
        }
        (folder / "scene.json").write_text(json.dumps(scene))
        for _ in range(options.rounds):
            run = [options.tyndall, "render", folder / "scene.json", "-q", "-o", folder / "a.png", "--stats", folder / "a.json"]
            subprocess.run(run, check=True)
            ours.append(json.loads((folder / "a.json").read_text())["stages"]["render"])
            camera.Azimuth(0.01)
            start = time.perf_counter()
            window.Render()
            theirs.append(time.perf_counter() - start)
    ours, theirs = statistics.median(ours), statistics.median(theirs)
    print(f"Tyndall {ours * 1e3:.0f} ms, VTK {theirs * 1e3:.0f} ms a frame: {theirs / ours:.1f} times (target 5)")


if __name__ == "__main__":
    main()
