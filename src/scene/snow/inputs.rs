//! Everything a scene reads before its first frame.

use std::path::Path;
use std::sync::Arc;

use super::initial_grains::InitialGrains;
use super::inspect::warnings::{replaced, too_small};
use super::wind;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::mesh::weld::Weld;
use crate::geometry::mesh::{BY_KEY, farthest, too_far_warning};
use crate::geometry::{DVec3, TriMesh};
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

/// Advice about a mesh of ground or top that lies far from the origin.
const ORIGIN_ADVICE: &str = "give snow.origin nearby, which is subtracted in 64 bits, or save it near the origin and move the scene there too";

/// Contents of a scene's files.
pub struct Inputs {
    /// The layer's description.
    pub(super) snow: Snow,
    source: Source,
    statics: Vec<TriMesh>,
    /// The objects that move through the snow.
    pub bodies: Vec<Body>,
    /// Grains at the first frame.
    pub(super) initial_grains: Option<InitialGrains>,
    /// Wind that varies in space.
    pub(super) wind: Option<VectorGrid>,
    /// Contents of the files when they were read.
    pub(in crate::scene) input_hashes: Arc<InputHashes>,
    /// Warnings about the files, one sentence each; they are logged too.
    pub warnings: Vec<String>,
}

/// Where the initial layer comes from.
enum Source {
    /// Built from the ground and a depth or top.
    Made { ground: initial::Ground, cover: Cover },
    /// A level set from a file; only grains lie on the ground.
    Given { grid: FloatGrid, ground: Option<GroundBelow> },
}

/// The ground below a given layer: it needs no area.
enum GroundBelow {
    Level(f64),
    Mesh(TriMesh),
}

impl Inputs {
    /// Reads every input (of a sequence only the first frame), after checking that no frame is missing.
    ///
    /// # Errors
    /// Errors in files or keys, with file and key.
    pub fn load(scene: &Scene) -> Result<Self> {
        let input_hashes = Arc::new(InputHashes::default());
        let snow = scene.snow()?.clone();
        let mut warnings = Vec::new();
        let source = match &snow.layer {
            Layer::Grid(path) => {
                let grid = layer_grid(path, snow.cell, &input_hashes)?;
                Source::Given { grid, ground: ground_below(&snow, &input_hashes, &mut warnings)? }
            }
            Layer::Depth(depth) => Source::Made {
                ground: ground(&snow, &input_hashes, &mut warnings)?,
                cover: Cover::Depth(*depth),
            },
            Layer::Top(path) => {
                let ground = ground(&snow, &input_hashes, &mut warnings)?;
                Source::Made {
                    ground,
                    cover: Cover::Top(read_mesh(path, &snow, &input_hashes, &mut warnings)?),
                }
            }
        };
        if let Source::Made { ground, cover } = &source {
            initial::check_thickness(ground, cover, snow.cell)
                .map_err(|error| Error::argument(format!("{}: {error}", scene.path.display())))?;
        }
        let meshes = || snow.files().filter_map(|(key, path)| Some((&**path, source.mesh(key)?)));
        warnings.extend(meshes().filter_map(|(path, mesh)| {
            too_far_warning(&path.display().to_string(), mesh.farthest(), 1.0, snow.cell, ORIGIN_ADVICE)
        }));
        warnings.extend(meshes().filter_map(|(path, mesh)| ambiguous_corners(path, mesh)));
        let start = scene.shot.time(scene.shot.frames.first);
        let (mut statics, mut bodies) = (Vec::new(), Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            if object.role == Role::Ignore {
                continue;
            }
            let motion = motion(scene, object, &input_hashes, &mut warnings)?;
            let (name, file) = (object_name(index, object), object.file.display());
            if object.role == Role::Static {
                let (mesh, ambiguous) = posed(&*motion, start)?;
                warnings.extend(ambiguous.map(|what| format!("{file}: {what}")));
                statics.push(oriented(mesh, &name, &mut warnings));
                continue;
            }
            let body = Body::new(motion, start)?.with_noise(object.noise).with_name(name);
            let (triangles, closed) = (body.motion().triangles().len(), body.closed_loops());
            log::info!("{file}: {triangles} triangles, {closed} open loops closed");
            if let Some(what) = body.warning() {
                log::warn!("{file}: {what}");
            }
            warnings.extend(body.weld_warning().map(|what| format!("{file}: {what}")));
            warnings.extend(too_small(scene, object, &body, start)?);
            bodies.push(body);
        }
        warnings.extend(replaced(&scene.values));
        let initial_grains = InitialGrains::of(scene, snow.cell, &input_hashes, &mut warnings)?;
        let wind = match wind::wind_file(scene) {
            None => None,
            Some(path) => Some(input_hashes.read_with(path, || wind::wind(path))?),
        };
        warnings.iter().for_each(|warning| log::warn!("{warning}"));
        Ok(Self { snow, source, statics, bodies, initial_grains, wind, input_hashes, warnings })
    }

