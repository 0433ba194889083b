//! Points in files, for `frazil info` and `frazil convert`.

use std::path::Path;

use frazil::geometry::points::Values;
use frazil::geometry::{DVec3, Points};
use frazil::io::files::atomic;
use frazil::io::files::sequence::Pattern;
use frazil::io::mesh::extension;
use frazil::io::particles::{self, ParticleData};
use frazil::io::usd::{Format, points};
use frazil::motion::Space;
use frazil::scene::FrameChoice;
use frazil::{Error, Result};
use serde_json::{Map, Value, json};

use super::frame_results::FrameResults;
use super::options::{frame_path, needs_frames, one_frame, refuse_one_file};
use super::output;
use super::session::{Failure, OrFailure, Session};

/// The description of points in `frazil info`, without the name of their grid.
pub fn description(points: &Points) -> Map<String, Value> {
    let mut out = Map::new();
    out.insert("points".into(), json!(points.count()));
    out.insert("voxel_m".into(), json!(points.voxel_size));
    let bounds = points.bounds().map(|(low, high)| (<[f64; 3]>::from(low), <[f64; 3]>::from(high)));
    out.insert("bounds_m".into(), json!(bounds));
    for attribute in &points.attributes {
        let mut entry =
            json!({ "type": attribute.values.type_name(), "uniform": attribute.values.is_uniform() });
        if let Some((low, high)) = attribute.values.range() {
            let is_whole = !matches!(attribute.values, Values::Float(_) | Values::Vector(_));
            let plain = |numbers: Vec<f64>| match numbers[..] {
                [number] if is_whole => json!(number as i64),
                [number] => json!(number),
                _ => json!(numbers),
            };
            (entry["min"], entry["max"]) = (plain(low), plain(high));
        }
        out.insert(format!("attribute {}", attribute.name), entry);
    }
    out
}

/// Describes the points of a file other than .vdb for `frazil info`.
pub fn info(path: &Path, origin: DVec3) -> Result<Vec<Value>> {
    let mut data = particles::read(path)?;
    Space { origin, ..Space::OWN }.convert(&mut data);
    // Any size of voxels will do if the file gives none.
    let size = data.voxel_size.unwrap_or(1.0);
    let has_size = data.voxel_size.is_some();
    let points = data.into_points(Some(size)).map_err(|error| Error::file(path, error.to_string()))?;
    let mut entry = Map::from_iter([("type".to_string(), json!("points"))]);
    entry.extend(description(&points));
    if !has_size {
        entry.remove("voxel_m");
    }
    Ok(vec![Value::Object(entry)])
}

/// Whether a file's extension is one of point files; .ply and USD do not count, as they may hold a mesh.
pub fn is_point_file(path: &Path) -> bool {
    let is_particles = particles::has_extension_of_particles(path) && !particles::may_hold_mesh(path);
    extension(path) == "vdb" || is_particles
}

/// Whether `frazil convert` converts points: a file of points in or out, or a .ply or USD file without faces.
pub fn converts_points(input: &Path, output: &Path, frames: Option<&FrameChoice>) -> Result<bool> {
    if [input, output].into_iter().any(is_point_file) {
        return Ok(true);
    }
    let may_be_points =
        |path: &Path| particles::may_hold_mesh(path) || Format::of(&extension(path)).is_some();
    if !particles::may_hold_mesh(input) || !may_be_points(output) {
        return Ok(false);
    }
    let first = match (Pattern::parse(input), frames) {
        // The first existing frame decides.
        (Some(pattern), Some(frames)) => {
            frames.iter().map(|frame| pattern.path(frame)).find(|path| path.is_file())
        }
        _ => Some(input.to_path_buf()).filter(|path| path.is_file()),
    };
    first.map_or(Ok(false), |first| particles::holds_points(&first))
}

/// Points of a file, and whether their voxels have a size from the file or the user, rather than an arbitrary one.
struct LoadedPoints {
    points: Points,
    has_voxels: bool,
}

/// Conversion of points by `frazil convert`.
pub struct Conversion<'a> {
    /// File or pattern.
    pub input: &'a Path,
    /// File or pattern.
    pub output: &'a Path,
    /// Frames of patterns.
    pub frames: Option<&'a FrameChoice>,
    /// Frames per second.
    pub fps: f64,
    /// Edge of a voxel (m).
    pub voxel: Option<f64>,
    /// Conversion of the input's space to metres with Y up.
    pub space: Space,
}

