"""Writes small volume files with the reference libraries of each format, and dumps what those libraries read.

usage: make_and_dump.py FOLDER [DATA]

FOLDER gets the files, `expected.jsonl` (one line per file: name, dimensions, spacing, rows of the direction
matrix, origin, channels, times) and one `.f64` dump of the data values per file (x fastest, first channel at the
first time). Geometry is in Tyndall's convention: LPS for anatomical files. DATA, if given, is a folder of real
files, which are dumped too, marked `"data": true`.

Needs numpy, pynrrd, nibabel and SimpleITK.
"""

import bz2
import json
import pathlib
import sys

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk

DIMS = (7, 5, 4)
TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]
RNG = np.random.default_rng(20)
IDENTITY = np.eye(3)


def samples(dtype, shape=DIMS):
    """Samples over the whole range of the type, indexed [x, y, z]."""
    if np.dtype(dtype).kind == "f":
        return RNG.normal(0.0, 1000.0, shape).astype(dtype)
    info = np.iinfo(dtype)
    return RNG.integers(info.min, info.max, shape, dtype=dtype, endpoint=True)


def rotation(angles):
    """A rotation about x, then y, then z."""
    matrix = IDENTITY
    for axis, angle in enumerate(angles):
        turn = np.eye(3)
        i, j = [k for k in range(3) if k != axis]
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
        matrix = turn @ matrix
    return matrix


OBLIQUE = rotation([0.3, -0.5, 1.1])
PERMUTED = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
MIRRORED = OBLIQUE @ np.diag([1.0, -1.0, 1.0])
SPACING = np.array([0.5, 1.25, 3.0])
ORIGIN = np.array([-11.5, 20.25, 300.125])


class Dump:
    """Collects the expectations."""

    def __init__(self, folder):
        self.folder = folder
        self.lines = []

    def add(self, name, values, spacing, direction, origin, channels=1, times=1, data=False):
        """`values` are indexed [x, y, z]; `direction` has the world direction of axis j as column j."""
        dump = name.replace("/", "_") + ".f64"
        flat = np.asarray(values, dtype=np.float64).flatten(order="F")
        flat.astype("<f8").tofile(self.folder / dump)
        self.lines.append({
            "file": name,
            "dump": dump,
            "dims": [int(n) for n in np.shape(values)],
            "spacing": [float(v) for v in spacing],
            "direction": np.asarray(direction, dtype=float).tolist(),
            "origin": [float(v) for v in origin],
            "channels": channels,
            "times": times,
            "data": data,
        })

    def as_itk_reads(self, name, path=None, **more):
        """Adds what SimpleITK reads: the first component of vectors, the first time step of four axes."""
        image = sitk.ReadImage(str(path or self.folder / name))
        values = sitk.GetArrayFromImage(image)
        if image.GetNumberOfComponentsPerPixel() > 1:
            values = values[..., 0]
        axes = image.GetDimension()
        if axes == 4:
            values = values[0]
        values = values.T
        direction = np.array(image.GetDirection()).reshape(axes, axes)
        spacing, origin = image.GetSpacing(), image.GetOrigin()
        if axes == 2:
            values = values[:, :, None]
            direction = np.pad(direction, (0, 1))
            direction[2, 2] = 1.0
            spacing, origin = (*spacing, 1.0), (*origin, 0.0)
        more.setdefault("channels", image.GetNumberOfComponentsPerPixel())
        more.setdefault("times", image.GetSize()[3] if axes == 4 else 1)
        self.add(name, values, spacing[:3], direction[:3, :3], origin[:3], **more)

    def as_nibabel_reads(self, name, millimetres=1.0, path=None, **more):
        """Adds what nibabel reads, converted from RAS to LPS."""
        image = nibabel.load(path or self.folder / name)
        values = np.asarray(image.dataobj)
        if values.dtype.names:
            values = values[values.dtype.names[0]]
        shape = values.shape
        while values.ndim > 3:
            values = values[..., 0]
        affine = np.diag([-1.0, -1.0, 1.0, 1.0]) @ image.affine
        steps = affine[:3, :3] * millimetres
        spacing = np.linalg.norm(steps, axis=0)
        more.setdefault("times", shape[3] if len(shape) > 3 else 1)
        more.setdefault("channels", int(np.prod(shape[4:])))
        self.add(name, values, spacing, steps / spacing, affine[:3, 3] * millimetres, **more)

    def write(self):
        with open(self.folder / "expected.jsonl", "w", encoding="utf-8") as file:
            for line in self.lines:
                file.write(json.dumps(line) + "\n")


