#!/usr/bin/env python3
"""make_seeds.py [CORPUS]: the small inputs from which the fuzz targets of volumes, labels, tables, markups and
`inspect` start, one for each kind that was met in the field; what fuzzing has found lies beside them and stays."""
import gzip
import math
import pathlib
import struct
import sys
import zlib

CORPUS = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent / "corpus")
NEXT_FILE = b"-next-file-"  # as in fuzz.h


def seed(kind, name, data):
    folder = CORPUS / kind
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())


def packed(data):
    return gzip.compress(data, mtime=0)


# ---- Volumes -----------------------------------------------------------------------------------------

SHORTS = struct.pack("<8h", *range(0, 800, 100))
PLAIN_ROWS = (-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0)


def nifti(voxels=SHORTS, kind=4, dim=(3, 2, 2, 2, 1, 1, 1, 1), rows=PLAIN_ROWS, codes=(0, 1), units=2, order="<",
          scale=(0.0, 0.0), quaternion=(0, 0, 0, 0, 0, 0), extension=b"", magic=b"n+1\0"):
    """NIfTI-1, fields of nifti1.h."""
    data = bytearray(352)
    put = lambda at, form, *values: struct.pack_into(order + form, data, at, *values)
    put(0, "i", 348)
    put(40, "8h", *dim)
    put(70, "2h", kind, 16)
    put(76, "8f", 1, 1, 1, 1, 1, 1, 1, 1)
    put(108, "3f", 352 + len(extension), *scale)
    put(123, "b", units)
    put(252, "2h", *codes)
    put(256, "6f", *quaternion)
    put(280, "12f", *rows)
    data[344:348] = magic
    if extension:
        data[348] = 1
    return bytes(data) + extension + voxels


def nifti2(voxels=SHORTS):
    data = bytearray(544)
    put = lambda at, form, *values: struct.pack_into("<" + form, data, at, *values)
    put(0, "i", 540)
    data[4:12] = b"n+2\0\r\n\x1a\n"
    put(12, "2h", 4, 16)
    put(16, "8q", 3, 2, 2, 2, 1, 1, 1, 1)
    put(104, "8d", *[1.0] * 8)
    put(168, "q", 544)
    put(176, "2d", 2.0, 1.0)
    put(344, "2i", 0, 1)
    put(400, "12d", *PLAIN_ROWS)
    put(500, "i", 2)
    return bytes(data) + voxels


def nifti_seeds():
    seed("nifti", "plain.nii", nifti())
    seed("nifti", "packed.nii.gz", packed(nifti()))
    seed("nifti", "micrometres.nii.gz", packed(nifti(units=3)))
    seed("nifti", "metres.nii", nifti(units=1))
    seed("nifti", "shear-of-rounding.nii", nifti(rows=(-1, 1e-3, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0)))
    seed("nifti", "two-forms.nii", nifti(codes=(1, 1), rows=(-1, 0, 0, 0, 0, -1, 0.33, 0, 0, 0, 1, 0)))
    seed("nifti", "qform.nii", nifti(codes=(1, 0), quaternion=(0, 0, 1, 10, 20, 30)))
    seed("nifti", "big-endian.nii", nifti(order=">", voxels=struct.pack(">8h", *range(8))))
    seed("nifti", "scaled.nii", nifti(scale=(2.0, -1000.0)))
    seed("nifti", "floats.nii", nifti(kind=16, voxels=struct.pack("<8f", *range(8))))
    seed("nifti", "doubles.nii", nifti(kind=64, voxels=struct.pack("<8d", *range(8))))
    seed("nifti", "colours.nii", nifti(kind=128, voxels=bytes(24)))
    seed("nifti", "series.nii", nifti(dim=(4, 2, 2, 2, 2, 1, 1, 1), voxels=2 * SHORTS))
    seed("nifti", "extension.nii", nifti(extension=struct.pack("<2i", 16, 6) + b"comment "))
    seed("nifti", "pair.hdr", nifti(magic=b"ni1\0"))
    seed("nifti", "second.nii.gz", packed(nifti2()))


def nrrd(voxels=SHORTS, encoding="raw", more="", kind="short", sizes="2 2 2", space="left-posterior-superior",
         directions="(1,0,0) (0,1,0) (0,0,1)", dimension=3):
    return (f"NRRD0004\n# made by hand\ntype: {kind}\ndimension: {dimension}\nspace: {space}\nsizes: {sizes}\n"
            f"space directions: {directions}\nendian: little\nencoding: {encoding}\n"
            f"space origin: (0,0,0)\n{more}\n").encode() + voxels


