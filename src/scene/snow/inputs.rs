//! Everything a scene reads before its first frame.

use std::path::Path;
use std::sync::Arc;

use super::initial_grains::Drift;
use super::inspect::warnings::{replaced, too_small};
use super::wind;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::mesh::weld::Weld;
use crate::geometry::mesh::{BY_KEY, farthest, too_far as far_mesh};
use crate::geometry::{DVec3, TriMesh};
use crate::io::files::hash;
use crate::io::files::sequence::Pattern;
use crate::io::mesh;
use crate::io::records::input_hashes::InputHashes;
use crate::motion::{Character, Key, Keys, MeshSequence, Motion, Placed, Play, Rigid, is_gltf, missing_uvs};
use crate::scene::{Ground, Layer, Object, Role, Scene, Snow, schema};
use crate::snow::base_layer::initial::{self, Cover};
use crate::sweep::{self, Body, REACH};
use crate::vdb::{FloatGrid, GridClass, VectorGrid, distances, file};

/// Half width of the snow's narrow band (cells).
const HALF_WIDTH: f32 = 3.0;

/// Contents of a scene's files.
pub struct Inputs {
    /// The layer's description.
    pub(super) snow: Snow,
    source: Source,
    statics: Vec<TriMesh>,
    /// The objects that move through the snow.
    pub bodies: Vec<Body>,
    /// Initial grains.
    pub(super) drift: Option<Drift>,
    /// Wind that varies in space.
    pub(super) wind: Option<VectorGrid>,
    /// Contents of the files when they were read.
    pub(in crate::scene) seen: Arc<InputHashes>,
    /// Warnings about the files, one sentence each; they are logged too.
    pub warnings: Vec<String>,
}

/// Source of the first layer.
enum Source {
    Made {
        ground: initial::Ground,
        cover: Cover,
    },
    /// A level set from a file; only grains lie on the ground.
    Given {
        grid: FloatGrid,
        ground: Option<Under>,
    },
}

/// A ground without an area.
enum Under {
    Level(f64),
    Mesh(TriMesh),
}

impl Inputs {
    /// Reads every input; for sequences the first frame, after checking that none is missing.
    ///
    /// # Errors
    /// Errors in files or keys, with file and key.
    pub fn load(scene: &Scene) -> Result<Self> {
        let seen = Arc::new(InputHashes::default());
        let snow = scene.snow()?.clone();
        let mut warnings = Vec::new();
        let source = match &snow.layer {
            Layer::Grid(path) => {
                let grid = layer_grid(path, snow.cell, &seen)?;
                Source::Given { grid, ground: under(&snow, &seen, &mut warnings)? }
            }
            Layer::Depth(depth) => {
                Source::Made { ground: ground(&snow, &seen, &mut warnings)?, cover: Cover::Depth(*depth) }
            }
            Layer::Top(path) => {
                let ground = ground(&snow, &seen, &mut warnings)?;
                Source::Made { ground, cover: Cover::Top(read_mesh(path, &snow, &seen, &mut warnings)?) }
            }
        };
        if let Source::Made { ground, cover } = &source {
            initial::fits(ground, cover, snow.cell)
                .map_err(|error| Error::argument(format!("{}: {error}", scene.path.display())))?;
        }
        warnings.extend(far_meshes(&snow, &source));
        warnings.extend(unclear_corners(&snow, &source));
        let start = f64::from(scene.shot.frames.first) / scene.shot.fps;
        let (mut statics, mut bodies) = (Vec::new(), Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            if object.role == Role::Ignore {
                continue;
            }
            let motion = motion(scene, object, &seen, &mut warnings)?;
            match object.role {
                Role::Static => {
                    let (mesh, unclear) = posed(&*motion, start)?;
                    warnings.extend(unclear.map(|what| format!("{}: {what}", object.file.display())));
                    statics.push(oriented(mesh, &object_name(index, object), &mut warnings));
                }
                _ => {
                    let name = object_name(index, object);
                    let body = Body::new(motion, start)?.with_noise(object.noise).with_name(name);
                    log::info!(
                        "{}: {} triangles, {} open loops closed",
                        object.file.display(),
                        body.motion().triangles().len(),
                        body.closed_loops()
                    );
                    if let Some(what) = body.warning() {
                        log::warn!("{}: {what}", object.file.display());
                    }
                    warnings
                        .extend(body.weld_warning().map(|what| format!("{}: {what}", object.file.display())));
                    warnings.extend(too_small(scene, object, &body, start)?);
                    bodies.push(body);
                }
            }
        }
        warnings.extend(replaced(&scene.values));
        let drift = Drift::of(scene, snow.cell, &seen, &mut warnings)?;
        let wind = match wind::wind_file(scene) {
            None => None,
            Some(path) => {
                // OpenVDB reads the file itself: its content must be the same before and after.
                seen.hash(path)?;
                let wind = wind::wind(path)?;
                seen.note(path, hash::of_file(path)?)?;
                Some(wind)
            }
        };
        warnings.iter().for_each(|warning| log::warn!("{warning}"));
        Ok(Self { snow, source, statics, bodies, drift, wind, seen, warnings })
    }

