//! Initial grains: points of a file.

use std::path::Path;

use rayon::prelude::*;

use super::grain_params::params;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::points::Values;
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh};
use crate::io::mesh::extension;
use crate::io::particles;
use crate::io::records::input_hashes::InputHashes;
use crate::scene::Scene;
use crate::scene::schema::rounded;
use crate::snow::grains::{Grains, MAX_SPEED, Params};
use crate::vdb::changes::{changes_since, partial};
use crate::vdb::{FloatGrid, points};

/// Number of points that are tested together.
const BATCH: usize = 4096;
/// Points deeper than this (diameters) in the snow or below the ground do not become grains.
const MAX_DEPTH: f64 = 0.1;
/// Relative difference of a file's `pscale` from the grains' radius above which it is reported.
const SIZE_TOLERANCE: f64 = 0.01;

/// Grains read from a file.
pub struct InitialGrains {
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Velocities (m/s), from the attribute `v`; empty if there is none.
    pub velocities: Vec<[f32; 3]>,
}

/// The file of a scene's initial grains.
pub fn file(scene: &Scene) -> Option<&Path> {
    scene.values.table("grains").value("initial")?.path()
}

impl InitialGrains {
    /// The initial grains of a scene with cells of this size (m); adds warnings about data of the file that is not used.
    ///
    /// # Errors
    /// A file that is missing, truncated or damaged; a `v` that is not a vector; positions or velocities out of range for grains.
    pub fn of(
        scene: &Scene,
        cell: f64,
        input_hashes: &InputHashes,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Self>> {
        let Some(path) = file(scene) else { return Ok(None) };
        input_hashes.hash(path)?;
        let (positions, attributes) = if extension(path) != "vdb" {
            let data = particles::read(path)?;
            (data.positions, data.attributes)
        } else {
            if let Some(since) = changes_since(path)? {
                return Err(Error::file(path, partial(since)));
            }
            let points = points::read(path, None)?;
            ((0..points.count()).map(|index| points.position(index)).collect(), points.attributes)
        };
        let values = |name: &str| {
            let attribute = attributes.iter().find(|attribute| attribute.name == name);
            attribute.map(|attribute| &attribute.values)
        };
        let velocities = match values("v") {
            Some(Values::Vector(column)) => (0..positions.len()).map(|index| column.get(index)).collect(),
            Some(_) => return Err(Error::file(path, "has an attribute v that is not a vector")),
            None => Vec::new(),
        };
        let params = params(scene, cell);
        if let (Some(Values::Float(own)), false) = (values("pscale"), positions.is_empty()) {
            warnings.extend(size_warning(path, own.stored(), params.radius));
        }
        let initial = Self { positions, velocities };
        initial.check(params).map_err(|what| Error::file(path, what))?;
        Ok(Some(initial))
    }

    /// Positions (m) and velocities (m/s) of the grains that are neither in a layer nor below the ground, which is a mesh or a floor at a
    /// height (m); `radius` is that of a grain (m).
    ///
    /// # Errors
    /// Errors of the grid; cancel.
    pub fn outside(
        &self,
        ctx: &Context,
        (ground, floor): (Option<&TriMesh>, Option<f64>),
        layer: &FloatGrid,
        radius: f64,
    ) -> Result<(Vec<DVec3>, Vec<[f32; 3]>)> {
        let max_depth = MAX_DEPTH * 2.0 * radius;
        let mut distances = Vec::new();
        layer.sample_linear(ctx, &self.positions, &mut distances)?;
        let ground = ground.map(|mesh| (mesh, Bvh::new(mesh)));
        let is_below = |position: &DVec3| {
            floor.is_some_and(|floor| position.y < floor - max_depth)
                || ground.as_ref().is_some_and(|(mesh, tree)| is_below(mesh, tree, *position, max_depth))
        };
        let is_outside =
            |point: &usize| f64::from(distances[*point]) >= -max_depth && !is_below(&self.positions[*point]);
        let outside: Vec<usize> = (0..self.positions.len()).into_par_iter().filter(is_outside).collect();
        let positions = outside.iter().map(|point| self.positions[*point]).collect();
        let velocities = outside.iter().filter_map(|point| self.velocities.get(*point).copied()).collect();
        Ok((positions, velocities))
    }

    /// Checks that every point can be a grain.
    fn check(&self, params: Params) -> std::result::Result<(), String> {
        let is_nan = |index: &usize| !self.positions[*index].iter().all(|x| x.is_finite());
        if let Some(point) = (0..self.positions.len()).find(is_nan) {
            return Err(format!("the position of point {} is not finite", point + 1));
        }
        for (point, velocity) in self.velocities.iter().enumerate() {
            if !velocity.iter().all(|x| x.is_finite()) {
                return Err(format!("the velocity of point {} is not finite", point + 1));
            }
            if velocity.iter().any(|x| x.abs() > MAX_SPEED) {
                return Err(format!(
                    "the velocity of point {} has a component over {MAX_SPEED} m/s",
                    point + 1
                ));
            }
        }
        // Their number is checked elsewhere.
        let params = Params { max_grains: usize::MAX, ..params };
        let emit = |positions: &[DVec3]| Grains::new(params)?.emit(positions, &[], 0);
        for (batch, positions) in self.positions.chunks(BATCH).enumerate() {
            let Err(error) = emit(positions) else { continue };
            return Err(match positions.iter().position(|position| emit(&[*position]).is_err()) {
                Some(point) => format!("point {} is too far from the origin", batch * BATCH + point + 1),
                None => error.to_string(),
            });
        }
        Ok(())
    }
}

/// Whether a position is more than `depth` (m) below a mesh: the next triangle above it faces up.
fn is_below(mesh: &TriMesh, tree: &Bvh, position: DVec3, depth: f64) -> bool {
    let Some(hit) = tree.ray(position, DVec3::y(), f64::INFINITY) else { return false };
    let [a, b, c] = mesh.triangles[hit.triangle].map(|vertex| mesh.positions[vertex as usize]);
    hit.distance > depth && (b - a).cross(&(c - a)).y > 0.0
}

/// The warning about points whose radius differs from that of the grains (m).
fn size_warning(path: &Path, own: &[f32], radius: f64) -> Option<String> {
    let differs = |own: &&f32| (f64::from(**own) - radius).abs() > SIZE_TOLERANCE * radius;
    own.iter().find(differs).map(|own| {
        format!(
            "{}: its pscale ({} m) is not used: all grains have grains.radius = {} m",
            path.display(),
            rounded((*own).into()),
            rounded(radius)
        )
    })
}