def nrrd_seeds():
    numbers = b"0 100 200 300\n400 500 600 700\n"
    seed("nrrd", "centimetres.nrrd", nrrd(more='space units: "cm" "cm" "cm"\n'))
    seed("nrrd", "gzip.seg.nrrd", nrrd(packed(SHORTS), "gzip", "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n"))
    seed("nrrd", "text.nrrd", nrrd(numbers, "ascii"))
    seed("nrrd", "hex.nrrd", nrrd(SHORTS.hex().encode(), "hex"))
    seed("nrrd", "bzip2.nrrd", nrrd(b"BZh91AY&SY", "bzip2"))
    seed("nrrd", "beside.nhdr", nrrd(b"", more="data file: voxels.raw\n"))
    seed("nrrd", "skips.nhdr", nrrd(b"", sizes="2 2 1", more="byte skip: 8\nline skip: 0\ndata file: voxels.raw\n"))
    seed("nrrd", "from-the-end.nrrd", nrrd(b"header\n" + SHORTS, more="byte skip: -1\n"))
    seed("nrrd", "list.nhdr", nrrd(b"voxels.raw\nvoxels.raw\n", sizes="2 2 4", more="data file: LIST\n"))
    seed("nrrd", "pattern.nhdr", nrrd(b"", more="data file: voxels%02d.raw 1 2 1 2\n"))
    seed("nrrd", "ras.nrrd", nrrd(space="right-anterior-superior"))
    seed("nrrd", "spacings.nrrd", b"NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 5\n"
         b"axis mins: 0 0 0\ncenterings: cell cell cell\nlabels: \"x\" \"y\" \"z\"\nencoding: raw\n\n" + bytes(8))
    seed("nrrd", "layers.seg.nrrd", nrrd(bytes([1, 0, 1, 1] * 4), kind="unsigned char", sizes="2 2 2 2",
                                         directions="none (1,0,0) (0,1,0) (0,0,1)", dimension=4,
                                         more="kinds: list domain domain domain\nSegment0_Name:=aorta\n"))
    seed("nrrd", "long-line.nrrd", nrrd(more="kinds: " + "domain " * 200 + "\n"))
    seed("nrrd", "thick.nrrd", nrrd(directions="(1,0,0) (0,1,0) (0,0,5)"))
    seed("nrrd", "block.nrrd", nrrd(kind="block", more="block size: 2\n"))
    seed("nrrd", "old.nrrd", b"NRRD00.01\nnumber: 8\ntype: double\ndimension: 1\nsizes: 8\nencoding: raw\n\n" + bytes(64))


def metaimage(voxels=SHORTS, more="", kind="MET_SHORT", sizes="2 2 2", data="LOCAL", compressed="False",
              binary="True", order="False"):
    return (f"ObjectType = Image\nNDims = 3\nBinaryData = {binary}\nBinaryDataByteOrderMSB = {order}\n"
            f"CompressedData = {compressed}\n{more}TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\n"
            "CenterOfRotation = 0 0 0\nAnatomicalOrientation = RAI\nElementSpacing = 1 1 1\n"
            f"DimSize = {sizes}\nElementType = {kind}\nElementDataFile = {data}\n").encode() + voxels


def metaimage_seeds():
    deflated = zlib.compress(SHORTS)
    seed("metaimage", "packed.mha",
         metaimage(deflated, compressed="True", more=f"CompressedDataSize = {len(deflated)}\n"))
    seed("metaimage", "packed-unsized.mha", metaimage(deflated, compressed="True"))
    seed("metaimage", "beside.mhd", metaimage(b"", data="voxels.raw"))
    seed("metaimage", "header-size.mhd", metaimage(b"", data="voxels.raw", more="HeaderSize = -1\n"))
    seed("metaimage", "numbers.mha", metaimage(b"0 1 2 3 4 5 6 7\n", binary="False", kind="MET_FLOAT"))
    seed("metaimage", "big-endian.mha", metaimage(order="True"))
    seed("metaimage", "centimetres.mha", metaimage(more="DistanceUnits = cm\n"))
    seed("metaimage", "comment.mha", metaimage(more="Comment = Jürgen 左\nModality = MET_MOD_CT\n"))
    seed("metaimage", "scaled.mha", metaimage(more="ElementToIntensityFunctionSlope = 2\n"
                                              "ElementToIntensityFunctionOffset = -1024\n"))
    seed("metaimage", "colours.mha", metaimage(bytes(48), more="ElementNumberOfChannels = 3\n"))
    seed("metaimage", "list.mhd", metaimage(b"voxels.raw\nvoxels.raw\n", data="LIST 2"))
    seed("metaimage", "doubles.mha", metaimage(struct.pack("<8d", *range(8)), kind="MET_DOUBLE"))
    seed("metaimage", "flat.mha", b"NDims = 2\nDimSize = 4 4\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
         + bytes(16))


