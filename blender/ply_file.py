# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as binary .ply files, in metres with Y up."""

import numpy as np


def mesh_bytes(positions, faces, uvs=None):
    """The bytes of a .ply file. Faces may have any number of corners.

    positions: (n, 3) floats, written in 32 bits
    faces: (sizes, corners): the number of corners of each face (m,), and the vertices of all corners (c,)
    uvs: (c, 2) floats of the corners, v upward, or None"""
    sizes, corners = faces
    # Counts of one byte are what most programs write; a count of coordinates is twice that of corners.
    count = "uchar" if len(sizes) == 0 or sizes.max() < 128 else "uint"
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}", "property float x", "property float y",
              "property float z", f"element face {len(sizes)}", f"property list {count} uint vertex_indices"]
    if uvs is not None:
        header.append(f"property list {count} float texcoord")
    data = ("\n".join(header) + "\nend_header\n").encode()
    return data + np.ascontiguousarray(positions, "<f4").tobytes() + _face_bytes(sizes, corners, uvs, np.dtype("<u1" if count == "uchar" else "<u4"))


def _face_bytes(sizes, corners, uvs, count_type):
    """The rows of the faces; equal rows of neighbours are packed at once."""
    out = []
    starts = np.concatenate([[0], np.cumsum(sizes)])
    # Runs of faces with as many corners: rows of one length.
    changes = np.flatnonzero(np.diff(sizes)) + 1
    for first, end in zip(np.concatenate([[0], changes]), np.concatenate([changes, [len(sizes)]])):
        first, end = int(first), int(end)
        if first == end:
            continue
        size = int(sizes[first])
        fields = [("count", count_type), ("corners", "<u4", (size,))]
        if uvs is not None:
            fields += [("uv_count", count_type), ("uvs", "<f4", (2 * size,))]
        rows = np.zeros(end - first, np.dtype(fields))
        part = slice(starts[first], starts[end])
        rows["count"] = size
        rows["corners"] = corners[part].reshape(-1, size)
        if uvs is not None:
            rows["uv_count"] = 2 * size
            rows["uvs"] = uvs[part].reshape(-1, 2 * size)
        out.append(rows.tobytes())
    return b"".join(out)
