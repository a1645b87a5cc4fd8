"""Reads Sheetlight's devices with an independent GenICam program (harvesters, with the GenApi and GenTL of EMVA) and
compares the frames with the scan's files, which it reads itself.

harvest.py PRODUCER SCAN FRAMES: SCAN is a folder that `sheetlight scan` wrote; the list of devices is named by
SHEETLIGHT_GENTL. Prints one line per check; a failed one ends the program.
"""

import json
import pathlib
import struct
import sys

import numpy as np
from genicam import genapi, gentl
from harvesters.core import Harvester

producer, scan, frames = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])


def check(name, good, seen=""):
    print(("ok    " if good else "FAIL  ") + name, seen)
    if not good:
        sys.exit(1)


def float_tiff(path):
    """A TIFF of one page of 32-bit floats, strip by strip."""
    data = path.read_bytes()
    assert data[:4] == b"II*\0", path
    (at,) = struct.unpack_from("<I", data, 4)
    tags = {}
    for i in range(struct.unpack_from("<H", data, at)[0]):
        tag, kind, count = struct.unpack_from("<HHI", data, at + 2 + 12 * i)
        size = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8}[kind] * count
        place = at + 10 + 12 * i
        if size > 4:
            (place,) = struct.unpack_from("<I", data, place)
        if kind in (3, 4):
            tags[tag] = struct.unpack_from("<%d%s" % (count, "H" if kind == 3 else "I"), data, place)
    assert tags.get(259, (1,)) == (1,) and tags[258] == (32,) and tags[339] == (3,), path
    strips = zip(tags[273], tags[279])
    return np.frombuffer(b"".join(data[o : o + n] for o, n in strips), "<f4").reshape(tags[257][0], tags[256][0])


