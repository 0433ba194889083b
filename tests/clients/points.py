"""usd-core reads the grains of a frame and finds the values of its records (benches/gates/grain_readers.rs).

python points.py FILE.usda RECORDS FRAME
"""

import pathlib
import struct
import sys

from pxr import Usd, UsdGeom

records = list(struct.iter_unpack("<q3d3f3ff2i", pathlib.Path(sys.argv[2]).read_bytes()))
frame = int(sys.argv[3])
stage = Usd.Stage.Open(sys.argv[1])
assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
points = UsdGeom.Points(stage.GetDefaultPrim())
assert points, "no points"
primvars = UsdGeom.PrimvarsAPI(points)


def single(numbers):
    """Rounded to 32 bits."""
    return struct.unpack(f"<{len(numbers)}f", struct.pack(f"<{len(numbers)}f", *numbers))


ids = list(points.GetIdsAttr().Get(frame))
places, velocities = points.GetPointsAttr().Get(frame), points.GetVelocitiesAttr().Get(frame)
widths = list(points.GetWidthsAttr().Get(frame))
active, source_frame, rest = (primvars.GetPrimvar(name).Get(frame) for name in ("active", "source_frame", "rest"))
assert points.GetWidthsInterpolation() == UsdGeom.Tokens.vertex and len(widths) == len(ids)
assert len(ids) == len(places) == len(velocities) == len(active) == len(source_frame) == len(rest) == len(records)
order = sorted(range(len(ids)), key=ids.__getitem__)
for at, record in zip(order, records):
    assert ids[at] == record[0]
    assert tuple(places[at]) == single(record[1:4]), (tuple(places[at]), record[1:4])
    assert tuple(velocities[at]) == record[4:7]
    assert tuple(rest[at]) == record[7:10]
    assert widths[at] == 2 * record[10]
    assert (source_frame[at], active[at]) == record[11:13]
print(f"frazil: {len(ids)} grains")
