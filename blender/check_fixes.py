# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a scene that a check proposes, found in its report; without Blender.

Most are in fields of the report: keys of a walk, heights, grains, the spacing, the camera. The others the program proposes only in the
sentence of a warning or of an error."""

import dataclasses
import math
import pathlib
import re

_NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
_POINT = rf"\(({_NUMBER}), ({_NUMBER}), ({_NUMBER})\)"
# An area is enlarged at most by this factor along an axis: beyond, the object is more likely to be elsewhere by mistake.
_MAX_GROWTH = 4.0
# Share by which a limit of grains exceeds their forecast.
_SPARE = 1.2


@dataclasses.dataclass(frozen=True)
class Fix:
    """A change of settings that a button applies.

    label: text of the button; settings: values by path, as `settings` of `frazil check --json`: {"object[1].scale": 0.01}.
    A fix of an object of snow also has its number, and what happens to it: it is raised (m) or scaled. An object that is exported from Blender
    moves and has its size there, where settings would come on top."""

    label: str
    settings: dict
    number: int = 0
    raised: float = 0.0
    scaled: float = 1.0


def flat_settings(scene):
    """The settings of a scene's TOML, a dict of tables, by path: {"snow.cell": 0.01, "object[1].file": "a.obj"}."""
    out = {}

    def add(path, value, depth):
        if isinstance(value, dict) and depth < 2:
            for name, item in value.items():
                add(f"{path}.{name}" if path else name, item, depth + (path != ""))
        elif isinstance(value, list) and value and depth == 0 and all(isinstance(item, dict) for item in value):
            for index, item in enumerate(value, 1):
                add(f"{path}[{index}]", item, 1)
        else:
            out[path] = value

    for name, value in scene.items():
        add(name, value, 0)
    return out


def fixes_of_report(report):
    """The fixes of a report of `frazil check --json` (dict), each once."""
    settings = report["settings"]
    out = [*_of_objects(report, settings), *_of_grains(report, settings), *_of_spacing(report, settings)]
    for warning in report["warnings"]:
        out += fixes_of_sentence(warning, settings)
    # A scale first: the heights and keys of the others are those of the present size.
    return _distinct(sorted(out, key=lambda fix: fix.scaled == 1.0))


def fixes_of_error(error, settings, folder):
    """The fixes of an error of a check (str). settings: those of the scene by path, without defaults; folder: that of the scene."""
    return _distinct([*fixes_of_sentence(error, settings), *_of_clips(error, settings, folder), *_of_missing_frames(error, settings)])


def _distinct(fixes):
    out = []
    for fix in fixes:
        if fix not in out:
            out.append(fix)
    return out


def _moving(settings):
    """The numbers of the objects that a report lists, in its order: those that move."""
    indices = sorted(int(match[1]) for path in settings if (match := re.fullmatch(r"object\[(\d+)\]\.file", path)))
    return [index for index in indices if settings.get(f"object[{index}].role") not in ("static", "ignore")]


def _of_objects(report, settings):
    """Fixes of the motion of objects of a scene of snow."""
    if "objects" not in report:
        return
    for index, found in zip(_moving(settings), report["objects"]):
        name, keys = f"object {index}", settings.get(f"object[{index}].keys") or []
        path = f"object[{index}].keys"
        walk, deepest = found["walk"], found["deepest"]
        if walk and walk["slips"]:
            yield Fix(f"{name}: move as its clip walks", {path: parsed_keys(walk["keys"])})
        if deepest and deepest["above_ground_m"] < -0.5 * report["cell_m"]:
            by = -deepest["above_ground_m"]
            yield Fix(f"{name}: raise by {by:.3f} m", {path: _raised(keys, by, report["frames"][0])}, index, raised=by)
        if found["touches"] is None and deepest and deepest["below_top_m"] < 0.0:
            by = deepest["above_ground_m"]
            yield Fix(f"{name}: lower by {by:.3f} m", {path: _raised(keys, -by, report["frames"][0])}, index, raised=-by)
        if found["touches"] is None and report["area_m"] and "snow.area" in settings:
            yield from _of_area(name, report["area_m"], found["bounds_m"])


