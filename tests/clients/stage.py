"""usd-core composes a shot: volumes with their files, meshes with velocities and UVs, at three frames.

python stage.py FOLDER FIRST LAST
"""

import pathlib
import sys

from pxr import Usd, UsdGeom, UsdShade, UsdVol

folder, first, last = pathlib.Path(sys.argv[1]).resolve(), int(sys.argv[2]), int(sys.argv[3])
stage = Usd.Stage.Open(str(folder / "shot.usda"))
assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
assert stage.GetTimeCodesPerSecond() == 24.0
assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (first, last)
assert stage.GetDefaultPrim().GetPath() == "/shot"

volume = UsdVol.Volume(stage.GetPrimAtPath("/shot/base"))
assert volume and set(volume.GetFieldPaths()) == {"surface", "compression", "touched"}
snow = UsdGeom.Mesh(stage.GetPrimAtPath("/shot/mesh/base"))
meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh) and not (snow and prim == snow.GetPrim())]
assert meshes, "no mesh"
checked = textured = 0
for frame in (first, (first + last) // 2, last):
    for name, path in volume.GetFieldPaths().items():
        asset = UsdVol.OpenVDBAsset(stage.GetPrimAtPath(path))
        assert asset.GetFieldNameAttr().Get() == name
        file = asset.GetFilePathAttr().Get(frame)
        assert pathlib.Path(file.resolvedPath) == folder / "base" / f"base.{frame:04d}.vdb", file
    for mesh in meshes:
        points, velocities = mesh.GetPointsAttr().Get(frame), mesh.GetVelocitiesAttr().Get(frame)
        counts, indices = mesh.GetFaceVertexCountsAttr().Get(frame), mesh.GetFaceVertexIndicesAttr().Get(frame)
        assert len(points) == len(velocities) > 0 and sum(counts) == len(indices) and max(indices) < len(points)
        low, high = mesh.GetExtentAttr().Get(frame)
        for axis in range(3):
            values = [point[axis] for point in points]
            assert (min(values), max(values)) == (low[axis], high[axis])
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        if st:
            places = st.ComputeFlattened(frame)
            seams = st.GetInterpolation() == UsdGeom.Tokens.faceVarying
            assert seams or st.GetInterpolation() == UsdGeom.Tokens.vertex
            assert len(places) == len(indices if seams else points)
            # Those of tests/clients.rs.
            corners = [(0.0, 0.0), (0.75, 0.0), (0.5, 1.0), (0.25, -2.0)]
            assert not seams or all(tuple(place) == corners[i % 4] for i, place in enumerate(places)), places
            textured += 1
        if frame < last:
            # Velocities carry the points to the next frame.
            after = mesh.GetPointsAttr().Get(frame + 1)
            worst = max((points[i] + velocities[i] / 24.0 - after[i]).GetLength() for i in range(len(points)))
            assert worst < 1e-4, worst
        checked += 1
grains = UsdGeom.Points(stage.GetPrimAtPath("/shot/grains"))
counts = []
if grains:
    assert grains.GetPurposeAttr().Get() == UsdGeom.Tokens.render
    assert grains.GetWidthsInterpolation() == UsdGeom.Tokens.vertex
    primvars = UsdGeom.PrimvarsAPI(grains)
    for frame in range(first, last + 1):
        ids, places, velocities = (
            attribute.Get(frame) for attribute in (grains.GetIdsAttr(), grains.GetPointsAttr(), grains.GetVelocitiesAttr())
        )
        assert len(ids) == len(places) == len(velocities) and list(ids) == sorted(set(ids))
        widths = grains.GetWidthsAttr().Get(frame)
        file = Usd.Stage.Open(str(folder / "grains" / f"grains.{frame:04d}.usdc"))
        alone = UsdGeom.Points(file.GetDefaultPrim())
        assert places == alone.GetPointsAttr().Get(frame) and ids == alone.GetIdsAttr().Get(frame)
        assert len(widths) == len(ids) and all(width == widths[0] > 0 for width in widths)
        for name in ("active", "trapped", "source_frame", "rest"):
            primvar = primvars.GetPrimvar(name)
            assert primvar.GetInterpolation() == UsdGeom.Tokens.vertex and len(primvar.Get(frame)) == len(ids), name
        low, high = grains.GetExtentAttr().Get(frame)
        assert all(low[axis] <= place[axis] <= high[axis] for place in places for axis in range(3))
        counts.append(len(ids))
    assert counts[-1] > 0 == counts[0], counts
shown = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdVol.Volume)]
for prim in shown:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    assert material, f"{prim.GetPath()} has no material"
    if material.GetPrim().GetName() != "fog":
        shader, *_ = material.ComputeSurfaceSource()
        assert shader and shader.GetShaderId() == "UsdPreviewSurface", material.GetPath()
volumes = [UsdVol.Volume(prim) for prim in shown if prim.IsA(UsdVol.Volume)]
for other in volumes:
    for name, path in other.GetFieldPaths().items():
        asset = UsdVol.OpenVDBAsset(stage.GetPrimAtPath(path))
        assert asset and pathlib.Path(asset.GetFilePathAttr().Get(last).resolvedPath).is_file(), path
    if other.GetPrim().GetName().startswith("fog_"):
        assert list(other.GetFieldPaths()) == ["density"] and asset.GetFieldClassAttr().Get() == "fogVolume"
        assert other.GetPrim().GetAttribute("frazil:density_scale").Get() > 0
if snow:
    for frame in (first, last):
        points, indices = snow.GetPointsAttr().Get(frame), snow.GetFaceVertexIndicesAttr().Get(frame)
        assert len(points) > 100 and max(indices) == len(points) - 1 and not snow.GetVelocitiesAttr().Get(frame)
print(f"frazil: {len(volumes)} volumes, {len(shown)} prims with materials, "
      f"{'a' if snow else 'no'} mesh of snow;"
      f" {checked} meshes at 3 frames, {textured} with UVs, {len(volume.GetFieldPaths())} grids, {max(counts, default=0)} grains")