    /// Minimum and maximum x and z of the snow (m), if known before it is made.
    pub fn area(&self) -> Option<[f64; 4]> {
        match &self.source {
            Source::Made { ground, .. } => {
                let (low, high) = ground_bounds(ground)?;
                Some([low.x, low.z, high.x, high.z])
            }
            Source::Given { .. } => None,
        }
    }

    /// Maximum height of the snow (m), if known before it is made; with a depth, also of the snow on static objects.
    pub fn top(&self) -> Option<f64> {
        let highest = |mesh: &TriMesh| mesh.bounds().map(|(_, high)| f64::from(high.y));
        match (&self.source, &self.snow.layer) {
            (Source::Made { cover: Cover::Top(top), .. }, _) => highest(top),
            (Source::Made { ground, .. }, Layer::Depth(depth)) => {
                let (_, ground) = ground_bounds(ground)?;
                let statics = self.statics.iter().filter_map(highest).fold(f64::NEG_INFINITY, f64::max);
                Some(ground.y.max(statics) + depth)
            }
            _ => None,
        }
    }

    /// Minimum and maximum corner of the snow's ground, top and static objects (m); for a given layer, of its active voxels.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (ground, top) = match &self.source {
            Source::Given { grid, .. } => {
                let (low, high) = grid.active_bbox()?;
                let corner = |voxel: [i32; 3]| DVec3::from(voxel.map(f64::from)) * grid.voxel_size();
                return Some((corner(low), corner(high)));
            }
            Source::Made { ground, cover } => {
                (ground, if let Cover::Top(top) = cover { mesh_bounds(top) } else { None })
            }
        };
        let all = self.statics.iter().map(mesh_bounds).chain([top]).flatten();
        let (low, mut high) =
            all.fold(ground_bounds(ground)?, |(low, high), (l, h)| (low.inf(&l), high.sup(&h)));
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
            let what = format!("object {} ({}), static, reaches", index + 1, schema::file_name(&object.file));
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
            Source::Given { ground: Some(GroundBelow::Level(height)), .. } => Some(*height),
            _ => None,
        }
    }

    /// The ground, if it is a mesh.
    pub(super) fn ground(&self) -> Option<&TriMesh> {
        self.source.mesh("snow.ground")
    }

    /// The static objects, on which the snow lies.
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
    /// The mesh of a key: `snow.ground` or `snow.top`.
    fn mesh(&self, key: &str) -> Option<&TriMesh> {
        match (key, self) {
            ("snow.ground", Self::Made { ground: initial::Ground::Mesh(mesh), .. })
            | ("snow.ground", Self::Given { ground: Some(GroundBelow::Mesh(mesh)), .. })
            | ("snow.top", Self::Made { cover: Cover::Top(mesh), .. }) => Some(mesh),
            _ => None,
        }
    }
}

/// Minimum and maximum corner of a mesh (m).
fn mesh_bounds(mesh: &TriMesh) -> Option<(DVec3, DVec3)> {
    mesh.bounds().map(|(low, high)| (low.cast(), high.cast()))
}

/// Minimum and maximum corner of the snow's ground (m).
fn ground_bounds(ground: &initial::Ground) -> Option<(DVec3, DVec3)> {
    match ground {
        initial::Ground::Plane { height, area: [x0, z0, x1, z1] } => {
            Some((DVec3::new(*x0, *height, *z0), DVec3::new(*x1, *height, *z1)))
        }
        initial::Ground::Mesh(mesh) => mesh_bounds(mesh),
    }
}

fn object_name(index: usize, object: &Object) -> String {
    format!("object {} ({})", index + 1, schema::file_name(&object.file))
}

/// A mesh with its closed parts turned outward; adds warnings about what remains ambiguous.
fn oriented(mesh: TriMesh, name: &str, warnings: &mut Vec<String>) -> TriMesh {
    let orientation = Orientation::of_mesh(&mesh, Closing::Caps);
    warnings.extend(orientation.warning().map(|what| format!("{name}: {what}")));
    orientation.applied_to(mesh)
}

fn read_mesh(
    path: &Path,
    snow: &Snow,
    input_hashes: &InputHashes,
    warnings: &mut Vec<String>,
) -> Result<TriMesh> {
    let mesh = mesh::parse_polygons_from(path, &input_hashes.read(path)?, snow.origin)?;
    // Unused vertices are not part of the snow.
    Ok(oriented(mesh.into_triangles().without_unused(), &path.display().to_string(), warnings))
}

fn ground(snow: &Snow, input_hashes: &InputHashes, warnings: &mut Vec<String>) -> Result<initial::Ground> {
    match &snow.ground {
        Some(Ground::Plane { height, area: Some(area) }) => {
            Ok(initial::Ground::Plane { height: *height, area: *area })
        }
        Some(Ground::Mesh(path)) => Ok(initial::Ground::Mesh(read_mesh(path, snow, input_hashes, warnings)?)),
        _ => Err(Error::argument("the snow has no ground")),
    }
}

