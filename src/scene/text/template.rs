//! A scene to begin with.

/// A commented scene for `frazil snow`: every key there is, those that may be left out behind a `#`.
pub const SNOW: &str = r##"# Snow that objects press into: `frazil check shot.toml`, then `frazil snow shot.toml -o cache/`.
# SI units, Y up, degrees where a key ends in _deg; paths are relative to this file.
# A line behind a # may be left out: what stands there is what is taken.

[shot]
frames = "1-120"                 # first and last
# fps = 24

[snow]
ground = 0.0                     # height of a level plane (m), or a mesh: "set/ground.obj" (then no area)
area = [-3.0, -3.0, 3.0, 3.0]    # of the plane: x0, z0, x1, z1 (m)
depth = 0.30                     # above the ground and static objects (m)
# top = "snow_top.ply"           # in place of depth: a mesh of the snow's top, or a .vdb level set of all the snow
cell = 0.0075                    # edge of a voxel (m)
# min_crumb = 0                  # islands of fewer voxels, left by ragged edges and thin walls, are taken away; 0 = none

# [snow.noise]                   # ragged edges, outward only
# amplitude = 0.015              # m; two cells; 0 = off
# size = 0.06                    # m; of the largest features; eight cells
# octaves = 3                    # each of half the size of the one before
# seed = 0

[[object]]                       # as many as there are
file = "hero.glb"                # .glb or .gltf; a mesh (.obj, .ply, .stl); or a sequence, "body.%04d.obj"
# node = "hero*"                 # of a .glb: only nodes of this name and what hangs on them; * stands for any letters
# clip = "Walk"                  # of a .glb: needed when it has several; "" = the pose at rest
# loop = true                    # of a .glb: the clip starts again when it ends
# offset = 0                     # frames that the clip or sequence starts later
# scale = 1.0                    # metres in the file's unit: 0.01 for centimetres
# up = "y"                       # the file's upward axis: y or z
# role = "collide"               # collide, static (the snow lies on it) or ignore
# noise = true                   # ragged edges of its prints
# ease = false                   # true: keys are joined smoothly, starting and ending at rest; else straight lines
keys = [                         # composed over the file's own motion: a walk in place goes somewhere
    { frame = 1, at = [0.0, 0.1, -2.5] },
    { frame = 120, at = [0.0, 0.1, 2.5], turn_deg = [0.0, 0.0, 0.0] },
]

# [output]
# base = ["vdb"]                 # base/base.%04d.vdb: surface, compression, touched; [] = none
# base_mode = "full"             # or "delta": the first frame whole, then what changed; see `frazil vdb rebuild`
# half = false                   # 16-bit values, for rendering only
# removed = ["vdb"]              # removed/removed.%04d.vdb: what each frame took away
# objects = []                   # "usd", "ply": objects/, the objects as they moved, with velocities
# usd = true                     # shot.usda
"##;