def cloud(path):
    """The points of cloud.ply, by its header."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    lines = data[:end].decode().split("\n")
    count = int(next(l for l in lines if l.startswith("element vertex")).split()[2])
    kinds = {"float": "<f4", "int": "<i4"}
    fields = [(l.split()[2], kinds[l.split()[1]]) for l in lines if l.startswith("property")]
    return np.frombuffer(data, np.dtype(fields), count, end)


def near(a, b):
    """Equal to one step of a 32-bit float; NaN where the other is NaN."""
    a, b = np.asarray(a, np.float32), np.asarray(b, np.float32)
    both = np.isfinite(a) & np.isfinite(b)
    same = np.isfinite(a) == np.isfinite(b)
    return bool(same.all() and (np.abs(a[both].astype(float) - b[both]) <= np.spacing(np.abs(b[both]))).all())


def refused(what):
    try:
        what()
    except Exception as error:  # Each kind of value has its own error.
        return " ".join(str(error).split()) or type(error).__name__
    return ""


z, intensity, sigma = (float_tiff(scan / f"{name}.tif") for name in ("height", "intensity", "sigma"))
scale = json.loads((scan / "height.json").read_text())
rows, columns = z.shape
pose = np.array(scale["base_T_grid"]).reshape(4, 4)
cell = scale["cell_mm"]
x, y = np.meshgrid((np.arange(columns) + 0.5) * cell, (np.arange(rows) + 0.5) * cell)
points = np.stack([x, y, z, np.ones_like(x)], -1) @ pose.T
wanted_points = np.where(np.isnan(z)[..., None], np.nan, points[..., :3])

harvester = Harvester()
harvester.add_file(producer)
harvester.update()
listed = {d.serial_number: d for d in harvester.device_info_list}
check("devices are listed", {"board", "broken"} <= set(listed), sorted(listed))
check("a broken folder has no access", listed["broken"].access_status == gentl.DEVICE_ACCESS_STATUS_LIST(3).value)
why = refused(lambda: harvester.create({"serial_number": "broken"}))
check("its opening says why", "nowhere" in why, why)

device = harvester.create({"serial_number": "board"})
node = device.remote_device.node_map
check("vendor and model", (node.DeviceVendorName.value, node.DeviceModelName.value) == ("Sheetlight", "Finished scan"))
check("size", (node.Width.value, node.Height.value) == (columns, rows), f"{columns} x {rows}")
check("unit and frame", (node.Scan3dDistanceUnit.value, node.SheetlightFrame.value) == ("Millimeter", "base"))
for module, feature, value in [(device.system, "TLID", "sheetlight"), (device.interface, "InterfaceID", "sheetlight"),
                               (device.device, "DeviceID", "board"), (device.data_streams[0], "StreamID", "stream0")]:
    seen = getattr(module.node_map, feature).value
    check(f"{feature} by its description", seen == value, seen)


def put(name, value):
    getattr(node, name).value = value


limits = (node.Width.min, node.Width.max)
check("limits of Width", limits == (1, columns), limits)
for name, value in [("Width", 0), ("Width", columns + 1), ("OffsetX", 1), ("PixelFormat", "Mono8"),
                    ("AcquisitionFrameRate", 1e9), ("TriggerSource", "NewScan"), ("AcquisitionMode", "Backwards"),
                    ("WidthMax", 3), ("SheetlightConfidenceHalfSigma", -1.0)]:
    check(f"{name} = {value} is refused", refused(lambda: put(name, value)) != "", refused(lambda: put(name, value)))
before = [getattr(node, n).value for n in ("Width", "OffsetX", "PixelFormat", "AcquisitionMode")]
check("nothing changed by that", before == [columns, 0, "Coord3D_ABC32f", "Continuous"], before)

# All three components, again and again.
node.AcquisitionFrameRate.value = 10000.0
device.num_buffers = 3
device.start()
check("locked while it runs", refused(lambda: put("Width", 1)) != "")
ids, times, components = [], [], None
for n in range(frames):
    with device.fetch(timeout=20) as buffer:
        ids.append(buffer.module.frame_id)
        times.append(buffer.timestamp_ns)
        parts = buffer.payload.components
        if n in (0, frames - 1):
            xyz = parts[0].data.reshape(rows, columns, 3)
            check(f"frame {n}: points are those of the map", near(xyz, wanted_points))
            grey = np.nan_to_num(np.floor(intensity + 0.5))
            check(f"frame {n}: intensity", (parts[1].data.reshape(rows, columns) == grey).all())
            wanted = np.where(np.isnan(sigma), 0, np.maximum(1, np.floor(255 / (1 + sigma / 0.1) + 0.5)))
            far = np.abs(parts[2].data.reshape(rows, columns) - wanted).max()
            check(f"frame {n}: confidence", far <= 1, far)
            check(f"frame {n}: formats", [p.data_format for p in parts] == ["Coord3D_ABC32f", "Mono16", "Confidence8"])
device.stop()
check(f"{frames} frames without a gap", ids == list(range(1, frames + 1)), f"{ids[0]} to {ids[-1]}")
check("time passes", all(a < b for a, b in zip(times, times[1:])))


def one():
    device.start()
    with device.fetch(timeout=20) as buffer:
        part = buffer.payload.components[0]
        answer = (np.array(part.data), part.width, part.height, part.x_offset, part.y_offset,
                  buffer.payload_type, part.data_format)
    device.stop()
    return answer


def only(component):
    for name in (component, *({"Range", "Intensity", "Confidence"} - {component})):
        node.ComponentSelector.value = name
        node.ComponentEnable.value = name == component


# One component: a plain image, here of a part of the map.
only("Range")
node.ComponentSelector.value = "Range"
check("the last component stays", refused(lambda: put("ComponentEnable", False)) != "")
node.PixelFormat.value = "Coord3D_C16"
check("the output follows", node.Scan3dOutputMode.value == "RectifiedC")
node.Width.value, node.Height.value = columns - 7, rows - 5
node.OffsetX.value, node.OffsetY.value = 4, 3
data, width, height, left, top, payload, format_ = one()
check("a plain image", (payload, format_) == (gentl.PAYLOADTYPE_INFO_IDS.PAYLOAD_TYPE_IMAGE, "Coord3D_C16"))
check("the region", (width, height, left, top) == (columns - 7, rows - 5, 4, 3))
part = np.s_[3 : rows - 2, 4 : columns - 3]
raw = data.reshape(height, width)
read = {}
for axis in "ABC":
    node.Scan3dCoordinateSelector.value = f"Coordinate{axis}"
    read[axis] = (node.Scan3dCoordinateScale.value, node.Scan3dCoordinateOffset.value,
                  node.Scan3dInvalidDataFlag.value, node.Scan3dInvalidDataValue.value)
step, offset, flag, missing = read["C"]
check("0 is missing", (flag, missing) == (True, 0.0) and ((raw == 0) == np.isnan(z[part])).all())
heights = np.where(raw == 0, np.nan, raw * step + offset)
check("heights to half a step", np.nanmax(np.abs(heights - z[part])) <= 0.5001 * step, step)
check("places of the columns", abs(read["A"][0] * 10 + read["A"][1] - x[0, 14]) < 1e-9)
check("places of the rows", abs(read["B"][0] * 10 + read["B"][1] - y[13, 0]) < 1e-9)
seen = []
for name in ("RotationX", "RotationY", "RotationZ", "TranslationX", "TranslationY", "TranslationZ"):
    node.Scan3dCoordinateReferenceSelector.value = name
    seen.append(node.Scan3dCoordinateReferenceValue.value)
(a, b, c), moved = np.radians(seen[:3]), np.array(seen[3:])


def turn(angle, i, j):
    """The rotation that takes axis i towards axis j."""
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[j, i], matrix[i, j] = np.sin(angle), -np.sin(angle)
    return matrix


full = turn(c, 0, 1) @ turn(b, 2, 0) @ turn(a, 1, 2)
check("the grid's pose", np.allclose(full, pose[:3, :3], atol=1e-9) and np.allclose(moved, pose[:3, 3], atol=1e-9))
node.PixelFormat.value = "Coord3D_C32f"
data, width, height, *_ = one()
check("heights as floats", near(data.reshape(height, width), z[part]))

# The cloud itself.
node.Scan3dOutputMode.value = "CalibratedABC_PointCloud"
all_points = cloud(scan / "cloud.ply")
data, width, height, *_ = one()
xyz = np.stack([all_points["x"], all_points["y"], all_points["z"]], -1)
check("as many points as the cloud", (width, height) == (len(all_points), 1), width)
check("the cloud's points, bit for bit", (data.reshape(-1, 3) == xyz).all())
node.Scan3dOutputMode.value = "CalibratedABC_Grid"
check("back to the map", (node.Width.value, node.Height.value) == (columns, rows))

# Triggers, and modes with an end.
node.TriggerMode.value = "On"
device.start()
check("nothing without a trigger", device.try_fetch(timeout=0.2) is None)
for n in (1, 2):
    node.TriggerSoftware.execute()
    with device.fetch(timeout=20) as buffer:
        check(f"trigger {n}", buffer.module.frame_id == n)
device.stop()
node.TriggerMode.value = "Off"
device.destroy()

for serial, make in (("line", "Recording"), ("simulated", "Simulated station")):
    device = harvester.create({"serial_number": serial})
    node = device.remote_device.node_map
    check(f"{serial}: model", node.DeviceModelName.value == make)
    node.TriggerMode.value = "On"
    device.start()
    means = []
    for n in (1, 2):
        node.TriggerSoftware.execute()
        with device.fetch(timeout=120) as buffer:
            parts = buffer.payload.components
            size = (node.Height.value, node.Width.value, 3)
            means.append(np.array(parts[0].data.reshape(size)))
    device.stop()
    measured = [int(np.isfinite(m[..., 2]).sum()) for m in means]
    check(f"{serial}: frames hold points", min(measured) > 100, measured)
    if serial == "line":
        # The same recording in the same cells as the scan on the disk, with room around them.
        whole = np.full(size, np.nan, np.float32)
        whole[:rows, :columns] = wanted_points
        check("line: the points are those of the scan on the disk", near(means[0], whole))
    same = np.array_equal(means[0], means[1], equal_nan=True)
    check(f"{serial}: {'the same recording gives the same' if serial == 'line' else 'every frame is another'}",
          same == (serial == "line"))
    device.destroy()

# A folder of scans: what is finished after the start is a frame.
device = harvester.create({"serial_number": "folder"})
node = device.remote_device.node_map
check("folder: frames come by themselves", (node.TriggerMode.value, node.TriggerSource.value) == ("On", "NewScan"))
device.start()
check("folder: the old scan is no frame", device.try_fetch(timeout=0.6) is None)
watched = pathlib.Path(sys.argv[4])
(watched / "next").mkdir()
for name in sorted(p.name for p in scan.iterdir() if p.is_file() and p.name != "scan.json") + ["scan.json"]:
    (watched / "next" / name).write_bytes((scan / name).read_bytes())
with device.fetch(timeout=20) as buffer:
    points_of = buffer.payload.components[0].data.reshape(-1, 3)
    check("folder: the new scan is one", np.isfinite(points_of[:, 2]).sum() > 100)
check("folder: and only one", device.try_fetch(timeout=0.6) is None)
device.stop()
device.destroy()
harvester.reset()
print("all checks passed")
