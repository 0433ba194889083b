# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window at its start: enables the add-on and opens the sidebar of the 3D view."""

import bpy


def prepared():
    bpy.ops.preferences.addon_enable(module="frazil_shots")
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces[0].show_region_ui = True


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(prepared, first_interval=0.1)