    /// Minimum and maximum x and z of the snow (m), if known before it is made.
    pub fn area(&self) -> Option<[f64; 4]> {
        match &self.source {
            Source::Made { ground: initial::Ground::Plane { area, .. }, .. } => Some(*area),
            Source::Made { ground: initial::Ground::Mesh(mesh), .. } => {
                let (low, high) = mesh.bounds()?;
                Some([low.x, low.z, high.x, high.z].map(f64::from))
            }
            Source::Given { .. } => None,
        }
    }

    /// Maximum height of the snow (m), if known before it is made; without static objects.
    pub fn top(&self) -> Option<f64> {
        let highest = |mesh: &TriMesh| mesh.bounds().map(|(_, high)| f64::from(high.y));
        match (&self.source, &self.snow.layer) {
            (Source::Made { cover: Cover::Top(top), .. }, _) => highest(top),
            (Source::Made { ground, .. }, Layer::Depth(depth)) => {
                let ground = match ground {
                    initial::Ground::Plane { height, .. } => Some(*height),
                    initial::Ground::Mesh(mesh) => highest(mesh),
                };
                let statics = self.statics.iter().filter_map(highest).fold(f64::NEG_INFINITY, f64::max);
                Some(ground?.max(statics) + depth)
            }
            _ => None,
        }
    }

    /// Minimum and maximum corner of the snow's ground, top and static objects (m); for a given layer, of its active voxels.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let of_mesh =
            |mesh: &TriMesh| mesh.bounds().map(|(low, high)| (low.cast::<f64>(), high.cast::<f64>()));
        let (ground, top) = match &self.source {
            Source::Given { grid, .. } => {
                let (low, high) = grid.active_bbox()?;
                let corner = |voxel: [i32; 3]| DVec3::from(voxel.map(f64::from)) * grid.voxel_size();
                return Some((corner(low), corner(high)));
            }
            Source::Made { ground, cover } => {
                (ground, if let Cover::Top(top) = cover { of_mesh(top) } else { None })
            }
        };
        let ground = match ground {
            initial::Ground::Plane { height, area: [x0, z0, x1, z1] } => {
                Some((DVec3::new(*x0, *height, *z0), DVec3::new(*x1, *height, *z1)))
            }
            initial::Ground::Mesh(mesh) => of_mesh(mesh),
        };
        let all = self.statics.iter().map(of_mesh).chain([top]).flatten();
        let (low, mut high) = all.fold(ground?, |(low, high), (l, h)| (low.inf(&l), high.sup(&h)));
        if let Layer::Depth(depth) = &self.snow.layer {
            high.y += depth;
        }
        Some((low, high))
    }

    /// The error for a static object too far from the snow's ground.
    pub(super) fn far_static(&self, scene: &Scene) -> Option<String> {
        let Source::Made { ground, .. } = &self.source else { return None };
        let middle = match ground {
            initial::Ground::Plane { height, area: [x0, z0, x1, z1] } => {
                DVec3::new(0.5 * (x0 + x1), *height, 0.5 * (z0 + z1))
            }
            initial::Ground::Mesh(mesh) => {
                let (low, high) = mesh.bounds()?;
                (low + high).cast::<f64>() * 0.5
            }
        };
        let statics = scene.objects.iter().enumerate().filter(|(_, object)| object.role == Role::Static);
        statics.zip(&self.statics).find_map(|((index, object), mesh)| {
            let (low, high) = mesh.bounds()?;
            let far = (low.cast::<f64>() - middle).abs().sup(&(high.cast::<f64>() - middle).abs()).max();
            // The origin of the layer's lattice is the mean of the ground's vertices, which may differ from its centre.
            let what = format!("object {} ({}), static, reaches", index + 1, schema::name(&object.file));
            let is_far = far > 0.9 * REACH * self.snow.cell;
            is_far.then(|| sweep::too_far(&what, far, "the middle of the ground", self.snow.cell))
        })
    }

    /// The ground and the amount of snow, unless the snow is given as a level set.
    pub(super) fn made(&self) -> Option<(&initial::Ground, &Cover)> {
        match &self.source {
            Source::Made { ground, cover } => Some((ground, cover)),
            Source::Given { .. } => None,
        }
    }

    /// Height of a level ground (m).
    pub(super) fn floor(&self) -> Option<f64> {
        match &self.source {
            Source::Made { ground: initial::Ground::Plane { height, .. }, .. } => Some(*height),
            Source::Given { ground: Some(Under::Level(height)), .. } => Some(*height),
            _ => None,
        }
    }

    /// The ground, if it is a mesh.
    pub(super) fn ground(&self) -> Option<&TriMesh> {
        self.source.ground()
    }

    /// Static objects, which the snow lies on.
    pub(super) fn statics(&self) -> &[TriMesh] {
        &self.statics
    }

    /// The snow, if it is given as a level set.
    pub(super) fn given(&self) -> Option<&FloatGrid> {
        match &self.source {
            Source::Given { grid, .. } => Some(grid),
            Source::Made { .. } => None,
        }
    }

    /// The snow before the first frame.
    ///
    /// # Errors
    /// As [`initial::layer`].
    pub fn layer(&self, ctx: &Context) -> Result<FloatGrid> {
        match &self.source {
            Source::Given { grid, .. } => grid.deep_copy(),
            Source::Made { ground, cover } => {
                initial::layer(ctx, ground, &self.statics, cover, self.snow.cell, HALF_WIDTH)
            }
        }
    }
}