def write_nrrd(dump):
    def put(name, array, header=None, **options):
        nrrd.write(str(dump.folder / name), array, header, **options)
        return name

    oblique = {"space": "left-posterior-superior", "space directions": (OBLIQUE * SPACING).T, "space origin": ORIGIN}
    for dtype in TYPES:
        for encoding in ["raw", "gzip", "bzip2", "ascii"]:
            for endian in ["little", "big"]:
                array = samples(dtype)
                header = {**oblique, "encoding": encoding, "endian": endian}
                if endian == "big":
                    # pynrrd writes the array's bytes as they are.
                    if encoding == "ascii":
                        continue
                    array = array.astype(array.dtype.newbyteorder(">"))
                name = put(f"{dtype}_{encoding}_{endian}.nrrd", array, header)
                if encoding == "bzip2":
                    # ITK is built without bzip2; pynrrd reads it.
                    values, _ = nrrd.read(str(dump.folder / name))
                    dump.add(name, values, SPACING, OBLIQUE, ORIGIN)
                else:
                    dump.as_itk_reads(name)
    for space in ["left-posterior-superior", "right-anterior-superior", "left-anterior-superior", "RAS", "scanner-xyz",
                  "3D-right-handed"]:
        for kind, matrix in [("axes", IDENTITY), ("oblique", OBLIQUE), ("permuted", PERMUTED), ("mirrored", MIRRORED)]:
            header = {"space": space, "space directions": (matrix * SPACING).T, "space origin": ORIGIN}
            dump.as_itk_reads(put(f"{space}_{kind}.nrrd", samples("int16"), header))
    for encoding, ending in [("raw", "raw"), ("gzip", "raw.gz"), ("bzip2", "raw.bz2"), ("ascii", "txt")]:
        header = {**oblique, "encoding": encoding}
        array = samples("uint16")
        name = put(f"detached_{encoding}.nhdr", array, header, detached_header=True)
        dump.add(name, array, SPACING, OBLIQUE, ORIGIN)
        assert (dump.folder / f"detached_{encoding}.{ending}").is_file()
    dump.as_itk_reads(put("spacings.nrrd", samples("uint8"), {"spacings": SPACING}))
    dump.as_itk_reads(put("spacings_mins.nrrd", samples("uint8"), {"spacings": SPACING, "axis mins": ORIGIN}))
    dump.as_itk_reads(put("spacings_negative.nrrd", samples("uint8"), {"spacings": SPACING * [1, -1, 1], "axis mins": ORIGIN}))
    dump.as_itk_reads(put("nothing_but_sizes.nrrd", samples("uint8")))
    dump.as_itk_reads(put("plane.nrrd", samples("int16", (6, 9)), {"spacings": [2.0, 3.0]}))
    series = samples("int16", (*DIMS, 3))
    dump.as_itk_reads(put("series.nrrd", series, {"spacings": [1.0, 2.0, 3.0, 0.1], "kinds": ["domain"] * 3 + ["time"]}))
    directions = np.vstack([np.full(3, np.nan), (OBLIQUE * SPACING).T])
    for kind, count in [("RGB-color", 3), ("vector", 3), ("4-vector", 4), ("list", 2)]:
        header = {**oblique, "space directions": directions, "kinds": [kind] + ["domain"] * 3}
        array = samples("uint8", (count, *DIMS))
        name = put(f"{kind}_first.nrrd", array, header)
        dump.add(name, array[0], SPACING, OBLIQUE, ORIGIN, channels=count)
    directions = np.vstack([(OBLIQUE * SPACING).T, np.full(3, np.nan)])
    header = {**oblique, "space directions": directions, "kinds": ["domain"] * 3 + ["list"]}
    array = samples("uint8", (*DIMS, 5))
    dump.add(put("list_last.nrrd", array, header), array[..., 0], SPACING, OBLIQUE, ORIGIN, channels=5)
    # Written by hand: variants that pynrrd does not write.
    array = samples("int16")
    raw = array.flatten(order="F").astype(">i2").tobytes()
    head = ("NRRD0003\r\n# a comment\r\nkey:=value with: colons\r\ntype: signed short int\r\ndimension: 3\r\n"
            "sizes: 7 5 4\r\nspacings: 0.5 nan 3\r\nendian: big\r\n")
    (dump.folder / "hand.nrrd").write_bytes((head + "encoding: raw\r\n\r\n").encode() + raw)
    dump.add("hand.nrrd", array, [0.5, 1.0, 3.0], IDENTITY, [0, 0, 0])
    (dump.folder / "hand.bin").write_bytes(b"first line\n" + b"x" * 13 + raw)
    (dump.folder / "hand_skip.nhdr").write_text(head + "encoding: raw\nline skip: 1\nbyte skip: 13\ndata file: hand.bin\n")
    (dump.folder / "hand_end.nhdr").write_text(head + "encoding: raw\nbyte skip: -1\ndata file: hand.bin\n")
    (dump.folder / "hand.bz2").write_bytes(bz2.compress(b"x" * 13 + raw))
    (dump.folder / "hand_bz2.nhdr").write_text(head + "encoding: bz2\nbyte skip: 13\ndata file: hand.bz2\n")
    dump.add("hand_bz2.nhdr", array, [0.5, 1.0, 3.0], IDENTITY, [0, 0, 0])
    for name in ["hand_skip.nhdr", "hand_end.nhdr"]:
        dump.as_itk_reads(name)
    for z in range(4):
        (dump.folder / f"slice{z + 8:03d}.raw").write_bytes(array[:, :, z].flatten(order="F").astype(">i2").tobytes())
    (dump.folder / "pattern.nhdr").write_text(head + "encoding: raw\ndata file: slice%03d.raw 8 11 1 2\n")
    names = "".join(f"slice{z + 8:03d}.raw\n" for z in range(4))
    (dump.folder / "list.nhdr").write_text(head + "encoding: raw\ndata file: LIST\n" + names)
    for name in ["pattern.nhdr", "list.nhdr"]:
        dump.as_itk_reads(name)