def _raised(keys, by, first):
    """Keys whose positions are higher by `by` (m); a key at the frame `first` if there are none."""
    keys = keys or [{"frame": first, "at": [0.0, 0.0, 0.0], "turn_deg": [0.0, 0.0, 0.0]}]
    higher = [{**key, "at": [key["at"][0], round(key["at"][1] + by, 4), key["at"][2]]} for key in keys]
    return [{**key, "frame": int(key["frame"])} for key in higher]


def _of_area(name, area, bounds):
    """The area that takes in an object beside it, if that is near."""
    (x0, _, z0), (x1, _, z1) = bounds
    if x0 <= area[2] and x1 >= area[0] and z0 <= area[3] and z1 >= area[1]:
        return
    wide = [min(area[0], x0), min(area[1], z0), max(area[2], x1), max(area[3], z1)]
    wide = [math.floor(wide[0] * 10) / 10, math.floor(wide[1] * 10) / 10, math.ceil(wide[2] * 10) / 10, math.ceil(wide[3] * 10) / 10]
    if all(wide[axis + 2] - wide[axis] <= _MAX_GROWTH * (area[axis + 2] - area[axis]) for axis in (0, 1)):
        text = f"{wide[2] - wide[0]:.1f} x {wide[3] - wide[1]:.1f} m"
        yield Fix(f"{name}: area of {text}", {"snow.area": wide})


def _of_grains(report, settings):
    grains, limit = report.get("grains"), settings.get("grains.max")
    if grains and limit and grains["grains"] > limit:
        enough = math.ceil(_SPARE * grains["grains"] / 1000.0) * 1000
        yield Fix(f"allow {enough} grains", {"grains.max": enough})


def _of_spacing(report, settings):
    """The spacing of particles, if the scene leaves it to an estimate, which another first frame would change."""
    if "spacing_m" in report and settings.get("surface.spacing") is None:
        spacing = round(report["spacing_m"], 6)
        yield Fix(f"keep the spacing of {spacing} m", {"surface.spacing": spacing})


def parsed_keys(text):
    """Keys as a check writes them, `keys = [{ frame = 1, at = [0, 0, 0] }]`, as a list of {"frame", "at", "turn_deg"}."""
    out = []
    for part in re.findall(r"\{([^}]*)\}", text):
        vectors = {name: [float(x) for x in values.split(",")] for name, values in re.findall(r"(at|turn_deg) = \[([^\]]*)\]", part)}
        frame = re.search(r"frame = (-?\d+)", part)
        out.append({"frame": int(frame[1]), "at": vectors["at"], "turn_deg": vectors.get("turn_deg", [0.0, 0.0, 0.0])})
    return out


def fixes_of_sentence(text, settings):
    """The fixes that are only in the words of a warning or an error."""
    for pattern, fixes in _SENTENCES:
        if match := re.search(pattern, text):
            yield from fixes(match, settings)


def _scale_of_object(match, settings):
    number, scale = int(match[1]), float(match[2])
    path = f"object[{number}].scale"
    yield Fix(f"object {number}: scale = {scale:g}", {path: scale}, number, scaled=scale / settings.get(path, 1.0))


def _scale_of_terrain(_, settings):
    if settings.get("shallow.scale", 1.0) == 1.0:
        for scale, unit in ((0.001, "millimetres"), (0.01, "centimetres")):
            yield Fix(f"the terrain is in {unit}: scale = {scale}", {"shallow.scale": scale})


def _point_of(match, _):
    table, index, *point = match.groups()
    at = [float(x) for x in point]
    yield Fix(f"{table} {index}: move to ({', '.join(f'{x:.4g}' for x in at)})", {f"{table}[{index}].at": at})


def _cell_of_layer(match, _):
    yield Fix(f"cells of {match[1]} m", {"snow.cell": float(match[1])})