impl Source {
    fn ground(&self) -> Option<&TriMesh> {
        match self {
            Self::Made { ground: initial::Ground::Mesh(mesh), .. } => Some(mesh),
            Self::Given { ground: Some(Under::Mesh(mesh)), .. } => Some(mesh),
            _ => None,
        }
    }

    fn top(&self) -> Option<&TriMesh> {
        if let Self::Made { cover: Cover::Top(mesh), .. } = self { Some(mesh) } else { None }
    }
}

fn object_name(index: usize, object: &Object) -> String {
    format!("object {} ({})", index + 1, schema::name(&object.file))
}

/// A mesh with its closed parts outward; adds warnings about what remains ambiguous.
fn oriented(mesh: TriMesh, name: &str, warnings: &mut Vec<String>) -> TriMesh {
    let orientation = Orientation::of_mesh(&mesh, Closing::Caps);
    warnings.extend(orientation.warning().map(|what| format!("{name}: {what}")));
    orientation.applied_to(mesh)
}

fn read_mesh(path: &Path, snow: &Snow, seen: &InputHashes, warnings: &mut Vec<String>) -> Result<TriMesh> {
    let mesh = mesh::parse_polygons_from(path, &seen.read(path)?, snow.origin)?;
    // Unused vertices are not part of the snow.
    Ok(oriented(mesh.into_triangles().without_unused(), &path.display().to_string(), warnings))
}

fn ground(snow: &Snow, seen: &InputHashes, warnings: &mut Vec<String>) -> Result<initial::Ground> {
    match &snow.ground {
        Some(Ground::Plane { height, area: Some(area) }) => {
            Ok(initial::Ground::Plane { height: *height, area: *area })
        }
        Some(Ground::Mesh(path)) => Ok(initial::Ground::Mesh(read_mesh(path, snow, seen, warnings)?)),
        _ => Err(Error::argument("the snow has no ground")),
    }
}

/// The ground beside a given layer.
fn under(snow: &Snow, seen: &InputHashes, warnings: &mut Vec<String>) -> Result<Option<Under>> {
    Ok(match &snow.ground {
        None => None,
        Some(Ground::Plane { height, .. }) => Some(Under::Level(*height)),
        Some(Ground::Mesh(path)) => Some(Under::Mesh(read_mesh(path, snow, seen, warnings)?)),
    })
}

/// Warnings about a mesh of ground or top that lies far from the origin.
fn far_meshes(snow: &Snow, source: &Source) -> Vec<String> {
    let warning = |path: &Path, mesh: &TriMesh| {
        far_mesh(&path.display().to_string(), mesh.farthest(), 1.0, snow.cell, FOR_SNOW)
    };
    /// No key moves these.
    const FOR_SNOW: &str = "give snow.origin nearby, which is subtracted in 64 bits, or save it near the origin and move the scene there too";
    let mut out = Vec::new();
    if let (Some(Ground::Mesh(path)), Some(mesh)) = (&snow.ground, source.ground()) {
        out.extend(warning(path, mesh));
    }
    if let (Layer::Top(path), Some(mesh)) = (&snow.layer, source.top()) {
        out.extend(warning(path, mesh));
    }
    out
}

/// Warnings about corners of a mesh of ground or top that rounding does not decide.
fn unclear_corners(snow: &Snow, source: &Source) -> Vec<String> {
    let warning = |path: &Path, mesh: &TriMesh| {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
        let what = Weld::of(&positions, &mesh.triangles).warning();
        what.map(|what| format!("{}: {what}", path.display()))
    };
    let ground = match (&snow.ground, source.ground()) {
        (Some(Ground::Mesh(path)), Some(mesh)) => warning(path, mesh),
        _ => None,
    };
    let top = match (&snow.layer, source.top()) {
        (Layer::Top(path), Some(mesh)) => warning(path, mesh),
        _ => None,
    };
    ground.into_iter().chain(top).collect()
}

