"""usd-core and its validators, and NVIDIA's, find no error in a shot, and find in it what the reports of its frames say.

python contents.py FOLDER

Reports list what the files of a frame hold: {"contents": {KIND: {NAME: {"points": 8, "faces": 12, "extent_m": [low, high]}}}}.
"""

import json
import pathlib
import re
import sys

import usd_validation_nvidia as nvidia
from pxr import Usd, UsdGeom, UsdValidation, UsdVol

folder = pathlib.Path(sys.argv[1]).resolve()
stage = Usd.Stage.Open(str(folder / "shot.usda"))


# What NVIDIA's rules reject wrongly, with the reason.
REJECTED_WRONGLY = {
    # It counts points and faces at the default time, and ours are in the clips of frames.
    "NormalsValidChecker": r"normals have \d+ elements but expected 0 for",
    # They take the arrays of a first frame without points or faces for damaged ones.
    "IndexedPrimvarChecker": r"Primvar indices out of bounds",
    "ValidateTopologyChecker": r"Invalid topology found",
}
OF_EMPTY_FRAMES = ("IndexedPrimvarChecker", "ValidateTopologyChecker")


def is_wrongly_rejected(rule, message, prim):
    """Whether a rule rejects what is right."""
    if re.search(REJECTED_WRONGLY.get(rule, "^$"), message) is None:
        return False
    path = re.search(r"/shot[\w/]*\w", prim.split("path=")[-1]).group()
    first = UsdGeom.Imageable(stage.GetPrimAtPath(path)).ComputeVisibility(stage.GetStartTimeCode())
    return rule not in OF_EMPTY_FRAMES or first == UsdGeom.Tokens.invisible


def faults():
    """The errors that validators report; what they only warn of (values that could be indexed) is not one."""
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    for error in context.Validate(stage):
        yield f"usd-core: {error.GetName()}: {error.GetMessage()}"
    engine = nvidia.ValidationEngine(init_rules=True)
    for issue in engine.validate(str(folder / "shot.usda")).issues():
        rule = issue.rule.__name__ if issue.rule else ""
        is_error = issue.severity in (nvidia.IssueSeverity.ERROR, nvidia.IssueSeverity.FAILURE)
        if is_error and not is_wrongly_rejected(rule, issue.message, str(issue.at)):
            yield f"NVIDIA: {rule}: {issue.message} {issue.at or ''}"[:300]


def volume(kind, grid):
    """The prim of a grid in the files of a kind."""
    for prim in stage.Traverse():
        if prim.IsA(UsdVol.OpenVDBAsset):
            asset = UsdVol.OpenVDBAsset(prim)
            path = asset.GetFilePathAttr().Get(stage.GetStartTimeCode())
            if asset.GetFieldNameAttr().Get() == grid and path and f"/{kind}/" in path.path:
                return prim.GetParent()
    return None


def is_close(box, other):
    """Whether two boxes are the same but for the rounding of their numbers to 32 bits."""
    return all(abs(a - b) < 1e-6 * max(1.0, abs(a)) for low, high in zip(box, other) for a, b in zip(low, high))


def differences(kind, name, held, frame):
    """How a prim differs from what the report of a frame says of it."""
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/shot/{kind}/{name}"))
    points = UsdGeom.Points(stage.GetPrimAtPath(f"/shot/{kind}"))
    if "faces" in held:
        prim, found = mesh.GetPrim(), {
            "points": len(mesh.GetPointsAttr().Get(frame)),
            "faces": len(mesh.GetFaceVertexCountsAttr().Get(frame)),
        }
    elif "points" in held:
        prim, found = points.GetPrim(), {"points": len(points.GetPointsAttr().Get(frame))}
    else:
        prim, found = volume(kind, name), {}
        if prim is None:
            yield "is not in the shot"
            return
    for count in found:
        if found[count] != held[count]:
            yield f"has {found[count]} {count}, not {held[count]}"
    shown = UsdGeom.Imageable(prim).ComputeVisibility(frame) != UsdGeom.Tokens.invisible
    is_full = held["extent_m"] is not None and held.get("faces", 1) > 0
    if shown != is_full:
        yield f"is {'' if shown else 'in'}visible with {held}"
    if is_full:
        extent = UsdGeom.Boundable(prim).GetExtentAttr().Get(frame)
        if not extent or not is_close(extent, held["extent_m"]):
            yield f"has the extent {extent}, not {held['extent_m']}"


wrong = sorted(set(faults()))
parts = 0
for path in sorted((folder / "report").glob("*.json")):
    report = json.loads(path.read_text())
    for kind, names in report.get("contents", {}).items():
        for name, held in names.items():
            parts += 1
            wrong += [f"frame {report['frame']}: {kind}/{name} {what}" for what in differences(kind, name, held, report["frame"])]
assert not wrong, "\n".join(wrong[:40])
assert parts, "the reports list nothing"
print(f"frazil: {parts} parts of frames are as their reports say, without an error of the validators")