def ras(matrix, spacing=SPACING, origin=ORIGIN):
    affine = np.eye(4)
    affine[:3, :3] = matrix * spacing
    affine[:3, 3] = origin
    return affine


def write_nifti(dump):
    kinds = {1: (nibabel.Nifti1Image, nibabel.Nifti1Pair, nibabel.Nifti1Header),
             2: (nibabel.Nifti2Image, nibabel.Nifti2Pair, nibabel.Nifti2Header)}

    def put(name, array, affine, version=1, pair=False, endian="<", prepare=lambda image: None):
        single, both, header_class = kinds[version]
        header = header_class(endianness=endian)
        header.set_data_dtype(array.dtype)
        image = (both if pair else single)(array, affine, header)
        prepare(image)
        nibabel.save(image, dump.folder / name)
        return name

    def slope(image):
        image.header.set_slope_inter(0.37, -1024.5)

    for version in [1, 2]:
        for dtype in TYPES:
            for endian, order in [("<", "little"), (">", "big")]:
                for ending, pair in [("nii", False), ("nii.gz", False), ("hdr", True), ("hdr.gz", True)]:
                    # Each stem is unique: ITK would read a.nii instead of a.nii.gz if both exist.
                    name = f"v{version}_{dtype}_{order}_{ending.replace('.', '_')}.{ending}"
                    put(name, samples(dtype), ras(OBLIQUE), version, pair, endian)
                    if version == 1:  # ITK does not read NIfTI-2
                        dump.as_itk_reads(name)
                    else:
                        dump.as_nibabel_reads(name)
        for dtype in ["uint8", "int16", "float32"]:
            # nibabel would rescale the samples when saving, so the slope is set in the file afterwards.
            name = put(f"v{version}_slope_{dtype}.nii", samples(dtype), ras(OBLIQUE), version)
            with open(dump.folder / name, "r+b") as file:
                file.seek(112 if version == 1 else 176)
                file.write(np.array([0.37, -1024.5], "<f4" if version == 1 else "<f8").tobytes())
            dump.as_nibabel_reads(name)
    for kind, matrix in [("axes", IDENTITY), ("oblique", OBLIQUE), ("permuted", PERMUTED), ("mirrored", MIRRORED)]:
        for form in ["sform", "qform", "both"]:
            def forms(image, form=form, affine=ras(matrix)):
                # Setting a form changes the image's own affine, so it cannot be read from the image here.
                image.set_sform(*((None, 0) if form == "qform" else (affine, 1)))
                image.set_qform(*((None, 0) if form == "sform" else (affine, 1)))
            name = put(f"{form}_{kind}.nii", samples("int16"), ras(matrix), prepare=forms)
            dump.as_itk_reads(name)
    turn = rotation([0, 0, np.pi])
    dump.as_nibabel_reads(put("half_turn.nii", samples("int16"), ras(turn), prepare=lambda i: i.set_sform(None, 0) or i.set_qform(ras(turn), 1)))
    sheared = IDENTITY.copy()
    sheared[0, 1] = 0.4
    dump.as_nibabel_reads(put("sheared.nii", samples("int16"), ras(sheared)))
    other = ras(rotation([0.1, 0.0, 0.0]), origin=[0, 0, 0])
    dump.as_nibabel_reads(put("sform_wins.nii", samples("int16"), ras(OBLIQUE), prepare=lambda i: i.set_sform(ras(OBLIQUE), 4) or i.set_qform(other, 1)))

    def no_form(image):
        image.set_sform(None, 0)
        image.set_qform(None, 0)
        image.header.set_zooms(SPACING)

    dump.as_nibabel_reads(put("no_form.nii", samples("int16"), None, prepare=no_form))
    for unit in ["meter", "mm", "micron"]:
        dump.as_itk_reads(put(f"unit_{unit}.nii", samples("int16"), ras(OBLIQUE), prepare=lambda i, u=unit: i.header.set_xyzt_units(u)))
    # Both pairs in one folder: the compressed header belongs to the compressed samples.
    for ending in ["hdr", "hdr.gz"]:
        put(f"twins.{ending}", samples("int16"), ras(OBLIQUE), pair=True)
    for ending in ["hdr", "hdr.gz"]:
        dump.as_nibabel_reads(f"twins.{ending}")
    dump.as_nibabel_reads(put("series.nii.gz", samples("int16", (*DIMS, 3)), ras(OBLIQUE)))
    dump.as_nibabel_reads(put("vectors.nii.gz", samples("float32", (*DIMS, 1, 3)), ras(OBLIQUE)))
    dump.as_nibabel_reads(put("plane.nii", samples("int16", (6, 9, 1)), ras(OBLIQUE)))
    colours = samples("uint8", (*DIMS, 3)).view([("R", "u1"), ("G", "u1"), ("B", "u1")])[..., 0]
    dump.as_nibabel_reads(put("rgb.nii", colours, ras(OBLIQUE)), channels=3)


