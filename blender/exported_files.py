# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of exported objects. A file is written only if its content changed, so that a run that resumes finds the files it began with."""

import hashlib
import json
import os

RECORD = "exported.json"


class ExportedFiles:
    """The files in a folder, with a record of their hashes beside them."""

    def __init__(self, folder):
        """`folder`: pathlib.Path; it is made if it is missing."""
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        try:
            record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):
            # Without a readable record every file is written once more.
            record = {}
        self._known, self._now = record, {}

    def relative(self, name):
        """The path of a file from the folder that holds the scene."""
        return f"{self.folder.name}/{name}"

    def write(self, name, data):
        """Writes bytes into a file, whole or not at all, unless it has them already. Raises OSError."""
        path = self.folder / name
        entry = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        self._now[name] = entry
        if self._known.get(name) == entry and path.is_file() and path.stat().st_size == entry["bytes"]:
            return
        temporary = path.with_name(f".{name}.{os.getpid()}")
        try:
            temporary.write_bytes(data)
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise

    def save(self):
        """Writes the record."""
        record = json.dumps({**self._known, **self._now}, indent=1, sort_keys=True)
        temporary = self.folder / f".{RECORD}.{os.getpid()}"
        temporary.write_text(record, encoding="utf-8")
        os.replace(temporary, self.folder / RECORD)
