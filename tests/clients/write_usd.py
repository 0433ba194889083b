"""Writes binary USD as OpenUSD does, for frazil to read: write_usd.py FOLDER."""

import sys
from pathlib import Path

from pxr import Gf, Usd, UsdGeom, Vt

FOLDER = Path(sys.argv[1])


def stage_in(name, metres, axis):
    stage = Usd.Stage.CreateNew(str(FOLDER / name))
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.SetStageUpAxis(stage, axis)
    UsdGeom.Xform.Define(stage, "/scene")
    return stage


def primvar(prim, name, kind, on, values, indices=None):
    added = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(name, kind, on)
    added.Set(values)
    if indices is not None:
        added.SetIndices(Vt.IntArray(indices))


def mesh():
    from pxr.Sdf import ValueTypeNames as Types

    stage = stage_in("mesh.usdc", 0.01, UsdGeom.Tokens.z)
    mesh = UsdGeom.Mesh.Define(stage, "/scene/quad")
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    points = [(0, 0, 0), (100, 0, 0), (100, 100, 0), (0, 100, 0), (0, 0, 200)]
    mesh.CreatePointsAttr().Set(Vt.Vec3fArray(points), 3)
    mesh.CreateFaceVertexCountsAttr([4, 3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 0, 1, 4])
    mesh.CreateVelocitiesAttr([(n, 0, 0) for n in range(5)])
    primvar(mesh, "heat", Types.FloatArray, "vertex", [5.0, 7.0], [0, 1, 0, 1, 1])
    primvar(mesh, "dry", Types.FloatArray, "faceVarying", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    primvar(mesh, "whole", Types.FloatArray, "vertex", [float(n) for n in range(5)])
    stage.Save()


def points():
    from pxr.Sdf import ValueTypeNames as Types

    stage = stage_in("points.usdc", 1.0, UsdGeom.Tokens.y)
    points = UsdGeom.Points.Define(stage, "/scene/drop")
    points.CreatePointsAttr([(n, 0.5, 0) for n in range(100)])
    points.CreateWidthsAttr([0.1])
    points.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    points.CreateIdsAttr([n * n - 50 for n in range(100)])
    primvar(points, "whole", Types.FloatArray, "vertex", [float(n) for n in range(100)])
    stage.Save()


def moved():
    stage = stage_in("moved.usdc", 1.0, UsdGeom.Tokens.y)
    mesh = UsdGeom.Mesh.Define(stage, "/scene/moved")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    mesh.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    stage.Save()


mesh()
points()
moved()
print("frazil: wrote a mesh, points and a mesh that is moved")
