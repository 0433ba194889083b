# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Bake: runs the active shot's program in the background of Blender, and shows how far it is."""

import bpy

from . import check_rows, job_timer, jobs, loading, settings

_STAGES = (("ALL", "All", "All stages of the scene"), ("base", "Base", "The layer of snow"),
           ("grains", "Grains", "Snow that is pushed and thrown"), ("mist", "Mist", "Powder in the air"),
           ("volumes", "Volumes", "Meshes and volumes to render"), ("objects", "Objects", "The objects as they moved"))
# Before the name in the text of a log.
_LOG = "frazil log"
# An error of the program after which making all frames again helps.
_OTHER_SETTINGS = "made with other settings"


class _Bake:
    """A run, the names of its scene of Blender and of its shot, its last frame that was shown, and why its frames cannot be shown."""

    def __init__(self, run, scene, shot):
        self.run, self.scene, self.shot = run, scene, shot
        self.shown, self.error = None, None


# The last run by output folder, the one that runs or ran last, and the jobs.Free that runs.
_bakes = {}
_state = {"bake": None, "free": None}


class BakeOptions(bpy.types.PropertyGroup):
    """Which part of a shot is made, and how."""

    use_preview: bpy.props.BoolProperty(name="Preview", description="Make a quick look with larger cells, in a folder of its own")
    preview: bpy.props.IntProperty(name="Times the Cell", description="How many times as large the cells of a preview are", default=3, min=2, max=100)
    stage: bpy.props.EnumProperty(name="Stage", description="The stage of a shot of snow that is made", items=_STAGES, default="ALL")
    use_from: bpy.props.BoolProperty(name="From Frame", description="Keep the frames before this one, and make the others again, as settings "
                                     "have changed")
    from_frame: bpy.props.IntProperty(name="Frame", description="The first frame that is made again", default=1)
    threads: bpy.props.IntProperty(name="Threads", description="Number of threads; 0: all cores. The files do not depend on it", default=0, min=0,
                                   max=1024)
    reloads: bpy.props.BoolProperty(name="Show New Frames", description="Read the frames of a shot that is loaded as they are made", default=True)


def bake_folder(context, shot):
    """The folder that a bake of a shot writes, as the scene's options are (pathlib.Path): that of the shot, or beside it that of a preview."""
    options, folder = context.scene.frazil_bake, settings.output_folder(shot)
    if shot.system == "snow" and options.use_preview:
        return folder.with_name(f"{folder.name}_preview_{options.preview}")
    return folder


def _folder(operator, context):
    """The folder of bakes of the active shot; None, and a report by the operator, if the .blend file that it is relative to is not saved yet."""
    try:
        return bake_folder(context, settings.active(context))
    except ValueError as error:
        operator.report({"ERROR"}, str(error))
        return None


def is_running():
    """Whether a bake runs."""
    return _state["bake"] is not None and _state["bake"].run.is_running


def _is_freeing():
    return _state["free"] is not None and _state["free"].is_running


def _options(context, shot, again):
    """The options of frazil.run for a bake."""
    chosen, out = context.scene.frazil_bake, {}
    if shot.system == "snow":
        out["stages"] = () if chosen.stage == "ALL" else (chosen.stage,)
        out["preview"] = chosen.preview if chosen.use_preview else None
    if again:
        out["from_frame"] = settings.frames_of(shot)[0]
    elif chosen.use_from:
        out["from_frame"] = chosen.from_frame
    out["threads"] = chosen.threads or None
    return out


def _show_frames(bake, is_at_end):
    """Reads the frames that are new into the shot, if it is loaded and the scene wishes it."""
    run, scene = bake.run, bpy.data.scenes.get(bake.scene)
    done = (run.stage, run.frame)
    if scene is None or run.frame is None or not scene.frazil_bake.reloads or (done == bake.shown and not is_at_end):
        return
    bake.shown = done
    collection = loading.collection_of(run.output)
    if collection is None:
        return
    try:
        if is_at_end or run.frame == scene.frame_current:
            loading.reload(collection, scene.frame_current)
        else:
            loading.show_frame(collection, scene.frame_current)
        bake.error = None
    except loading.LoadError as error:
        # Stages after the one that runs have no files of this frame yet.
        bake.error = str(error)


def _start(context, shot, again):
    """Writes the scene of a shot and runs it."""
    jobs.find_frazil().program()
    options, folder = _options(context, shot, again), bake_folder(context, shot)
    bake = _Bake(jobs.Run(settings.write_scene(context, shot), folder, **options), context.scene.name, shot.name)
    _bakes[folder] = _state["bake"] = bake
    bake.run.start()
    printed = [0]

    def on_change():
        if bpy.app.background:
            log = bake.run.log
            for line in log[printed[0]:]:
                print(f"frazil: {bake.shot}: {line}", flush=True)
            printed[0] = len(log)
        _show_frames(bake, False)

    job_timer.follow(bake.run, lambda: _show_frames(bake, True), on_change)
    return bake


