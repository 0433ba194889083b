"""usd-core reads the arrays of a mesh: their types, what has a value each, and every value.

python primvars.py FILE.usda PRIM FRAME WANTED.json

WANTED.json: {"mask": {"type": "double[]", "interpolation": "vertex", "values": [0.5, null]}}; null stands for NaN.
"""

import json
import math
import pathlib
import struct
import sys

from pxr import Usd, UsdGeom

frame = int(sys.argv[3])
wanted = json.loads(pathlib.Path(sys.argv[4]).read_text())
stage = Usd.Stage.Open(sys.argv[1])
mesh = UsdGeom.Mesh(stage.GetPrimAtPath(sys.argv[2]))
assert mesh, f"no mesh {sys.argv[2]}"
counts = {
    "vertex": len(mesh.GetPointsAttr().Get(frame)),
    "uniform": len(mesh.GetFaceVertexCountsAttr().Get(frame)),
    "faceVarying": len(mesh.GetFaceVertexIndicesAttr().Get(frame)),
}
assert all(counts.values()), counts


def parts(value):
    """The numbers of a value: one, or those of a vector."""
    return list(value) if hasattr(value, "__len__") else [value]


def same(got, want, is_single):
    """Whether a number is the wanted one, rounded to 32 bits where USD holds so many."""
    if want is None:
        return math.isnan(got)
    return got == (struct.unpack("<f", struct.pack("<f", want))[0] if is_single else want)


primvars = UsdGeom.PrimvarsAPI(mesh)
# Every mesh has a displayColor and a displayOpacity, which need not have a value.
names = {primvar.GetPrimvarName() for primvar in primvars.GetPrimvars() if primvar.HasValue()} - {"st", "normals"}
assert names == set(wanted), (sorted(names), sorted(wanted))
for name, want in wanted.items():
    primvar = primvars.GetPrimvar(name)
    assert primvar.GetTypeName() == want["type"], (name, primvar.GetTypeName())
    assert primvar.GetInterpolation() == want["interpolation"], (name, primvar.GetInterpolation())
    assert not primvar.IsIndexed(), name
    values = primvar.Get(frame)
    assert values is not None and len(values) == len(want["values"]) == counts[want["interpolation"]], name
    is_single = "float" in want["type"] or "3f" in want["type"]
    for at, (got, value) in enumerate(zip(values, want["values"])):
        got, value = parts(got), parts(value)
        assert len(got) == len(value) and all(map(same, got, value, [is_single] * len(got))), (name, at, got, value)
print(f"frazil: {len(wanted)} arrays")
