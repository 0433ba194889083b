"""meshio and pysplashsurf read a file of particles; what they see is compared by benches/gates/surface_readers.rs.

python particles.py FILE RECORDS

A record is a particle's identity (64-bit integer; its index where the file has none) and its place (three doubles), in the
file's order. splashsurf's own readers, which drop identities and keep 32 bits, must find the same places where they read the
file at all.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import meshio
import numpy
import pysplashsurf

NAMES = ("id", "index")


def of_splashsurf(path):
    """Places, in 32 bits; none where it fails."""
    program = [sys.executable, "-c", "import pysplashsurf; pysplashsurf.run_pysplashsurf()"]
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "places.json")
        command = [*program, "convert", "--particles", path, "-o", out, "-q"]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            return None
        return numpy.array(json.loads(out.read_text()), numpy.float32).reshape(-1, 3)


def read(path):
    """Identities and places, and the names of those that read them."""
    seen = of_splashsurf(path)
    if path.suffix == ".xyz":
        assert seen is not None, "splashsurf cannot read it"
        return numpy.arange(len(seen)), seen, "splashsurf"
    is_bgeo = path.suffix == ".bgeo"
    mesh = pysplashsurf.bgeo.readbgeo_to_meshio(path) if is_bgeo else meshio.read(path)
    ids = next((mesh.point_data[name] for name in NAMES if name in mesh.point_data), None)
    readers = "pysplashsurf.bgeo" if is_bgeo else "meshio"
    if seen is not None:
        assert numpy.array_equal(seen, mesh.points.astype(numpy.float32)), "the two readers differ"
        readers += " and splashsurf"
    return numpy.arange(len(mesh.points)) if ids is None else ids.reshape(-1), mesh.points, readers


def main():
    """Reads one, writes the other."""
    ids, places, readers = read(pathlib.Path(sys.argv[1]))
    records = numpy.empty(len(places), [("id", "<i8"), ("place", "<f8", 3)])
    records["id"], records["place"] = ids, places
    pathlib.Path(sys.argv[2]).write_bytes(records.tobytes())
    print(f"frazil: {len(records)} particles, read by {readers}")


main()
