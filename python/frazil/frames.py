"""What a shot made: the arrays and grids of a frame, from whichever files it has."""

from __future__ import annotations

import json
import os
import pathlib
import re
from typing import Any, Dict, List, NamedTuple

from .context import Context
from .geometry import Part, load_geometry
from .grid import Grid, list_grids, load_grid

# By preference: USD has the names of objects and their colours.
_ENDINGS = (".usdc", ".ply", ".obj", ".vdb")
# Folders of a shot that hold volumes.
_VOLUMES = ("base", "removed", "mist", "fog", "snow", "volume")
_FRAME = re.compile(r"\.(-?\d+)\.[a-z]+$")


class Volume(NamedTuple):
    """The .vdb file of a frame.

    path: pathlib.Path
    grids: names of its grids
    density_scale: a dict from names of grids to the extinction (1/m) of a density of 1, for those that state it
    is_whole: False if the file has only what changed since the frame before (`base_mode = "delta"`); `frazil vdb rebuild` makes it whole"""

    path: pathlib.Path
    grids: List[str]
    density_scale: Dict[str, float]
    is_whole: bool

    def load(self, ctx: Context, name: str) -> Grid:
        """Reads one of the grids, of floats or vectors. Raises frazil.Error for a file that is missing or damaged or has no such grid, ValueError for
        one that is not whole."""
        if not self.is_whole:
            raise ValueError(f"{self.path}: it has only what changed since the frame before: `frazil vdb rebuild` makes whole files")
        return load_grid(ctx, self.path, name)


class Frame(NamedTuple):
    """A frame of a shot; everything in metres and seconds, Y up.

    folder: pathlib.Path of the shot
    number: of the frame
    fps: frames per second
    seconds: since the shot's first frame
    system: "snow", "surface" or "shallow"
    meshes: a dict from "KIND/NAME" to Part: "mesh/base", "objects/NAME", "surface/surface", "liquid/liquid", "terrain/terrain", "obstacles/NAME"
    points: a dict from "KIND/NAME" to Part: "grains/grains"
    volumes: a dict from "base", "removed", "mist", "fog", "snow" and "volume" to Volume

    Kinds of which the frame has no file are left out."""

    folder: pathlib.Path
    number: int
    fps: float
    seconds: float
    system: str
    meshes: Dict[str, Part]
    points: Dict[str, Part]
    volumes: Dict[str, Volume]


class Shot:
    """The folder of a shot: `frazil.run(scene, folder)` made it.

    folder: pathlib.Path; system: "snow", "surface" or "shallow"; fps: frames per second; first, last: frames of the scene.
    Raises FileNotFoundError for a folder without scene.toml, ValueError if that is not of a shot."""

    folder: pathlib.Path
    system: str
    fps: float
    first: int
    last: int

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = pathlib.Path(folder)
        # The program writes it with all defaults, one key a line.
        text = (self.folder / "scene.toml").read_text(encoding="utf-8")
        self._settings = _settings(text)
        systems = [name for name in ("snow", "surface", "shallow") if f"\n[{name}]" in "\n" + text]
        frames = re.fullmatch(r'"(-?\d+)-(-?\d+)"', self._settings.get("shot.frames", ""))
        if len(systems) != 1 or frames is None or "shot.fps" not in self._settings:
            raise ValueError(f"{self.folder / 'scene.toml'}: it is not the scene that a run writes")
        self.system = systems[0]
        self.fps = float(self._settings["shot.fps"])
        self.first, self.last = map(int, frames.groups())

    def __repr__(self) -> str:
        return f"<frazil.Shot {self.system} {self.first}-{self.last} in {self.folder}>"

    def frames(self) -> list[int]:
        """The frames that were made, ascending: those of which at least one stage is done."""
        found = (_FRAME.search(path.name) for path in (self.folder / "state").glob("*.json"))
        return sorted({int(number[1]) for number in found if number})

    def load(self, number: int) -> Frame:
        """A frame: see frazil.load."""
        # A record for each stage that is done.
        paths = (self.folder / "state").glob(f"*.{number:04d}.json")
        records = [_record(path) for path in sorted(paths)]
        if not records:
            raise FileNotFoundError(f"{self.folder}: frame {number} is not made")
        by_kind: dict[str, dict[str, pathlib.Path]] = {}
        for record in records:
            for file in record["files"]:
                path = pathlib.PurePosixPath(file["path"])
                by_kind.setdefault(path.parts[0], {})[path.suffix] = self.folder / path
        still = self.folder / "surroundings.usdc"
        if still.is_file():
            by_kind["surroundings"] = {".usdc": still}
        out = Frame(self.folder, number, self.fps, (number - self.first) / self.fps, self.system, {}, {}, {})
        with Context() as ctx:
            for kind, files in by_kind.items():
                if kind in _VOLUMES:
                    # With base_mode = "delta" the record says that its stage's files hold changes; of those only the base does.
                    is_whole = kind != "base" or not any(record["keeps"] == "changes" for record in records)
                    self._add_volume(ctx, out, kind, files[".vdb"], is_whole)
                else:
                    self._add_parts(ctx, out, kind, files)
        return out

    def _add_volume(self, ctx: Context, frame: Frame, kind: str, path: pathlib.Path, is_whole: bool) -> None:
        grids = list_grids(ctx, path)
        scales = {grid.name: grid.density_scale for grid in grids if grid.density_scale is not None}
        frame.volumes[kind] = Volume(path, [grid.name for grid in grids], scales, is_whole)

    def _add_parts(self, ctx: Context, frame: Frame, kind: str, files: dict[str, pathlib.Path]) -> None:
        endings = [ending for ending in _ENDINGS if ending in files]
        if not endings:
            return
        for part in load_geometry(ctx, files[endings[0]]):
            of = frame.points if kind == "grains" else frame.meshes
            of[_key(kind, part.name)] = part


def _record(path: pathlib.Path) -> Any:
    """The content of the record of a stage's frame. Raises ValueError if it is damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))["content"]
        content["files"], content["keeps"]
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path}: it is damaged") from None
    return content


def _key(kind: str, name: str) -> str:
    """The key of a part: its prim's path below the shot; other files than USD have one part, without a name."""
    names = name.strip("/").split("/")
    if kind != "surroundings":
        names = [kind, *names[-1:]] if names[-1] else [kind, "base" if kind == "mesh" else kind]
    return "/".join(names[-2:] if len(names) > 1 else names * 2)


def _settings(text: str) -> dict[str, str]:
    """The values of a scene that a run wrote, as TOML, by table and key; those of [[tables]] are left out."""
    out: dict[str, str] = {}
    table: str | None = None
    for line in text.splitlines():
        heading = re.match(r"\s*\[(\[?)([a-z_.]+)\]", line)
        if heading:
            table = None if heading[1] else heading[2]
        found = re.match(r'([a-z_]+) = ("[^"]*"|[^#]*?)\s*(#.*)?$', line)
        if found and table:
            out[f"{table}.{found[1]}"] = found[2]
    return out


def load(folder: str | os.PathLike[str], number: int) -> Frame:
    """What a made frame of a shot holds: a Frame, with arrays of its meshes and points, and its volumes.

    folder: the shot's, as given to frazil.run or `frazil snow -o`
    number: of the frame

    Meshes and points are read from .usdc files or, where there are none, from .ply, .obj or .vdb, with the same result. Grids are read when
    Volume.load is called. Raises FileNotFoundError for a frame that is not made or a folder that no run made, ValueError if scene.toml or a record in
    state/ is damaged, frazil.Error for another file that is missing or damaged."""
    return Shot(folder).load(number)