class FRAZIL_OT_bake(bpy.types.Operator):
    """Make the frames of the shot. Those that exist and match are kept, so that a bake that was cancelled goes on"""

    bl_idname = "frazil.bake"
    bl_label = "Bake"

    again: bpy.props.BoolProperty(name="All Again", description="Make all frames again, whatever settings they were made with")

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and not is_running() and not _is_freeing()

    def execute(self, context):
        try:
            bake = _start(context, settings.active(context), self.again)
        except (RuntimeError, ValueError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if bpy.app.background and bake.run.error is not None:
            self.report({"ERROR"}, bake.run.error)
            return {"CANCELLED"}
        return {"FINISHED"}


class FRAZIL_OT_cancel(bpy.types.Operator):
    """End the bake. The frames that are done stay, and the next bake goes on after them"""

    bl_idname = "frazil.cancel"
    bl_label = "Cancel"

    def execute(self, context):
        running = _state["bake"].run if is_running() else _state["free"] if _is_freeing() else None
        if running is None:
            self.report({"WARNING"}, "no bake is running")
            return {"CANCELLED"}
        running.cancel()
        return {"FINISHED"}


class FRAZIL_OT_free(bpy.types.Operator):
    """Remove the files that bakes of the shot wrote. Other files in the folder stay, and so do files that were changed since"""

    bl_idname = "frazil.free"
    bl_label = "Remove Baked Files"

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and not is_running() and not _is_freeing()

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, context):
        folder, scene = _folder(self, context), context.scene.name
        if folder is None:
            return {"CANCELLED"}
        if not folder.is_dir():
            self.report({"ERROR"}, f"{folder}: there is no such folder: nothing was baked")
            return {"CANCELLED"}
        free = _state["free"] = jobs.Free(folder)
        free.start()

        def on_end():
            collection = loading.collection_of(folder)
            if collection is not None and free.error is None and not free.is_cancelled and bpy.data.scenes.get(scene):
                loading.unload(collection)
            if free.remaining == []:
                _bakes.pop(folder, None)

        job_timer.follow(free, on_end)
        if bpy.app.background and free.error is not None:
            self.report({"ERROR"}, free.error)
            return {"CANCELLED"}
        if bpy.app.background and free.remaining:
            self.report({"WARNING"}, _kept_in_words(free))
        return {"FINISHED"}


def _kept_in_words(free):
    first, count = free.remaining[0], len(free.remaining)
    return f"{free.output}: {count} files stay, as no bake wrote them, or they were changed since: {first}{' ...' if count > 1 else ''}"


class FRAZIL_OT_show_log(bpy.types.Operator):
    """Show warnings, frames and the error of the shot's last bake"""

    bl_idname = "frazil.show_log"
    bl_label = "Log"

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def invoke(self, context, event):
        if self.execute(context) == {"CANCELLED"}:
            return {"CANCELLED"}
        text = self._text(context)
        editor = next((area for window in context.window_manager.windows for area in window.screen.areas if area.type == "TEXT_EDITOR"), None)
        if editor is None:
            return context.window_manager.invoke_popup(self, width=700)
        editor.spaces.active.text = text
        return {"FINISHED"}

    def execute(self, context):
        folder = _folder(self, context)
        bake = _bakes.get(folder)
        if folder is None:
            return {"CANCELLED"}
        if bake is None:
            self.report({"ERROR"}, f"{settings.active(context).name}: has no log: it was not baked since Blender was started")
            return {"CANCELLED"}
        text = self._text(context) or bpy.data.texts.new(f"{_LOG} {bake.shot}")
        text.from_string("\n".join([f"{bake.run.scene} -> {bake.run.output}", *bake.run.log, ""]))
        return {"FINISHED"}

    def draw(self, context):
        text = self._text(context)
        lines = [line.body for line in text.lines if line.body] if text is not None else []
        column = self.layout.column(align=True)
        important = [line for line in lines if line.startswith(("warning: ", "error: "))][-10:]
        for line in [*important, *(line for line in lines[-20:] if line not in important)]:
            for part in job_timer.wrapped(line, 110):
                column.label(text=part)
        column.separator()
        column.label(text=f"All {len(lines)} lines are in the text \"{_LOG} {settings.active(context).name}\", for a text editor")

    @staticmethod
    def _text(context):
        return bpy.data.texts.get(f"{_LOG} {settings.active(context).name}")


class FRAZIL_OT_open_folder(bpy.types.Operator):
    """Open the folder of the baked files in the file manager"""

    bl_idname = "frazil.open_folder"
    bl_label = "Open Folder"

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def execute(self, context):
        folder = _folder(self, context)
        if folder is None:
            return {"CANCELLED"}
        if not folder.is_dir():
            self.report({"ERROR"}, f"{folder}: there is no such folder: nothing was baked")
            return {"CANCELLED"}
        if bpy.app.background:
            # Nobody could see a window.
            print(folder)
            return {"FINISHED"}
        return bpy.ops.wm.path_open(filepath=str(folder))


