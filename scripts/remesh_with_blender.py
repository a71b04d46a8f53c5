#!/usr/bin/env python3
"""Remeshes an STL file with Blender's Remesh modifier (mode SHARP), for bench_peers.py.

    remesh_with_blender.py IN.stl OUT.ply DEPTH SCALE     remeshes
    remesh_with_blender.py                                only starts Blender

Needs an interpreter that has `bpy`. The modifier's code is PolyMender's. Its grid has 2^DEPTH cells
a side, and the mesh takes SCALE of it. The last line on stdout is JSON: Blender's version, and the
processor seconds of start, reading, remeshing and writing.
"""

import json
import sys
import time


def lap(seconds, name, start):
    """Notes the processor time since `start`; returns now."""
    now = time.process_time()
    seconds[name] = now - start
    return now


def main():
    """Reads, remeshes, writes."""
    seconds = {}
    import bpy  # The costly part of the start, so it is on the clock.

    bpy.ops.wm.read_factory_settings(use_empty=True)
    now = lap(seconds, "start", 0.0)
    if len(sys.argv) > 1:
        source, target, depth, scale = sys.argv[1:]
        # Axes as they are: no turn from Y up to Z up.
        axes = {"forward_axis": "Y", "up_axis": "Z"}
        bpy.ops.wm.stl_import(filepath=source, **axes)
        now = lap(seconds, "read", now)
        solid = bpy.context.selected_objects[0]
        remesh = solid.modifiers.new("Remesh", "REMESH")
        remesh.mode = "SHARP"
        remesh.octree_depth = int(depth)
        remesh.scale = float(scale)
        remesh.use_remove_disconnected = False
        # Evaluated here, once; the export takes what lies there.
        solid.evaluated_get(bpy.context.evaluated_depsgraph_get())
        now = lap(seconds, "remesh", now)
        bpy.ops.wm.ply_export(
            filepath=target, export_selected_objects=True, apply_modifiers=True,
            export_normals=False, export_uv=False, export_colors="NONE", **axes,
        )
        lap(seconds, "write", now)
    print(json.dumps({"version": bpy.app.version_string, "cpu_seconds": seconds}), flush=True)


if __name__ == "__main__":
    main()