def _amplitude(match, _):
    table, amplitude = match.groups()
    yield Fix(f"{table}: amplitude = {amplitude}", {f"{table}.amplitude": float(amplitude)})


def _spacing_of_particles(match, _):
    yield Fix(f"a spacing of {match[1]} m", {"surface.spacing": float(match[1])})


def _border(_, __):
    for border in ("closed", "absorbing"):
        yield Fix(f"a border that is {border}", {"shallow.border": border})


def _last_frame(last, settings):
    first = re.match(r"(-?\d+)-", str(settings.get("shot.frames", "")))
    if first and last >= int(first[1]):
        yield Fix(f"end the shot at frame {last}", {"shot.frames": f"{first[1]}-{last}"})


def _frames_of_particles(match, settings):
    yield from _last_frame(int(match[1]) - 1, settings)


def _upright(_, settings):
    if settings.get("shallow.area") is None and settings.get("shallow.up", "y") == "y":
        yield Fix("the terrain has Z up", {"shallow.up": "z"})


def _choice(match, _):
    key, table, choice = match.groups()
    yield Fix(f"{table}.{key} = {choice}", {f"{table}.{key}": choice})


def _carries(match, settings):
    scalar = match[1]
    for table in ("source", "pour"):
        for index in range(1, 1 + sum(re.fullmatch(rf"{table}\[\d+\]\.at", path) is not None for path in settings)):
            path = f"{table}[{index}].carries"
            yield Fix(f"{table} {index} carries {scalar}", {path: {**(settings.get(path) or {}), scalar: 1.0}})


_SENTENCES = (
    (rf"object (\d+) \(.*\) .*: scale = ({_NUMBER})", _scale_of_object),
    (r"shallow\.scale = 0\.001 takes millimetres", _scale_of_terrain),
    (r"shallow\.cell = .* makes .* over \d+ along an axis", _scale_of_terrain),
    (rf"(source|drain|absorber|pour)\.(\d+): .*; the nearest ground is at {_POINT}", _point_of),
    (rf"(source|drain|absorber|pour)\.(\d+): .* m beside it, at {_POINT}", _point_of),
    (rf"cells of ({_NUMBER}) m or less hold it well", _cell_of_layer),
    (rf"`amplitude` in \[([\w.]+)\] .*the amplitude may be at most ({_NUMBER}) m", _amplitude),
    (rf"surface\.spacing is .* but particles lie ({_NUMBER}) m apart", _spacing_of_particles),
    (r"the liquid of shallow\.fill flows off at the border", _border),
    (r": frame (-?\d+) and those after it cannot be made", _frames_of_particles),
    (r"has no surface that faces up within", _upright),
    (r'`(\w+)` in \[(\w+)\] must be .*; did you mean "(\w+)"\?', _choice),
    (r"no liquid has any (\w+): carries", _carries),
)


def _of_clips(error, settings, folder):
    """A clip for the objects whose file has clips of which the scene names none, or a wrong one."""
    match = re.match(r'(.*): has (?:no clip ".*"; its clips are|\d+ clips and none is chosen; they are) (.*)', error, re.DOTALL)
    if not match:
        return
    for path, file in settings.items():
        number = re.fullmatch(r"object\[(\d+)\]\.file", path)
        if number and (folder / file).resolve() == pathlib.Path(match[1]).resolve():
            for clip in re.findall(r'"([^"]*)"', match[2]):
                yield Fix(f"object {number[1]}: clip {clip}", {f"object[{number[1]}].clip": clip})


def _of_missing_frames(error, settings):
    """The end of the shot before the first file that a sequence lacks."""
    if match := re.search(r"\.(\d+)\.\w+: the frame is missing from the sequence", error):
        shifted = any(value for path, value in settings.items() if re.fullmatch(r"object\[\d+\]\.offset", path))
        if not shifted:
            yield from _last_frame(int(match[1]) - 1, settings)