# ---- DICOM -------------------------------------------------------------------------------------------


def element(group, number, representation, value):
    """Explicit, little endian (PS3.5 section 7.1.2)."""
    if isinstance(value, str):
        value = value.encode()
    if isinstance(value, int):
        value = struct.pack("<H", value)
    if len(value) % 2:
        value += b"\0" if representation in ("UI", "OB") else b" "
    head = struct.pack("<2H", group, number) + representation.encode()
    if representation in ("OB", "OW", "SQ", "UN"):
        return head + struct.pack("<HI", 0, len(value)) + value
    return head + struct.pack("<H", len(value)) + value


def sequence(group, number, items):
    return element(group, number, "SQ", b"".join(struct.pack("<2HI", 0xFFFE, 0xE000, len(i)) + i for i in items))


def head_of_file(syntax, ct):
    meta = (element(2, 1, "OB", b"\0\1") + element(2, 2, "UI", ct) + element(2, 3, "UI", "1.2.3.9")
            + element(2, 0x10, "UI", syntax))
    return bytes(128) + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta))) + meta


def run_lengths(pixels):
    """Each byte of the 16 bits as one literal run (PS3.5 annex G), in one fragment."""
    high, low = [bytes([len(half) - 1]) + half for half in (pixels[1::2], pixels[0::2])]
    high += b"\0" * (len(high) % 2)
    fragment = struct.pack("<16I", 2, 64, 64 + len(high), *[0] * 13) + high + low
    fragment += b"\0" * (len(fragment) % 2)
    item = lambda number, data: struct.pack("<2HI", 0xFFFE, number, len(data)) + data
    return (struct.pack("<2H2sHI", 0x7FE0, 0x10, b"OB", 0, 0xFFFFFFFF) + item(0xE000, b"") + item(0xE000, fragment)
            + item(0xE0DD, b""))


def dicom(z=0.0, series="1.2.4", syntax="1.2.840.10008.1.2.1", head=True, slope="1", axes="1\\0\\0\\0\\1\\0", y=0.0,
          unit="", modality="CT", description="", frames=0, groups=b"", implicit=False):
    """A slice of 2 x 2 pixels, or so many frames."""
    ct = "1.2.840.10008.5.1.4.1.1.2" + (".1" if groups else "")
    pixels = struct.pack("<4h", 1, 2, 3, int(z * 10)) * max(1, frames)
    body = [element(8, 0x16, "UI", ct), element(8, 0x18, "UI", f"1.2.3.{int(z * 10)}"),
            element(8, 0x60, "CS", modality)]
    if description:
        body.append(element(8, 0x103E, "LO", description))
    body += [element(0x10, 0x10, "PN", "NOBODY^N"), element(0x20, 0xD, "UI", "1.2.3"),
             element(0x20, 0xE, "UI", series), element(0x20, 0x11, "IS", series[-1])]
    if not groups:
        body += [element(0x20, 0x32, "DS", f"0\\{y:g}\\{z:g}"), element(0x20, 0x37, "DS", axes)]
    body += [element(0x28, 2, "US", 1), element(0x28, 4, "CS", "MONOCHROME2")]
    if frames:
        body.append(element(0x28, 8, "IS", str(frames)))
    body += [element(0x28, 0x10, "US", 2), element(0x28, 0x11, "US", 2)]
    if not groups:
        body.append(element(0x28, 0x30, "DS", "1\\1"))
    body += [element(0x28, 0x100, "US", 16), element(0x28, 0x101, "US", 16), element(0x28, 0x102, "US", 15),
             element(0x28, 0x103, "US", 1)]
    if not groups:
        body += [element(0x28, 0x1052, "DS", "0"), element(0x28, 0x1053, "DS", slope)]
    if unit:
        body.append(element(0x28, 0x1054, "LO", unit))
    body.append(groups)
    body.append(run_lengths(pixels) if syntax.endswith(".5") else element(0x7FE0, 0x10, "OW", pixels))
    return (head_of_file(syntax, ct) if head else b"") + b"".join(body)


