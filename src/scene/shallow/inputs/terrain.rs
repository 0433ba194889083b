//! The terrain of a scene at a frame, from its file.

use std::path::Path;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::orientation::Orientation;
use crate::geometry::mesh::weld::Weld;
use crate::geometry::{DVec3, TriMesh};
#[cfg(feature = "vdb")]
use crate::io::files::hash;
#[cfg(feature = "cli")]
use crate::io::image;
use crate::io::mesh::{extension, parse_polygons_from};
use crate::io::records::input_hashes::InputHashes;
use crate::motion::Space;
use crate::scene::shallow::{ImagePlacement, Shallow};
use crate::shallow::columns::grid::{Grid, Heights};
use crate::shallow::terrain::facing::facing;
#[cfg(feature = "cli")]
use crate::shallow::terrain::height;
#[cfg(feature = "vdb")]
use crate::shallow::terrain::sampler;
use crate::shallow::terrain::{Solids, triangles};
#[cfg(feature = "vdb")]
use crate::vdb::{FloatGrid, GridClass, file};

/// The terrain that the liquid flows over (m).
pub(in crate::scene::shallow) enum Terrain {
    /// Triangles.
    Mesh(TriMesh),
    /// A greyscale image centred at the origin.
    #[cfg(feature = "cli")]
    Image(image::GreyImage, ImagePlacement),
    /// A level set.
    #[cfg(feature = "vdb")]
    Grid(FloatGrid),
}

impl Terrain {
    /// Reads the terrain of a frame.
    ///
    /// # Errors
    /// A file that cannot be read, has changed since it was read, or needs a feature that this build lacks.
    pub fn read(setup: &Shallow, frame: i32, input_hashes: &InputHashes) -> Result<Self> {
        let path = setup.terrain_at(frame);
        match (&*extension(&path), setup.image) {
            ("vdb", _) => of_vdb(&path, input_hashes),
            ("png", Some(placement)) => of_image(&path, placement, input_hashes),
            _ => Ok(Self::Mesh(read_mesh(&path, setup.space, input_hashes)?)),
        }
    }

    /// Turns the closed parts of a mesh outward; returns which triangles were flipped.
    pub fn turn_outward(&mut self) -> Orientation {
        match self {
            Self::Mesh(mesh) => {
                let orientation = facing(mesh);
                *mesh = orientation.applied_to(std::mem::take(mesh));
                orientation
            }
            #[cfg(any(feature = "cli", feature = "vdb"))]
            _ => Orientation::default(),
        }
    }

    /// Its minimum and maximum corner (m).
    pub fn bounds(&self) -> [DVec3; 2] {
        match self {
            Self::Mesh(mesh) => {
                let (low, high) = mesh.bounds().unwrap_or_default();
                [low.cast(), high.cast()]
            }
            #[cfg(feature = "cli")]
            Self::Image(image, placement) => {
                let [x, z] = placement.size.map(|length| 0.5 * length);
                let ends =
                    image.values.iter().fold([1.0f32, 0.0], |[low, high], v| [low.min(*v), high.max(*v)]);
                let height = |grey: f32| {
                    let [black, white] = placement.heights;
                    black + f64::from(grey) * (white - black)
                };
                [DVec3::new(-x, height(ends[0]), -z), DVec3::new(x, height(ends[1]), z)]
            }
            #[cfg(feature = "vdb")]
            Self::Grid(grid) => {
                // The active voxels extend beyond the surface by the width of the band.
                let (low, high) = grid.active_bbox().unwrap_or_default();
                let band = f64::from(grid.background()).abs();
                let corner = |at: [i32; 3]| grid.index_to_world(DVec3::from(at.map(f64::from)));
                let (low, high) = (corner(low), corner(high));
                let middle = 0.5 * (low + high);
                let half =
                    (0.5 * (high - low) - DVec3::repeat(band)).sup(&DVec3::repeat(0.5 * grid.voxel_size()));
                [middle - half, middle + half]
            }
        }
    }

    /// The solids of all cells.
    ///
    /// # Errors
    /// As in [`crate::shallow::terrain`]; cancel.
    #[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "OpenVDB's tools take it"))]
    pub fn solids(&self, ctx: &Context, grid: Grid, heights: Heights) -> Result<Solids> {
        match self {
            Self::Mesh(mesh) => triangles::solids(&mesh.positions, &mesh.triangles, grid, heights),
            #[cfg(feature = "cli")]
            Self::Image(image, placement) => {
                let [x, z] = placement.size;
                let image = height::Image {
                    greys: &image.values,
                    size: image.size,
                    corner: [-0.5 * x, -0.5 * z],
                    extent: placement.size,
                    levels: placement.heights,
                };
                height::of_image(&image, grid, heights)
            }
            #[cfg(feature = "vdb")]
            Self::Grid(level_set) => {
                let (voxel, between) = (level_set.voxel_size(), level_set.heights());
                sampler::solids(grid, heights, voxel, between, |positions, out| {
                    ctx.check()?;
                    level_set.sample_linear(ctx, positions, out)
                })
            }
        }
    }

