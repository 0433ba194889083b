# SPDX-License-Identifier: GPL-3.0-or-later
"""frazil in Blender: shots of snow, of surfaces that follow liquids and of little liquids are set up, made and loaded."""

import sys

if sys.version_info < (3, 11):
    raise ImportError("frazil needs Python 3.11, which is in Blender 4.1 and later, and in Debian's Blender 3.4")

from . import settings, shot_panel, objects_panel, figure, check_panel, bake_panel, takes_panel, load_panel

bl_info = {
    "name": "frazil",
    "author": "The frazil authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > frazil",
    "description": "Characters walk through deep snow, meshes follow liquids, little liquids run over surfaces",
    "category": "Physics",
}

# In this order: the panels need the properties of shots.
_MODULES = (settings, shot_panel, objects_panel, figure, check_panel, bake_panel, takes_panel, load_panel)


def register():
    for module in _MODULES:
        module.register()


def unregister():
    for module in reversed(_MODULES):
        module.unregister()