def enhanced(places, slopes=None):
    each = []
    for k, place in enumerate(places):
        group = sequence(0x20, 0x9113, [element(0x20, 0x32, "DS", f"5\\6\\{place:g}")])
        slope = slopes[k] if slopes else "1"
        group += sequence(0x28, 0x9145, [element(0x28, 0x1052, "DS", "0") + element(0x28, 0x1053, "DS", slope)
                                         + element(0x28, 0x1054, "LO", "HU")])
        each.append(group)
    shared = (sequence(0x20, 0x9116, [element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0")])
              + sequence(0x28, 0x9110, [element(0x18, 0x50, "DS", "9") + element(0x28, 0x30, "DS", "0.8\\0.6")]))
    return dicom(frames=len(places), groups=sequence(0x5200, 0x9229, [shared]) + sequence(0x5200, 0x9230, each))


def dicom_folders():
    """By name, each a list of files."""
    slices = [dicom(z) for z in (0.0, 1.5, 3.0)]
    return {
        "classic": slices,
        "thick": [dicom(z) for z in (0.0, 5.0, 10.0, 15.0)],
        "every-second-without-head": [slices[0], dicom(1.5, head=False), slices[2]],
        "zeros-behind-one": [slices[0], slices[1] + bytes(37), slices[2]],
        "shuffled-frames": [enhanced([3.0, 0.0, 1.5])],
        "slopes-of-frames": [enhanced([0.0, 1.5, 3.0], ["1", "0.5", "1"])],
        "frames-without-places": [dicom(frames=3)],
        "frames-in-two-files": [dicom(frames=2), dicom(9.0, frames=2)],
        "tilted": [dicom(z, y=z * math.tan(math.radians(14.0))) for z in (0.0, 3.0, 6.0)],
        "one-place": [dicom(61.5), dicom(61.5), dicom(61.5)],
        "one-missing": [dicom(z) for z in (0.0, 1.5, 4.5)],
        "two-series": slices[:2] + [dicom(z, series="1.2.5", description="Thorax") for z in (0.0, 2.0)],
        "one-cut": slices[:2] + [slices[2][:-3]],
        "run-lengths": [dicom(z, syntax="1.2.840.10008.1.2.5") for z in (0.0, 1.5)],
        "in-an-unknown-syntax": [dicom(0.0, syntax="1.4.840.10008.1.2.1").replace(b"PN\x08\x00", b"P\x9c\x9c\x9c\x9c\x9c")],
        "two-energies": [dicom(z, unit="Z_EFF") for z in (0.0, 1.5)],
        "a-note": [slices[0], b"no image", slices[1]],
        "turned": [dicom(z, axes="0\\1\\0\\0\\0\\-1", modality="MR") for z in (0.0, 1.5)],
    }


def dicom_seeds():
    for name, files in dicom_folders().items():
        for mode, what in ((b"0", "read"), (b"1", "told")):  # to be read, or described
            seed("dicom", f"{name}.{what}", mode + NEXT_FILE.join(files))


# ---- Labels, tables and markups ----------------------------------------------------------------------


def mode_of(kind, names=False, values=False, table=False, wins=False, onto=False):
    """The first byte of fuzz_labels."""
    return bytes([kind | names << 2 | values << 3 | table << 4 | wins << 5 | onto << 6])


def labels_seeds():
    names = "Segment0_LabelValue:=1\nSegment0_Layer:=0\nSegment0_Name:=aorta\n" \
            "Segment1_ID:=Segment_2\nSegment1_LabelValue:=2\nSegment1_Layer:=0\nSegment1_Name:=renal left\n"
    eight = bytes([0, 1, 2, 2, 1, 1, 0, 0])
    single = nrrd(eight, kind="unsigned char", more=names)
    layers = nrrd(bytes([1, 0, 1, 1] * 4), kind="unsigned char", sizes="2 2 2 2", dimension=4,
                  directions="none (1,0,0) (0,1,0) (0,0,1)",
                  more="kinds: list domain domain domain\n" + names.replace("LabelValue:=2\nSegment1_Layer:=0",
                                                                            "LabelValue:=1\nSegment1_Layer:=1"))
    old = nrrd(bytes([1, 0, 1, 1] * 4), kind="unsigned char", sizes="2 2 2 2", dimension=4,
               directions="none (1,0,0) (0,1,0) (0,0,1)",
               more="kinds: list domain domain domain\nSegment0_Name:=aorta\nSegment1_Name:=renal left\n")
    seed("labels", "segments.seg.nrrd", mode_of(0, names=True) + single)
    seed("labels", "segments-onto.seg.nrrd", mode_of(0, names=True, onto=True) + single)
    seed("labels", "layers.seg.nrrd", mode_of(0, names=True) + layers)
    seed("labels", "old-layers.seg.nrrd", mode_of(0, names=True) + old)
    seed("labels", "values.seg.nrrd", mode_of(0, values=True, table=True, wins=True) + single)
    plain = nifti(eight, kind=2)
    seed("labels", "values.nii", mode_of(1, values=True) + plain)
    seed("labels", "both.nii.gz", mode_of(1, names=True, values=True, onto=True) + packed(plain))
    seed("labels", "table.nii", mode_of(1, names=True, table=True) + plain)
    seed("labels", "floats.nii", mode_of(1, values=True) + nifti(struct.pack("<8f", *eight), kind=16))
    seed("labels", "fractions.nii", mode_of(1, values=True) + nifti(struct.pack("<8f", *[0.5] * 8), kind=16))
    seed("labels", "one-class.mha", mode_of(2) + metaimage(bytes([0, 3] * 4), kind="MET_UCHAR"))
    seed("labels", "values.mha", mode_of(2, values=True, onto=True) + metaimage(eight, kind="MET_UCHAR"))
    one = nifti(bytes([0, 1] * 4), kind=2)
    two = nrrd(bytes([1, 0] * 4), kind="unsigned char", directions="(1,0,0) (0,1,0) (0,0,1.5)")
    for name, onto in (("folder", False), ("folder-onto", True)):
        seed("labels", name, mode_of(3, names=True, onto=onto) + one + NEXT_FILE + two)


def table_seeds():
    tables = {
        "dataset.json": '{"name": "x", "labels": {"background": 0, "aorta": 1, "renal left": 7, "both": [1, 7]}}',
        "old-dataset.json": '{"labels": {"0": "background", "1": "aorta", "7": "renal left"}}',
        "values.json": '{"1": "aorta", "7": "renal left"}',
        "names.json": '{"aorta": 1, "renal left": 7}',
        "nested.json": '{"labels": {"aorta": {"value": 1, "colour": [255, 0, 0]}}}',
        "comma.csv": "value,name\n1,aorta\n7,\"renal, left\"\n",
        "semicolon.csv": "name;value\naorta;1\nrenal left;7\n",
        "tab.csv": "aorta\t1\nrenal left\t7\r\n",
        "statistics.csv": "label,name,voxels\n1,aorta,4711\n7,renal left,815\n",
        "snap.txt": "# ITK-SnAP\n0 0 0 0 0 0 0 \"Clear Label\"\n1 255 0 0 1 1 1 \"aorta\"\n",
        "totalsegmentator.txt": "1 aorta\n7 renal left\n",
        "bom.txt": "\ufeff1 Größe\n2 左\n",
        "slicer.ctbl": "# Color table file\n0 background 0 0 0 0\n1 aorta 255 0 0 255\n7 renal_left 0 255 0 255\n",
        "quoted.ctbl": "1 \"aorta\" 255 0 0 255\n7 \"renal left\" 0 255 0 255\n",
    }
    which = {".json": b"0", ".csv": b"1", ".txt": b"2", ".ctbl": b"3"}
    for name, text in tables.items():
        seed("label_table", name, which[pathlib.Path(name).suffix] + text.encode())


def markups_seeds():
    point = '{"id": "1", "label": "entry", "position": [1.5, -2.0, 3e1], "positionStatus": "defined"}'
    empty = '{"id": "2", "label": "later", "position": [0, 0, 0], "positionStatus": "undefined"}'
    def markup(kind, frame, points, more=""):
        return f'{{"type": "{kind}", "coordinateSystem": {frame}{more}, "controlPoints": [{points}]}}'
    files = {
        "lps.mrk.json": markup("Fiducial", '"LPS"', point + ", " + empty, ', "coordinateUnits": "mm"'),
        "ras.mrk.json": markup("Fiducial", '"RAS"', point),
        "numbered.mrk.json": markup("Curve", "0", point.replace("entry", "Jürgen 左")),
        "several.mrk.json": markup("Fiducial", '"LPS"', point) + ", " + markup("ClosedCurve", '"LPS"', point),
        "metres.mrk.json": markup("Fiducial", '"LPS"', point, ', "coordinateUnits": "m"'),
        "null.mrk.json": markup("Fiducial", '"LPS"', point.replace("-2.0", "null")),
    }
    for name, text in files.items():
        seed("markups", name, '0{"@schema": "markups-schema-v1.0.3.json#", "markups": [' + text + "]}")
    columns = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    row = "vtkMRMLMarkupsFiducialNode_0,1.5,-2,30,0,0,0,1,1,1,0,{},,vtkMRMLScalarVolumeNode1\n"
    for name, frame in (("ras.fcsv", "RAS"), ("lps.fcsv", "LPS"), ("numbered.fcsv", "0")):
        seed("markups", name, "1# Markups fiducial file version = 4.11\n"
             f"# CoordinateSystem = {frame}\n{columns}" + row.format("entry") + row.format('"a, b"'))
    seed("markups", "columns.fcsv", "1# Markups fiducial file version = 5.2\n# columns = label,z,y,x,sel\n"
         "\"the \"\"entry\"\"\",3,2,1,1\nout,0,0,0,undefined\n")
    seed("markups", "points.csv", "2label,r,a,s,defined,selected\nentry,1,2,3,1,1\nout,0,0,0,0,1\n")
    seed("markups", "points.tsv", "2s\tp\tl\tlabel\n3\t2\t1\tentry\n")
    seed("markups", "bare.fcsv", "1# Markups fiducial file version = 4.6\n" + row.format("entry"))


# ---- inspect -----------------------------------------------------------------------------------------


def inspect_seeds():
    corners = ((0, 0, 0), (20, 0, 0), (0, 20, 0), (0, 0, 20))
    faces = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    ascii_stl = "solid 左心房\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*corners[k]) for k in face)
        + "endloop\nendfacet\n" for face in faces) + "endsolid\n"
    binary_stl = bytes(80) + struct.pack("<I", 4) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *[x for k in face for x in corners[k]], 0) for face in faces)
    ply = ("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
           + "".join("{} {} {}\n".format(*c) for c in corners) + "".join("3 {} {} {}\n".format(*f) for f in faces))
    obj = "".join("v {} {} {}\n".format(*c) for c in corners) + "".join(
        "f {} {} {}\n".format(*[k + 1 for k in f]) for f in faces)
    array = lambda kind, more, text: f'<DataArray type="{kind}" {more} format="ascii">{text}</DataArray>'
    numbers = lambda rows: " ".join(str(x) for row in rows for x in row)
    vtp = ('<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"><PolyData>'
           '<FieldData><Array type="String" Name="SPACE" NumberOfTuples="1" format="ascii">82 65 83 0</Array>'
           '</FieldData><Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" '
           'NumberOfPolys="4"><Points>' + array("Float32", 'NumberOfComponents="3"', numbers(corners))
           + "</Points><Polys>" + array("Int64", 'Name="connectivity"', numbers(faces))
           + array("Int64", 'Name="offsets"', "3 6 9 12") + "</Polys></Piece></PolyData></VTKFile>")
    eight = bytes([0, 1, 2, 2, 1, 1, 0, 0])
    seed("inspect", "image.nii", b"0" + nifti())
    seed("inspect", "labels.nii", b"0" + nifti(bytes(40) + bytes([1] * 30), kind=2, dim=(3, 7, 2, 5, 1, 1, 1, 1)))
    seed("inspect", "segments.nrrd", b"1" + nrrd(eight, kind="unsigned char",
                                                 more="Segment0_Name:=aorta\nSegment0_LabelValue:=1\n"))
    seed("inspect", "units.mha", b"2" + metaimage(more="DistanceUnits = cm\n"))
    for first, name, data in ((b"3", "named.stl", ascii_stl), (b"3", "binary.stl", binary_stl), (b"4", "a.ply", ply),
                              (b"5", "a.obj", obj), (b"6", "ras.vtp", vtp)):
        seed("inspect", name, first + (data if isinstance(data, bytes) else data.encode()))
    seed("inspect", "slice.dcm", b"7" + dicom())
    seed("inspect", "frames.dcm", b"7" + enhanced([0.0, 1.5, 3.0]))


nifti_seeds()
nrrd_seeds()
metaimage_seeds()
dicom_seeds()
labels_seeds()
table_seeds()
markups_seeds()
inspect_seeds()