class FRAZIL_PT_bake(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_bake"
    bl_label = "Bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 3

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def draw(self, context):
        layout, shot = self.layout, settings.active(context)
        try:
            folder = bake_folder(context, shot)
        except ValueError as error:
            job_timer.draw_text(layout, context.region, str(error), "ERROR")
            return
        if is_running():
            self._draw_running(context, _state["bake"])
        elif _is_freeing():
            layout.label(text="Reading the files before they are removed", icon="TIME")
            layout.operator("frazil.cancel", icon="CANCEL")
        else:
            self._draw_options(context, shot)
            self._draw_last(context, folder)
        row = layout.row(align=True)
        row.operator("frazil.show_log", icon="TEXT")
        row.operator("frazil.open_folder", icon="FILE_FOLDER", text="Folder")
        row.operator("frazil.free", icon="TRASH", text="Free")

    def _draw_options(self, context, shot):
        layout, options = self.layout, context.scene.frazil_bake
        column = layout.column(align=True)
        if shot.system == "snow":
            row = column.row(align=True)
            row.prop(options, "use_preview")
            sub = row.row(align=True)
            sub.enabled = options.use_preview
            sub.prop(options, "preview", text="x")
            column.prop(options, "stage")
        row = column.row(align=True)
        row.prop(options, "use_from")
        sub = row.row(align=True)
        sub.enabled = options.use_from
        sub.prop(options, "from_frame", text="")
        column.prop(options, "threads")
        column.prop(options, "reloads")
        row = layout.row()
        row.scale_y = 1.5
        row.operator("frazil.bake", icon="RENDER_ANIMATION").again = False

    def _draw_running(self, context, bake):
        layout, run = self.layout, bake.run
        fraction, left = run.fraction, run.seconds_left
        text = f"{job_timer.in_time(left)} left" if left is not None else "Reading the scene"
        if hasattr(layout, "progress"):
            layout.progress(factor=fraction, type="BAR", text=f"{100.0 * fraction:.0f} %, {text}")
        else:
            # Before Blender 4.0; the slider shows its number itself.
            layout.prop(context.window_manager, "frazil_progress", text=text, slider=True)
        if bake.shot != settings.active(context).name:
            layout.label(text=bake.shot)
        layout.label(text=f"stage {run.stage}, frame {run.frame}" if run.frame is not None else "before the first frame", icon="TIME")
        warnings = run.warnings
        if warnings:
            job_timer.draw_text(layout, context.region, warnings[-1], "ERROR")
        layout.operator("frazil.cancel", icon="CANCEL")

    def _draw_last(self, context, folder):
        layout, bake, free = self.layout, _bakes.get(folder), _state["free"]
        if free is not None and free.output == folder and (free.error or free.remaining):
            job_timer.draw_text(layout, context.region, free.error or _kept_in_words(free), "ERROR")
        if bake is None:
            return
        if bake.run.error is not None:
            job_timer.draw_text(layout.box(), context.region, bake.run.error, "CANCEL")
            if _OTHER_SETTINGS in bake.run.error:
                layout.operator("frazil.bake", text="Make All Frames Again", icon="FILE_REFRESH").again = True
        elif bake.run.is_cancelled:
            layout.label(text="Cancelled: Bake goes on", icon="PAUSE")
        else:
            record = bake.run.record
            words = f"{record['frames']} frames in {job_timer.in_time(record['seconds'])}"
            layout.label(text=f"Done: {words}, {check_rows.in_size(record['peak_memory_bytes'])}", icon="CHECKMARK")
            if bake.error is not None:
                job_timer.draw_text(layout, context.region, bake.error, "ERROR")
            if bake.run.warnings:
                job_timer.draw_text(layout, context.region, bake.run.warnings[-1], "ERROR")


def _progress(_):
    """The share of the time of the bake that runs (%), for the slider of Blender before 4.0, which has no progress bar."""
    return 100.0 * _state["bake"].run.fraction if _state["bake"] is not None else 0.0


_classes = (BakeOptions, FRAZIL_OT_bake, FRAZIL_OT_cancel, FRAZIL_OT_free, FRAZIL_OT_show_log, FRAZIL_OT_open_folder, FRAZIL_PT_bake)


def register():
    for one in _classes:
        bpy.utils.register_class(one)
    bpy.types.Scene.frazil_bake = bpy.props.PointerProperty(type=BakeOptions)
    bpy.types.WindowManager.frazil_progress = bpy.props.FloatProperty(name="Progress", subtype="PERCENTAGE", min=0.0, max=100.0, precision=0,
                                                                    get=_progress)


def unregister():
    # Also at the end of Blender, which unregisters its add-ons: no program runs on.
    jobs.end_all()
    job_timer.end()
    del bpy.types.WindowManager.frazil_progress
    del bpy.types.Scene.frazil_bake
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
