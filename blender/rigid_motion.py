# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of rigid objects as keys: a position and a rotation about x, then y, then z at each frame, linear in between."""

import math

import mathutils
import numpy as np

# Distance (m) by which keys may miss a vertex at a frame.
TOLERANCE = 2e-5
# Share of the rotation from one frame to the next by which angles that change linearly may miss the shortest rotation half way. Near a pole of the
# second angle, the others change by up to half a turn while the object hardly rotates.
_MAX_DETOUR = 0.25


# Orientations that the mesh of a rigid object may have in its file: each has its poles elsewhere.
_CYCLE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_ORIENTATIONS = [np.eye(3), _CYCLE, _CYCLE @ _CYCLE]


def keys(positions, matrices, first):
    """A mesh and keys that move it as the transforms do.

    positions: local ones (n, 3); matrices: transforms (4, 4), Y up, m, of the frames from `first` on. Returns (positions (n, 3), keys as in a
    scene), or None if the motion is not rigid within TOLERANCE, or linear angles would take another path between two frames."""
    rotations = _rotations(matrices)
    if rotations is None:
        return None
    start = positions.astype(np.float64) @ matrices[0][:3, :3].T
    radius = float(np.linalg.norm(start, axis=1).max())
    for orientation in _ORIENTATIONS:
        turned = [rotation @ orientation for rotation in rotations]
        angles = _angles(turned)
        if _is_direct(turned, angles, radius):
            base, out = start @ orientation, _as_keys(matrices, angles, first)
            return (base, out) if _fit(base, out, positions, matrices) else None
    return None


def _fit(base, keys_, positions, matrices):
    """Whether the keys place the mesh as the transforms do. Keys are rounded, and files have 32 bits."""
    written = base.astype(np.float32).astype(np.float64)
    for matrix, key in zip(matrices, keys_):
        placed = written @ rotation_of(key["turn_deg"]).T + key["at"]
        wanted = positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        if np.abs(placed - wanted).max() > TOLERANCE:
            return False
    return True


def keys_of_frames(matrices, first):
    """Keys that move a shape, which stands upright at its origin, as the transforms do. None if they shear or mirror."""
    rotations = []
    for matrix in matrices:
        lengths = np.linalg.norm(matrix[:3, :3], axis=0)
        if lengths.min() <= 0.0:
            return None
        # Blender's axes of the shape: its z becomes y.
        rotation = matrix[:3, :3] / lengths @ _FROM_Y_UP
        if not _is_rotation(rotation):
            return None
        rotations.append(rotation)
    angles = _angles(rotations)
    out = _as_keys(matrices, angles, first)
    # An object at rest needs one key.
    is_still = all(key["at"] == out[0]["at"] and key["turn_deg"] == out[0]["turn_deg"] for key in out)
    return out[:1] if is_still else out


def rotation_of(turn_deg):
    """The rotation matrix (3, 3) of a key: about x, then y, then z."""
    x, y, z = (math.radians(angle) for angle in turn_deg)
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(angle), math.sin(angle)) for angle in (x, y, z))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


_FROM_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def _rotations(matrices):
    """The rotations (3, 3) from the first transform to each; None if there are other transforms than rotations."""
    first = matrices[0][:3, :3]
    if abs(np.linalg.det(first)) < 1e-12:
        return None
    inverse = np.linalg.inv(first)
    rotations = [matrix[:3, :3] @ inverse for matrix in matrices]
    return rotations if all(map(_is_rotation, rotations)) else None


def _is_rotation(matrix):
    return np.abs(matrix.T @ matrix - np.eye(3)).max() < 1e-5 and np.linalg.det(matrix) > 0.0


def _angles(rotations):
    """Angles (degrees) about x, y and z of rotations, each triple the nearest to the one before."""
    out, before = [], None
    for rotation in rotations:
        choices = _angles_of(rotation)
        if before is not None:
            choices = [[angle + 360.0 * round((old - angle) / 360.0) for angle, old in zip(choice, before)] for choice in choices]
        before = min(choices, key=lambda choice: sum((new - old) ** 2 for new, old in zip(choice, before or [0.0] * 3)))
        out.append(before)
    return out


def _angles_of(rotation):
    """The two triples of angles that give a rotation, in 64 bits."""
    sine = min(max(-rotation[2, 0], -1.0), 1.0)
    y = math.asin(sine)
    if abs(sine) > 1.0 - 1e-12:
        x, z = math.atan2(-rotation[1, 2], rotation[1, 1]), 0.0
    else:
        x, z = math.atan2(rotation[2, 1], rotation[2, 2]), math.atan2(rotation[1, 0], rotation[0, 0])
    return [[math.degrees(angle) for angle in angles] for angles in ((x, y, z), (x + math.pi, math.pi - y, z + math.pi))]


def _is_direct(rotations, angles, radius):
    """Whether linear angles keep to the shortest rotation between frames, half way between each two."""
    turned = [mathutils.Matrix(rotation.tolist()).to_quaternion() for rotation in rotations]
    for index in range(1, len(turned)):
        angle = turned[index - 1].rotation_difference(turned[index]).angle
        angle = min(angle, 2.0 * math.pi - angle)
        middle = rotation_of([(old + new) / 2.0 for old, new in zip(angles[index - 1], angles[index])])
        shortest = np.array(turned[index - 1].slerp(turned[index], 0.5).to_matrix(), dtype=np.float64)
        if np.abs(middle - shortest).max() * radius > max(_MAX_DETOUR * angle * radius, TOLERANCE):
            return False
    return True


def _as_keys(matrices, angles, first):
    """Keys as in a scene; digits below a tenth of a micrometre are dropped."""
    return [{"frame": float(frame), "at": [round(float(part), 7) for part in matrix[:3, 3]], "turn_deg": [round(angle, 7) for angle in turn]}
            for frame, (matrix, turn) in enumerate(zip(matrices, angles), first)]
