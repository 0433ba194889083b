//! Loads and checks every input of a scene before its first frame.

use super::{Ground, Key, Layer, Object, Role, Scene, Up};
use crate::base::{DVec3, TriMesh, Vec3};
use crate::error::{Error, Result};
use crate::io;
use crate::io::sequence::Sequence;
use crate::motion::{self, Motion};
use crate::vdb::{self, FloatGrid, GridClass};
use std::path::Path;

/// What a scene's files hold, checked.
pub struct Inputs {
    /// The ground's mesh, if it is one.
    pub ground: Option<TriMesh>,
    /// The mesh of the top surface, if the layer is given so.
    pub top: Option<TriMesh>,
    /// The layer's level set, if it is given so.
    pub layer: Option<FloatGrid>,
    /// Static objects.
    pub statics: Vec<TriMesh>,
    /// What moves through the snow, with the object's wish for noise.
    pub bodies: Vec<Body>,
}

/// One thing that moves through the snow.
pub struct Body {
    /// Its motion (s, m).
    pub motion: Box<dyn Motion>,
    /// Whether its cuts have ragged edges.
    pub noise: bool,
    /// Its mesh at the first frame, for estimates.
    pub first: TriMesh,
}

impl Inputs {
    /// Reads the meshes and grids of a scene; of sequences the first frame, and finds all others.
    ///
    /// # Errors
    /// The first file that is missing, unreadable or unusable.
    pub fn load(scene: &Scene) -> Result<Self> {
        let mut inputs = Self { ground: None, top: None, layer: None, statics: Vec::new(), bodies: Vec::new() };
        if let Some(Ground::Mesh(path)) = &scene.snow.ground {
            inputs.ground = Some(read_mesh(path)?);
        }
        match &scene.snow.layer {
            Layer::Depth(_) => {}
            Layer::Top(path) => inputs.top = Some(read_mesh(path)?),
            Layer::Grid(path) => inputs.layer = Some(read_layer(path, scene.snow.cell)?),
        }
        for object in &scene.objects {
            match object.role {
                Role::Collide => inputs.bodies.push(body(object, scene)?),
                Role::Static => inputs.statics.push(static_mesh(object, scene)?),
                Role::Ignore => {}
            }
        }
        inputs.check_reach(scene)?;
        Ok(inputs)
    }

    /// The meshes of static objects and of bodies at the first frame.
    pub fn meshes(&self) -> impl Iterator<Item = &TriMesh> {
        self.statics.iter().chain(self.bodies.iter().map(|body| &body.first))
    }

    /// Voxel coordinates are 32-bit: refuses what lies too far away for the cell.
    fn check_reach(&self, scene: &Scene) -> Result<()> {
        let meshes = self.meshes().chain(&self.ground).chain(&self.top);
        let farthest = meshes.flat_map(|mesh| &mesh.positions).fold(0.0, |far: f32, at| far.max(at.amax()));
        if f64::from(farthest) / scene.snow.cell < 1.0e9 {
            return Ok(());
        }
        let file = scene.path.display();
        let what = format!("{file}: a mesh reaches {farthest} m from the origin, too far for `cell` in [snow]");
        Err(Error::argument(what))
    }
}

/// Reads a mesh and refuses one that no computation can use: empty, NaN, wrong indices.
fn read_mesh(path: &Path) -> Result<TriMesh> {
    let mesh = io::mesh::read(path)?;
    mesh.validate().map_err(|what| Error::file(path, what.to_string()))?;
    Ok(mesh)
}

/// Reads the level set that is the layer.
fn read_layer(path: &Path, cell: f64) -> Result<FloatGrid> {
    let mut grids = vdb::file::read(path)?;
    let at = match grids.iter().position(|grid| grid.name() == "surface") {
        Some(at) => at,
        None if grids.len() == 1 => 0,
        None => return Err(Error::file(path, "holds no float grid named surface")),
    };
    let grid = grids.swap_remove(at);
    let name = grid.name();
    if grid.class() != GridClass::LevelSet {
        return Err(Error::file(path, format!("the grid {name} is no level set")));
    }
    if !grid.is_uniform() || (grid.voxel_size() / cell - 1.0).abs() > 1.0e-6 {
        let what = format!("the grid {name} has voxels of {} m, not {cell} m as `cell`", grid.voxel_size());
        return Err(Error::file(path, what));
    }
    if f64::from(grid.background()) < 2.99 * cell {
        return Err(Error::file(path, format!("the grid {name} has a band of less than 3 voxels on a side")));
    }
    Ok(grid)
}

/// Whether an object's file is the pattern of a sequence.
fn is_pattern(object: &Object) -> bool {
    Sequence::is_pattern(&object.file.to_string_lossy())
}

fn static_mesh(object: &Object, scene: &Scene) -> Result<TriMesh> {
    let body = body(object, scene)?;
    Ok(body.first)
}

fn body(object: &Object, scene: &Scene) -> Result<Body> {
    let motion = object_motion(object, scene)?;
    let mut first = Vec::new();
    motion.pose(f64::from(scene.shot.frames.first) / scene.shot.fps, &mut first)?;
    let positions = first.iter().map(|at| at.cast()).collect();
    let first = TriMesh { positions, triangles: motion.triangles().to_vec() };
    Ok(Body { motion, noise: object.noise, first })
}

fn object_motion(object: &Object, scene: &Scene) -> Result<Box<dyn Motion>> {
    let fps = scene.shot.fps;
    let keys = object.keys.iter().map(|key| motion_key(key, fps)).collect::<Vec<_>>();
    if is_pattern(object) {
        let moving = sequence(object, scene)?;
        return Ok(match keys.is_empty() {
            true => moving,
            false => Box::new(motion::Placed::new(moving, keys)?),
        });
    }
    let mut mesh = read_mesh(&object.file)?;
    for position in &mut mesh.positions {
        *position = converted(position.cast(), object).cast();
    }
    Ok(match keys.is_empty() {
        true => Box::new(motion::Static::new(mesh)),
        false => Box::new(motion::Rigid::new(mesh, keys)?),
    })
}