def write_meta(dump):
    for dtype in TYPES:
        for ending in ["mha", "mhd"]:
            for compressed in [False, True]:
                image = sitk.GetImageFromArray(samples(dtype).T.copy())
                image.SetDirection(OBLIQUE.flatten())
                image.SetSpacing(SPACING)
                image.SetOrigin(ORIGIN)
                name = f"{dtype}_{'zlib' if compressed else 'raw'}.{ending}"
                sitk.WriteImage(image, str(dump.folder / name), compressed)
                dump.as_itk_reads(name)
    for kind, matrix in [("axes", IDENTITY), ("permuted", PERMUTED), ("mirrored", MIRRORED)]:
        image = sitk.GetImageFromArray(samples("int16").T.copy())
        image.SetDirection(matrix.flatten())
        image.SetSpacing(SPACING)
        sitk.WriteImage(image, str(dump.folder / f"{kind}.mha"))
        dump.as_itk_reads(f"{kind}.mha")
    image = sitk.GetImageFromArray(samples("uint8", (4, 5, 7, 3)), isVector=True)
    sitk.WriteImage(image, str(dump.folder / "rgb.mha"), True)
    dump.as_itk_reads("rgb.mha")
    image = sitk.GetImageFromArray(samples("int16", (6, 9)).T.copy())
    image.SetSpacing([2.0, 3.0])
    sitk.WriteImage(image, str(dump.folder / "plane.mha"))
    dump.as_itk_reads("plane.mha")
    series = sitk.JoinSeries([sitk.GetImageFromArray(samples("int16").T.copy()) for _ in range(3)])
    sitk.WriteImage(series, str(dump.folder / "series.mha"))
    dump.as_itk_reads("series.mha")
    # Written by hand: variants that SimpleITK does not write.
    head = ("NDims = 3\nDimSize = 7 5 4\nElementSize = 0.5 1.25 3\nPosition = 1 2 3\n"
            f"Rotation = {' '.join(str(v) for v in OBLIQUE.T.flatten())}\n")
    for dtype, met in [("int16", "MET_SHORT"), ("float32", "MET_FLOAT"), ("float64", "MET_DOUBLE")]:
        array = samples(dtype)
        big = array.flatten(order="F").astype(array.dtype.newbyteorder(">")).tobytes()
        start = f"ObjectType = Image\n{head}ElementType = {met}\n"
        msb = start + "BinaryDataByteOrderMSB = True\n"
        (dump.folder / f"msb_{dtype}.mha").write_bytes((msb + "ElementDataFile = LOCAL\n").encode() + big)
        (dump.folder / f"end_{dtype}.raw").write_bytes(b"x" * 17 + big)
        (dump.folder / f"end_{dtype}.mhd").write_text(msb + f"HeaderSize = -1\nElementDataFile = end_{dtype}.raw\n")
        (dump.folder / f"skip_{dtype}.mhd").write_text(msb + f"HeaderSize = 17\nElementDataFile = end_{dtype}.raw\n")
        names = [f"msb_{dtype}.mha", f"end_{dtype}.mhd", f"skip_{dtype}.mhd"]
        if dtype == "int16":
            words = " ".join(str(v) for v in array.flatten(order="F"))
            (dump.folder / "text.mha").write_text(start + "BinaryData = False\nElementDataFile = LOCAL\n" + words + "\n")
            for z in range(4):
                (dump.folder / f"meta{z + 1:02d}.raw").write_bytes(array[:, :, z].flatten(order="F").astype(">i2").tobytes())
            listed = "".join(f"meta{z + 1:02d}.raw\n" for z in range(4))
            (dump.folder / "list.mhd").write_text(msb + "ElementDataFile = LIST\n" + listed)
            (dump.folder / "pattern.mhd").write_text(msb + "ElementDataFile = meta%02d.raw 1 4 1\n")
            names += ["text.mha", "list.mhd", "pattern.mhd"]
        for name in names:
            dump.as_itk_reads(name)
            assert np.array_equal(sitk.GetArrayFromImage(sitk.ReadImage(str(dump.folder / name))).T, array), name


