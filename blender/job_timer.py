# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows jobs while Blender's interface stays alive; without an interface it waits for them."""

import traceback

import bpy

_INTERVAL = 0.25
_functions = set()


def follow(job, on_end, on_change=None):
    """Calls on_change() a few times a second while a job (jobs._Job) that was started runs, and then on_end(), in Blender's thread.

    With an interface, returns at once. In background mode, where no timer runs, returns after on_end()."""
    if bpy.app.background:
        while not job.wait(0.1):
            _call(on_change)
        _call(on_change)
        _call(on_end)
        return

    def poll():
        # Read first: what happens between the last change and the end would be missed otherwise.
        is_running = job.is_running
        _call(on_change)
        if not is_running:
            _functions.discard(poll)
            _call(on_end)
        redraw()
        return _INTERVAL if is_running else None

    _functions.add(poll)
    bpy.app.timers.register(poll, first_interval=_INTERVAL, persistent=True)


def _call(function):
    """Calls a function, if there is one. Whatever it raises is printed, as it has no operator that could report it: the job goes on."""
    try:
        if function is not None:
            function()
    except Exception:
        traceback.print_exc()


def redraw():
    """Draws the sidebars of all 3D views again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def in_time(seconds):
    """A time (s) as 0:00:00."""
    seconds = round(seconds)
    return f"{seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02}"


def wrapped(text, width):
    """A text in lines of at most `width` characters, cut at spaces, or within words that are longer."""
    lines = [""]
    for word in text.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}" if lines[-1] else word
        while len(lines[-1]) > width:
            lines[-1:] = [lines[-1][:width], lines[-1][width:]]
    return lines


def draw_text(layout, region, text, icon="NONE"):
    """Draws a text of any length over several lines of a region's width (None: without a region, 60 characters)."""
    scale = 7.0 * bpy.context.preferences.system.ui_scale
    width = max(20, int(region.width / scale) - 6) if region is not None else 60
    column = layout.column(align=True)
    column.scale_y = 0.8
    for index, line in enumerate(wrapped(text, width)):
        column.label(text=line, icon=icon if index == 0 else "BLANK1" if icon != "NONE" else "NONE")


def end():
    """Ends all timers."""
    for function in _functions:
        if bpy.app.timers.is_registered(function):
            bpy.app.timers.unregister(function)
    _functions.clear()
