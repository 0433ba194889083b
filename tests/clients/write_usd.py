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

    stage = stage_in("points.usdc", 0.01, UsdGeom.Tokens.y)
    points = UsdGeom.Points.Define(stage, "/scene/drop")
    points.CreatePointsAttr([(100 * n, 50, 0) for n in range(100)])
    points.CreateWidthsAttr([10.0])
    points.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    points.CreateIdsAttr([n * n - 50 for n in range(100)])
    primvar(points, "whole", Types.FloatArray, "vertex", [float(n) for n in range(100)])
    stage.Save()


def tetrahedron(stage, path, points=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in points])
    mesh.CreateFaceVertexCountsAttr([3, 3, 3, 3])
    mesh.CreateFaceVertexIndicesAttr([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
    return mesh


def moved():
    """Meshes under transforms of all kinds, and the same ones as OpenUSD moves them."""
    stage = stage_in("moved.usdc", 0.01, UsdGeom.Tokens.z)
    scene = UsdGeom.Xform.Get(stage, "/scene")
    scene.AddTranslateOp().Set(Gf.Vec3d(100, 200.5, -3))
    scene.AddRotateYXZOp().Set(Gf.Vec3f(30, -40, 75))
    scene.AddScaleOp().Set(Gf.Vec3f(20, 30, 25))
    turned = tetrahedron(stage, "/scene/turned")
    pivot = turned.AddTranslateOp(opSuffix="pivot")
    pivot.Set(Gf.Vec3d(0.3, 0.4, 0.5))
    turned.AddRotateXOp().Set(33.5)
    turned.AddOrientOp().Set(Gf.Quatf(0.5, 0.5, -0.5, 0.5))
    turned.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
    matrix = tetrahedron(stage, "/scene/turned/matrix")
    rows = [0.5, 1, 0, 0, -1, 0.25, 0, 0, 0, 0.125, 2, 0, 3, 4, 5, 1]
    matrix.AddTransformOp().Set(Gf.Matrix4d(*rows))
    tetrahedron(stage, "/scene/mirrored").AddScaleOp().Set(Gf.Vec3f(1, -2, 1))
    alone = tetrahedron(stage, "/scene/turned/alone")
    alone.SetResetXformStack(True)
    alone.AddTransformOp().Set(Gf.Matrix4d(Gf.Vec4d(2, 3, 4, 1)))
    alone.AddRotateZYXOp(precision=UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(10, 20, 30.25))
    animated = tetrahedron(stage, "/scene/animated").AddTranslateOp()
    animated.Set(Gf.Vec3d(9, 8, 7.5), 5)
    animated.Set(Gf.Vec3d(1, 2, 3.5), 1)
    stage.Save()
    baked = stage_in("baked.usdc", 0.01, UsdGeom.Tokens.z)
    cache = UsdGeom.XformCache(1)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            to_world = cache.GetLocalToWorldTransform(prim)
            points = UsdGeom.Mesh(prim).GetPointsAttr().Get()
            points = [to_world.Transform(Gf.Vec3d(point)) for point in points]
            mesh = tetrahedron(baked, f"/scene/{prim.GetName()}", points)
            if to_world.GetDeterminant() < 0:
                mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    baked.Save()
    half = stage_in("half.usdc", 1.0, UsdGeom.Tokens.y)
    mesh = tetrahedron(half, "/scene/half")
    mesh.AddScaleOp(precision=UsdGeom.XformOp.PrecisionHalf).Set(Gf.Vec3h(1.5, 1, 1))
    half.Save()


mesh()
points()
moved()
print("frazil: wrote a mesh, points and meshes that are moved")