/// The ground below a given layer.
fn ground_below(
    snow: &Snow,
    input_hashes: &InputHashes,
    warnings: &mut Vec<String>,
) -> Result<Option<GroundBelow>> {
    Ok(match &snow.ground {
        None => None,
        Some(Ground::Plane { height, .. }) => Some(GroundBelow::Level(*height)),
        Some(Ground::Mesh(path)) => Some(GroundBelow::Mesh(read_mesh(path, snow, input_hashes, warnings)?)),
    })
}

/// The warning about vertices of a mesh that may or may not be the same corner, as they differ by rounding errors only.
fn ambiguous_corners(path: &Path, mesh: &TriMesh) -> Option<String> {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
    let what = Weld::of(&positions, &mesh.triangles).warning();
    what.map(|what| format!("{}: {what}", path.display()))
}

fn layer_grid(path: &Path, cell: f64, input_hashes: &InputHashes) -> Result<FloatGrid> {
    let grid = input_hashes.read_with(path, || file::read_named(path, None))?;
    if grid.class() != GridClass::LevelSet {
        return Err(Error::file(path, format!("grid \"{}\" is not a level set", grid.name())));
    }
    let own_cell = grid.voxel_size();
    if (own_cell - cell).abs() > 1e-6 * cell {
        return Err(Error::file(
            path,
            format!("the layer has cells of {own_cell} m, but `cell` is {cell} m"),
        ));
    }
    if let Some(what) = distances::warning(&grid)? {
        return Err(Error::file(path, format!("grid \"{}\" {what}", grid.name())));
    }
    if f64::from(grid.background()) < 2.999 * own_cell {
        return Err(Error::file(path, "the layer's narrow band is less than 3 cells wide"));
    }
    Ok(grid)
}

/// An object's motion: that of its file, shifted by its offset and converted to metres and Y up, with the keys on top.
pub(super) fn motion(
    scene: &Scene,
    object: &Object,
    input_hashes: &Arc<InputHashes>,
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
    let file_motion: Box<dyn Motion> = match Pattern::parse(&object.file) {
        None if is_gltf(&object.file) => Box::new(character(scene, object, input_hashes)?),
        None => {
            let polygons = mesh::parse_polygons_from(
                &object.file,
                &input_hashes.read(&object.file)?,
                object.space.origin,
            )?;
            Box::new(Rigid::of_polygons(polygons, Keys::default()))
        }
        Some(pattern) => {
            let first = (f64::from(scene.shot.frames.first) - object.offset).floor() as i32;
            let last = (f64::from(scene.shot.frames.last) - object.offset).ceil() as i32;
            let origin = object.space.origin;
            Box::new(MeshSequence::open_with_hashes(
                pattern,
                first,
                last,
                fps,
                object.offset,
                input_hashes.clone(),
                origin,
            )?)
        }
    };
    let mut pose = Vec::new();
    file_motion.pose(scene.shot.time(scene.shot.frames.first), &mut pose)?;
    // Meshes are read minus the origin.
    let space = if is_gltf(&object.file) { object.space } else { object.space.without_origin() };
    pose.iter_mut().for_each(|position| *position -= space.origin);
    let name = object.file.display().to_string();
    warnings.extend(too_far_warning(&name, farthest(pose.iter()), space.scale, scene.snow()?.cell, BY_KEY));
    if scene.output.objects_usd || scene.output.objects_ply {
        let missing = file_motion.drawn().uvs.map_or(0, |uvs| uvs.missing);
        warnings.extend((missing > 0).then(|| missing_uvs(&name, missing)));
    }
    Ok(Box::new(Placed::new(file_motion, space, keys)))
}

fn character(scene: &Scene, object: &Object, input_hashes: &InputHashes) -> Result<Character> {
    let play = Play {
        node: object.node.clone(),
        clip: object.clip.clone(),
        repeat: object.repeat,
        start: (f64::from(scene.shot.frames.first) + object.offset) / scene.shot.fps,
    };
    let character = Character::open(&object.file, play)?;
    input_hashes.record(&object.file, character.content().to_string())?;
    let [from, to] = [scene.shot.frames.first, scene.shot.frames.last].map(|frame| scene.shot.time(frame));
    if let Some(jump) = character.jump(from, to) {
        let metres = jump * object.space.scale;
        log::warn!(
            "{}: the clip does not end as it begins: each round starts with a jump of {metres:.3} m",
            object.file.display()
        );
    }
    Ok(character)
}

/// A motion's mesh at a time (s), with the vertices of a corner moved to one position, and a warning about ambiguous corners.
fn posed(motion: &dyn Motion, time: f64) -> Result<(TriMesh, Option<String>)> {
    let mut pose = Vec::new();
    motion.pose_as_read(time, &mut pose)?;
    // Vertices are matched before transforms, which add rounding errors.
    let weld = Weld::of(&pose, motion.triangles());
    motion.pose(time, &mut pose)?;
    weld.unify(&mut pose);
    let positions = pose.iter().map(|p| p.cast()).collect();
    Ok((TriMesh { positions, triangles: motion.triangles().to_vec() }, weld.warning()))
}
