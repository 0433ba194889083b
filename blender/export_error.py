# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of an object that cannot be exported."""


class ExportError(ValueError):
    """Its text is one sentence that names the object, and the frame if it matters."""
