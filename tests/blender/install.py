# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the add-on from its zip into BLENDER_USER_RESOURCES (3.4: BLENDER_USER_SCRIPTS and _CONFIG), enables it and saves that: -- ZIP"""

import sys

import bpy

path = sys.argv[-1]
if bpy.app.version >= (4, 2, 0):
    extensions = bpy.context.preferences.extensions
    if "user_default" not in [repo.module for repo in extensions.repos]:
        extensions.repos.new(name="User Default", module="user_default")
    bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
else:
    bpy.ops.preferences.addon_install(filepath=path)
    bpy.ops.preferences.addon_enable(module="frazil_shots")
bpy.ops.wm.save_userpref()
names = [addon.module for addon in bpy.context.preferences.addons if addon.module.endswith("frazil_shots")]
assert len(names) == 1 and hasattr(bpy.types.Scene, "frazil"), "the add-on is not enabled"
print("installed:", names[0], flush=True)
