"""frazil beside another OpenVDB in one process: two_openvdbs.py MODULES, in the order of their import, for instance bpy,frazil,openvdb. Works on
grids of both, each also read by the other, and fails if one is wrong."""

import importlib
import os
import sys
import tempfile

# Blender passes its own arguments too.
modules = {name: importlib.import_module(name) for name in sys.argv[-1].split(",")}

import numpy as np

import frazil

other = next((module for name, module in modules.items() if "openvdb" in name), None)
folder = tempfile.TemporaryDirectory()
ours, theirs = (os.path.join(folder.name, name) for name in ("ours.vdb", "theirs.vdb"))


def our_box():
    """A box of 0.2 m as a level set: active voxels before and after it was written, and its volume."""
    corners = np.array([[(-0.1, 0.1)[at >> axis & 1] for axis in range(3)] for at in range(8)], np.float32)
    faces = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
    with frazil.Context(threads=2) as ctx:
        grid = frazil.level_set.from_mesh(ctx, frazil.Mesh(ctx, corners, faces), voxel_size=0.005)
        grid.name = "surface"
        frazil.save_grids(ctx, [grid], ours)
        read = frazil.load_grid(ctx, ours)
        assert read.info.active_voxels == grid.info.active_voxels
        volume = read.to_mesh(ctx).info.volume
        assert abs(volume - 0.008) < 1e-4, volume
        return grid.info.active_voxels


def their_ball(openvdb):
    """A ball of 10 as a level set: active voxels."""
    grid = openvdb.createLevelSetSphere(radius=10.0, voxelSize=0.5)
    openvdb.write(theirs, grids=[grid])
    (read,), _ = openvdb.readAll(theirs)
    assert read.activeVoxelCount() == grid.activeVoxelCount()
    points, quads = read.convertToQuads()
    radii = np.linalg.norm(points, axis=1)
    assert len(quads) > 1000 and abs(radii - 10).max() < 0.1, radii
    return grid.activeVoxelCount()


def as_blender_sees(bpy, path):
    """Vertices of the mesh that Blender makes of a level set."""
    bpy.ops.object.volume_import(filepath=path, files=[{"name": os.path.basename(path)}], directory=os.path.dirname(path))
    volume = bpy.context.object
    volume.data.grids.load()
    shown = bpy.data.objects.new("shown", bpy.data.meshes.new("shown"))
    bpy.context.collection.objects.link(shown)
    modifier = shown.modifiers.new("mesh", "VOLUME_TO_MESH")
    modifier.object, modifier.threshold, modifier.grid_name = volume, 0.0, volume.data.grids[0].name
    return len(shown.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh().vertices)


voxels = our_box()
if other is not None:
    ball = their_ball(other)
    (read,), _ = other.readAll(ours)
    assert read.activeVoxelCount() == voxels
    with frazil.Context(threads=2) as ctx:
        assert frazil.load_grid(ctx, theirs).info.active_voxels == ball
    assert their_ball(other) == ball
if "bpy" in modules:
    vertices = as_blender_sees(modules["bpy"], ours)
    assert vertices > 1000, vertices
assert our_box() == voxels
print(f"{sys.argv[-1]}: right", flush=True)
