"""In: the folder of the reference data's scorer, a cloud, the mesh of its true surface. Out: two lines, the shares of
the points that lie within one and beyond three of their stated standard deviations. Frame and unit: base frame, mm.

    python3 honest.py SCORER cloud.ply mesh.ply
"""

import sys

import numpy as np

sys.path.insert(0, sys.argv[1])
import score

TYPES = {"float": "<f4", "int": "<i4", "uint": "<u4"}


def cloud(path):
    """Structured array of a binary PLY's points."""
    with open(path, "rb") as f:
        fields, count = [], 0
        while (words := f.readline().decode().split()) != ["end_header"]:
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            if words[0] == "property":
                fields.append((words[2], TYPES[words[1]]))
        return np.frombuffer(f.read(), np.dtype(fields), count)


points = cloud(sys.argv[2])
vertices, faces = score.read_ply(sys.argv[3])
places = np.stack([points[axis] for axis in "xyz"], 1).astype(float)
sigmas = score.mesh_distance(places, vertices, faces) / points["sigma_mm"]
print((sigmas < 1).mean())
print((sigmas > 3).mean())