    /// As triangles, for rendering: an image's pixels, or the surface of a level set.
    ///
    /// # Errors
    /// Cancel, or errors of OpenVDB.
    #[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "OpenVDB's tools take it"))]
    pub fn mesh(self, ctx: &Context) -> Result<TriMesh> {
        match self {
            Self::Mesh(mesh) => Ok(mesh),
            #[cfg(feature = "cli")]
            Self::Image(image, placement) => Ok(image_mesh(&image, placement)),
            #[cfg(feature = "vdb")]
            Self::Grid(grid) => crate::vdb::level_set::to_mesh(ctx, &grid, 0.0, 0.0),
        }
    }
}

/// A mesh (m, Y up), in which vertices that differ only by rounding ([`Weld`]) get the same position: otherwise a column between two
/// triangles that should share an edge would belong to neither.
///
/// # Errors
/// A file that cannot be read, or that has changed since it was read.
pub(in crate::scene::shallow) fn read_mesh(
    path: &Path,
    space: Space,
    input_hashes: &InputHashes,
) -> Result<TriMesh> {
    let mut mesh = parse_polygons_from(path, &input_hashes.read(path)?, space.origin)?.into_triangles();
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    let weld = Weld::of(&positions, &mesh.triangles);
    weld.unify(&mut mesh.positions);
    if let Some(what) = weld.warning() {
        log::warn!("{}: {what}", path.display());
    }
    if !space.keeps_vectors() {
        mesh.positions.iter_mut().for_each(|position| *position = space.vector(position.cast()).cast());
    }
    Ok(mesh)
}

#[cfg(feature = "cli")]
fn of_image(path: &Path, placement: ImagePlacement, input_hashes: &InputHashes) -> Result<Terrain> {
    Ok(Terrain::Image(image::parse(path, &input_hashes.read(path)?)?, placement))
}

#[cfg(not(feature = "cli"))]
fn of_image(path: &Path, _placement: ImagePlacement, _input_hashes: &InputHashes) -> Result<Terrain> {
    Err(Error::file(path, "needs the feature cli, which this frazil was built without"))
}

/// An image of heights as a mesh, with a vertex at the centre of each pixel.
#[cfg(feature = "cli")]
fn image_mesh(image: &image::GreyImage, placement: ImagePlacement) -> TriMesh {
    let [across, down] = image.size;
    let [black, white] = placement.heights;
    let at = |axis: usize, index: usize| {
        placement.size[axis] * ((index as f64 + 0.5) / image.size[axis] as f64 - 0.5)
    };
    let height = |index: usize| black + f64::from(image.values[index]) * (white - black);
    let point = |index: usize| {
        crate::geometry::Vec3::new(
            at(0, index % across) as f32,
            height(index) as f32,
            at(1, index / across) as f32,
        )
    };
    let (width, is_square) = (across as u32, |index: &u32| {
        (*index as usize) % across + 1 < across && (*index as usize) / across + 1 < down
    });
    let square = |index: u32| {
        let [a, b, c, d] = [index, index + width, index + width + 1, index + 1];
        [[a, b, c], [a, c, d]]
    };
    let count = across * down;
    let triangles = (0..count as u32).filter(is_square).flat_map(square).collect();
    TriMesh { positions: (0..count).map(point).collect(), triangles }
}

#[cfg(feature = "vdb")]
fn of_vdb(path: &Path, input_hashes: &InputHashes) -> Result<Terrain> {
    // OpenVDB reads the file itself: its content must be the same before and after.
    input_hashes.hash(path)?;
    let grid = file::read_named(path, None)?;
    input_hashes.record(path, hash::of_file(path)?)?;
    if grid.class() != GridClass::LevelSet {
        return Err(Error::file(path, format!("grid \"{}\" is not a level set", grid.name())));
    }
    if !grid.is_uniform() || grid.active_bbox().is_none() {
        let what = if grid.is_uniform() { "is empty" } else { "has voxels that are not cubes" };
        return Err(Error::file(path, format!("grid \"{}\" {what}", grid.name())));
    }
    Ok(Terrain::Grid(grid))
}

#[cfg(not(feature = "vdb"))]
fn of_vdb(path: &Path, _input_hashes: &InputHashes) -> Result<Terrain> {
    Err(Error::file(path, "needs OpenVDB, which this frazil was built without"))
}