def write_numpy(dump):
    def put(name, array, values, channels=1, times=1):
        np.save(dump.folder / name, array)
        read = np.load(dump.folder / name)
        assert read.flags.f_contiguous == array.flags.f_contiguous
        origin = [-0.5 * (n - 1) for n in values.shape[::-1]]
        dump.add(name, values.T, [1, 1, 1], IDENTITY, origin, channels, times)

    shape = DIMS[::-1]
    for dtype in [*TYPES, "bool", "float16"]:
        array = samples("uint8", shape) > 99 if dtype == "bool" else samples("float32" if dtype == "float16" else dtype, shape).astype(dtype)
        for order in ["C", "F"]:
            for endian in ["<", ">"]:
                stored = np.asarray(array.astype(array.dtype.newbyteorder(endian)), order=order)
                put(f"{dtype}_{order}_{'little' if endian == '<' else 'big'}.npy", stored, array)
    for order in ["C", "F"]:
        for count in [2, 3, 4]:
            array = np.asarray(samples("uint8", (*shape, count)), order=order)
            put(f"channels{count}_{order}.npy", array, array[..., 0], channels=count)
        array = np.asarray(samples("uint8", (3, *shape)), order=order)
        put(f"times_{order}.npy", array, array[0], times=3)
        array = np.asarray(samples("uint8", (6, 9)), order=order)
        put(f"plane_{order}.npy", array, array[None])


def main():
    root = pathlib.Path(sys.argv[1])
    whole = Dump(root)
    for name, write in [("nrrd", write_nrrd), ("nifti", write_nifti), ("meta", write_meta), ("numpy", write_numpy)]:
        (root / name).mkdir(parents=True, exist_ok=True)
        part = Dump(root / name)
        write(part)
        for line in part.lines:
            line["file"] = f"{name}/{line['file']}"
            line["dump"] = f"{name}/{line['dump']}"
        whole.lines += part.lines
    if len(sys.argv) > 2:
        data = pathlib.Path(sys.argv[2])
        for path in sorted(data.glob("volumes/*.nrrd")) + [data / "formats/ct_stent_u8.mhd"]:
            whole.as_itk_reads(str(path.relative_to(data)), path, data=True)
        path = data / "volumes/mri_head_ch2.nii.gz"
        whole.as_nibabel_reads(str(path.relative_to(data)), path=path, data=True)
    whole.write()
    print(f"{len(whole.lines)} files")


if __name__ == "__main__":
    main()
