# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines in which the report of a check is shown; without Blender."""

import dataclasses
import pathlib


@dataclasses.dataclass(frozen=True)
class Row:
    """A line of the report.

    kind: "frames", "cells", "object", "liquid", "grains", "mist", "memory", "disk", "warning" or "error"; name: what it is about; text: the
    rest."""

    kind: str
    name: str
    text: str


def in_size(size):
    """A size in bytes as 1.2 GB."""
    for unit, name in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size >= unit:
            return f"{size / unit:.1f} {name}"
    return f"{size} B"


def rows(report, free):
    """The lines of a report of `frazil check --json` (dict). free: free space on the disk of the output (bytes), None if it is unknown."""
    first, last = report["frames"]
    count = last - first + 1
    out = [Row("warning", "", text) for text in report["warnings"]]
    out.append(Row("frames", f"frames {first} to {last}", f"{count / report['fps']:.2f} s at {report['fps']:g} frames per second"))
    out += [*_of_snow(report), *_of_surface(report), *_of_shallow(report)]
    memory = f"{in_size(report['memory_forecast_bytes'])} expected, at most {in_size(report['memory_bytes'])}"
    mist = report.get("mist")
    out.append(Row("memory", "memory", memory + (" without mist" if mist else "")))
    disk = (report["disk_bytes"] or 0) + (mist["disk_bytes"] if mist else 0)
    if report["disk_bytes"] is not None:
        out.append(Row("disk", "disk", f"about {in_size(disk)}" + (f" of {in_size(free)} free" if free is not None else "")))
    return out


def _of_snow(report):
    if "objects" not in report:
        return
    cell, area = report["cell_m"], report["area_m"]
    if area:
        width, depth = area[2] - area[0], area[3] - area[1]
        yield Row("cells", "area", f"{width:.2f} x {depth:.2f} m, {width / cell:.0f} x {depth / cell:.0f} columns")
    yield Row("cells", "cells", f"{cell:g} m")
    for found in report["objects"]:
        yield from _of_object(found)
    grains = report["grains"]
    if grains:
        yield Row("grains", "grains", f"{'at most' if grains['at_most'] else 'about'} {grains['grains']} at once")
    elif "grains.radius" in report["settings"]:
        yield Row("grains", "grains", "their number is known when the base is made")
    mist = report["mist"]
    if mist:
        how = f"as made up to frame {mist['made_to_frame']}" if mist["made_to_frame"] is not None else "estimated"
        yield Row("mist", "mist", f"{mist['cells']} cells of {mist['cell_m']:g} m, {in_size(mist['memory_bytes'])}, {how}")


def _of_object(found):
    name = pathlib.Path(found["file"]).name
    yield Row("object", name, f"{_lengths(found['size_m'])}, {found['triangles']} triangles, {found['role']}")
    deepest, touches, walk = found["deepest"], found["touches"], found["walk"]
    reach = f"in reach of the snow in frames {touches[0]} to {touches[1]}" if touches else "never in reach of the snow"
    speed = f"at most {found['fastest_m_per_s']:.2f} m/s, at frame {found['fastest_frame']}"
    yield Row("object", name, f"{reach}; {speed}")
    if deepest:
        below, above = deepest["below_top_m"], deepest["above_ground_m"]
        snow = f"{abs(below):.3f} m {'deep in' if below >= 0.0 else 'above'} the snow"
        yield Row("object", name, f"lowest at frame {deepest['frame']}: {snow}, {abs(above):.3f} m {'above' if above >= 0.0 else 'below'} the ground")
    if walk:
        speed = walk["stride_m"] / walk["round_s"]
        yield Row("object", name, f"walks at {speed:.2f} m/s; its feet slip at {walk['slips_m_per_s']:.2f} m/s")


def _of_surface(report):
    if "particles" not in report:
        return
    low, high = report["particles"]
    count = str(low) if low == high else f"{low} to {high}"
    words = ("ids" if report["has_ids"] else "no ids", "velocities" if report["has_velocities"] else "no velocities")
    yield Row("liquid", "particles", f"{report['files']} files of {count}, {report['spacing_m']:.6g} m apart; {words[0]}, {words[1]}")
    yield Row("object", "mesh", f"{_lengths(report['size_m'])}, {report['triangles']} triangles, edges of {report['edge_m']:.5f} m")


def _of_shallow(report):
    if "terrain" not in report:
        return
    (across, along), area = report["cells"], report["area_m"]
    yield Row("object", report["terrain"], _lengths(report["size_m"]))
    yield Row("cells", "area", f"{area[2] - area[0]:.4f} x {area[3] - area[1]:.4f} m")
    yield Row("cells", "cells", f"{across} x {along} of {report['cell_m']:g} m; {report['columns']} columns in up to {report['layers']} layers")
    liquid = f"{report['begins_with_ml']:.4g} ml at the first frame, {report['comes_ml']:.4g} ml come later"
    yield Row("liquid", "liquid", liquid)
    if report["void_cells"]:
        yield Row("cells", "no ground", f"{report['void_cells']} cells")


def _lengths(size):
    """Width, height and depth of frazil's axes in Blender's order: width, depth, height."""
    return f"{size[0]:.3g} x {size[2]:.3g} x {size[1]:.3g} m"