impl Conversion<'_> {
    /// Converts every frame.
    pub fn run(&self, session: &Session) -> std::result::Result<(), Failure> {
        let is_sequence = Pattern::parse(self.input).is_some();
        let is_written = extension(self.output) == "vdb" || Format::of(&extension(self.output)).is_some();
        if !is_written && !particles::can_write(self.output) {
            let what = "the output for points must be a .vdb, .ply, .usda, .usdc, .bgeo or .xyz file";
            return Err(Failure::of_file(self.output, what));
        }
        if extension(self.input) != "vdb" && !particles::has_extension_of_particles(self.input) {
            let what = "points are read from .vdb, .bgeo, .vtk, .vtu, .xyz, .ply and .usdc files";
            return Err(Failure::of_file(self.input, what));
        }
        if is_sequence && self.frames.is_none() {
            return Err(needs_frames(self.input));
        }
        if !is_sequence && self.frames.is_some_and(|frames| frames.count() > 1) {
            return Err(Failure::refused("several --frames cannot be used with a single file of points"));
        }
        let frames = self.frames.cloned().unwrap_or_else(one_frame);
        refuse_one_file(self.output, &frames, "grains.%04d.ply")?;
        output::check_writable(self.output).or_refuse()?;
        for frame in frames.iter() {
            let from = frame_path(self.input, frame);
            output::refuse_input(&frame_path(self.output, frame), [from.as_path()]).or_refuse()?;
        }
        let mut count = 0;
        let convert = |frame| {
            let loaded = self.read(&frame_path(self.input, frame))?;
            self.write(&frame_path(self.output, frame), frame, &loaded, session)?;
            Ok(loaded.points.count())
        };
        let results = FrameResults::run(session, &frames, convert, |points| count += points)?;
        session.record("points", json!(count));
        results.finish()
    }

    fn read(&self, path: &Path) -> Result<LoadedPoints> {
        let mut data = match extension(path).as_str() {
            "vdb" => {
                let points = points_of_vdb(path)?;
                if self.space == Space::OWN && self.voxel.is_none() {
                    // These are kept bit by bit, unlike points that are regrouped into voxels.
                    return Ok(LoadedPoints { points, has_voxels: true });
                }
                ParticleData::from(points)
            }
            _ => particles::read(path)?,
        };
        self.space.convert(&mut data);
        let voxel = self.voxel.or(data.voxel_size);
        // Only .vdb files need voxels.
        let default = (extension(self.output) != "vdb").then_some(1.0);
        if voxel.or(default).is_none() {
            let what = "does not say how large the voxels of its points are: give --voxel";
            return Err(Error::file(path, what));
        }
        let points =
            data.into_points(voxel.or(default)).map_err(|error| Error::file(path, error.to_string()))?;
        Ok(LoadedPoints { points, has_voxels: voxel.is_some() })
    }

    #[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "grids are made by threads"))]
    fn write(&self, path: &Path, frame: i32, loaded: &LoadedPoints, session: &Session) -> Result<()> {
        let LoadedPoints { points, has_voxels } = loaded;
        match extension(path).as_str() {
            #[cfg(feature = "vdb")]
            "vdb" => {
                use frazil::vdb::{file::WriteOptions, points};
                points::write(&session.ctx, path, NAME, points, &WriteOptions::default())
            }
            #[cfg(not(feature = "vdb"))]
            "vdb" => super::needs_openvdb(path),
            usd if Format::of(usd).is_some() => {
                let format = Format::of(usd).unwrap_or(Format::Text);
                let stem = self.input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let name = stem.split(['%', '#', '$', '.']).next().unwrap_or_default();
                atomic::write_bytes(path, &points::frame(name, frame, self.fps, points).bytes(format)?)
            }
            _ => particles::write(path, points, *has_voxels),
        }
    }
}

/// Name of the grid of points in the files we write.
#[cfg(feature = "vdb")]
const NAME: &str = "grains";

/// Points of a .vdb file.
///
/// # Errors
/// A file that holds only changes since another frame.
#[cfg(feature = "vdb")]
pub fn points_of_vdb(path: &Path) -> Result<Points> {
    use frazil::vdb::changes::{changes_since, partial};
    match changes_since(path)? {
        Some(since) => Err(Error::file(path, partial(since))),
        None => frazil::vdb::points::read(path, None),
    }
}

#[cfg(not(feature = "vdb"))]
fn points_of_vdb(path: &Path) -> Result<Points> {
    super::needs_openvdb(path)
}