fn layer_grid(path: &Path, cell: f64, seen: &InputHashes) -> Result<FloatGrid> {
    // OpenVDB reads the file itself: its content must be the same before and after.
    seen.hash(path)?;
    let grid = file::read_named(path, None)?;
    seen.note(path, hash::of_file(path)?)?;
    if grid.class() != GridClass::LevelSet {
        return Err(Error::file(path, format!("grid \"{}\" is not a level set", grid.name())));
    }
    let own = grid.voxel_size();
    if (own - cell).abs() > 1e-6 * cell {
        return Err(Error::file(path, format!("the layer has cells of {own} m, but `cell` is {cell} m")));
    }
    if let Some(what) = distances::warning(&grid)? {
        return Err(Error::file(path, format!("grid \"{}\" {what}", grid.name())));
    }
    if f64::from(grid.background()) < 2.999 * own {
        return Err(Error::file(path, "the layer's narrow band is less than 3 cells wide"));
    }
    Ok(grid)
}

/// An object's motion: its file, its own frames, scale and axis, with the keys on top.
fn motion(
    scene: &Scene,
    object: &Object,
    seen: &Arc<InputHashes>,
    warnings: &mut Vec<String>,
) -> Result<Box<dyn Motion>> {
    let fps = scene.shot.fps;
    let radians = |turn: [f64; 3]| DVec3::from(turn.map(f64::to_radians));
    let keys = object.keys.iter().map(|key| Key {
        time: key.frame / fps,
        at: DVec3::from(key.at),
        turn: radians(key.turn_deg),
    });
    let keys = Keys::new(keys.collect())?.with_ease(object.ease);
    let own: Box<dyn Motion> = match Pattern::parse(&object.file) {
        None if is_gltf(&object.file) => Box::new(character(scene, object, seen)?),
        None => {
            let polygons =
                mesh::parse_polygons_from(&object.file, &seen.read(&object.file)?, object.space.origin)?;
            Box::new(Rigid::of_polygons(polygons, Keys::default()))
        }
        Some(pattern) => {
            let first = (f64::from(scene.shot.frames.first) - object.offset).floor() as i32;
            let last = (f64::from(scene.shot.frames.last) - object.offset).ceil() as i32;
            let origin = object.space.origin;
            Box::new(MeshSequence::open_seen(pattern, first, last, fps, object.offset, seen.clone(), origin)?)
        }
    };
    let mut pose = Vec::new();
    own.pose(f64::from(scene.shot.frames.first) / fps, &mut pose)?;
    // Meshes are read minus the origin.
    let space = if is_gltf(&object.file) { object.space } else { object.space.without_origin() };
    pose.iter_mut().for_each(|position| *position -= space.origin);
    let name = object.file.display().to_string();
    warnings.extend(far_mesh(&name, farthest(pose.iter()), space.scale, scene.snow()?.cell, BY_KEY));
    if scene.output.objects_usd || scene.output.objects_ply {
        let missing = own.drawn().uvs.map_or(0, |uvs| uvs.missing);
        warnings.extend((missing > 0).then(|| missing_uvs(&name, missing)));
    }
    Ok(Box::new(Placed::new(own, space, keys)))
}

fn character(scene: &Scene, object: &Object, seen: &InputHashes) -> Result<Character> {
    let play = Play {
        node: object.node.clone(),
        clip: object.clip.clone(),
        repeat: object.repeat,
        start: (f64::from(scene.shot.frames.first) + object.offset) / scene.shot.fps,
    };
    let character = Character::open(&object.file, play)?;
    seen.note(&object.file, character.content().to_string())?;
    if let Some(jump) = character.jump() {
        let metres = jump * object.space.scale;
        log::warn!(
            "{}: the clip does not end as it begins: each round starts with a jump of {metres:.3} m",
            object.file.display()
        );
    }
    Ok(character)
}

/// A motion's mesh at a time (s), with vertices that are one corner at one position, and a warning about ambiguous ones.
fn posed(motion: &dyn Motion, time: f64) -> Result<(TriMesh, Option<String>)> {
    let mut pose = Vec::new();
    motion.pose_as_read(time, &mut pose)?;
    // After transforms the rounding of its coordinates is no longer known.
    let weld = Weld::of(&pose, motion.triangles());
    motion.pose(time, &mut pose)?;
    weld.unify(&mut pose);
    let positions = pose.iter().map(|p| p.cast()).collect();
    Ok((TriMesh { positions, triangles: motion.triangles().to_vec() }, weld.warning()))
}
