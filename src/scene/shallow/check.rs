//! Checks every input of every frame of a scene with `[shallow]`, without simulating.

use std::collections::BTreeMap;

use serde::Serialize;

use super::estimate;
use super::inputs::area;
use super::stage::liquid_state::LiquidState;
use super::{Inputs, ML, SceneScalar, Shallow};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::scene::{Scene, Value};
use crate::shallow::Law;
use crate::shallow::columns::grid::TOP;
use crate::shallow::pipes::Border;
use crate::shallow::sources::Kind;

/// Fewer cells than this are probably a mistake.
const FEW: usize = 100;

/// Summary of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames per second.
    pub fps: f64,
    /// Name of the terrain's file at the first frame.
    pub terrain: String,
    /// Number of files of the terrain.
    pub files: usize,
    /// Triangles of the terrain, if it is a mesh.
    pub triangles: Option<usize>,
    /// Width, height and depth of the terrain at the first frame (m).
    pub size_m: [f64; 3],
    /// Edge of a cell (m).
    pub cell_m: f64,
    /// Count of cells along x and along z.
    pub cells: [usize; 2],
    /// Minimum and maximum x and z of the cells (m).
    pub area_m: [f64; 4],
    /// Columns that can hold liquid: in each cell one above each solid.
    pub columns: usize,
    /// Maximum columns in a cell.
    pub layers: usize,
    /// Cells without ground, through which liquid is lost.
    pub void_cells: usize,
    /// Minimum and maximum height of ground and liquid (m).
    pub heights_m: [f64; 2],
    /// Resolution of heights and depths (m).
    pub unit_m: f64,
    /// Kinematic viscosity (m2/s); for a thinning liquid, that at rest.
    pub viscosity_m2_per_s: f64,
    /// Liquid at the first frame (ml).
    pub begins_with_ml: f64,
    /// Liquid added later, from pours and sources, over the shot (ml).
    pub comes_ml: f64,
    /// Maximum depth at the first frame (m).
    pub deepest_m: f64,
    /// Whether liquid falls freely.
    pub falls: bool,
    /// Names of the scalars that it carries.
    pub scalars: Vec<String>,
    /// Bound of the run's memory (bytes), by which it is refused.
    pub memory_bytes: u64,
    /// Memory that the run is expected to take at its peak (bytes).
    pub memory_forecast_bytes: u64,
    /// Maximum size of the files (bytes): if all columns are wet.
    pub disk_bytes: u64,
    /// Maximum size of the files of a frame (bytes).
    pub frame_bytes: u64,
    /// Probable mistakes in the scene, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in.
    pub settings: BTreeMap<String, Value>,
}

impl Report {
    /// Fails if the run would need more memory than a limit (bytes).
    ///
    /// # Errors
    /// [`Error::Memory`] names the counts of cells and columns.
    pub fn check_memory(&self, limit: u64) -> Result<()> {
        let [across, along] = self.cells;
        Error::check_memory(self.memory_bytes, limit, || {
            format!("liquid on {across} x {along} cells, {} columns,", self.columns)
        })
    }
}

/// Checks a scene whose inputs are open.
///
/// # Errors
/// A file that cannot be read; a source inside solid, and anything else that a run would refuse; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs) -> Result<Report> {
    let (setup, frames) = (scene.shallow()?, scene.shot.frames);
    let state = LiquidState::begin(ctx, (scene, setup, inputs))?;
    let columns = state.liquid.columns();
    let (grid, heights) = (inputs.grid, inputs.heights);
    let [low, high] = inputs.bounds;
    let layers = (0..grid.cells()).map(|cell| inputs.solids.cell(cell).len());
    let void_cells = layers.clone().filter(|layers| *layers == 0).count();
    let begins_with = state.liquid.balance().inside;
    let deepest = state.liquid.depths().iter().copied().max().unwrap_or(0);
    let count = columns.count();
    let triangles = inputs.triangles.unwrap_or(0) as u64;
    let frame_bytes = estimate::frame_bytes(setup, count as u64, triangles);
    let mut warnings = inputs.warnings.clone();
    warnings.extend(probable_mistakes(setup, inputs, &state, void_cells));
    warnings.extend(warnings_of_later_frames(ctx, scene, state)?);
    let [memory_bytes, memory_forecast_bytes] = estimate::memory(setup, &grid, count as u64, triangles);
    Ok(Report {
        frames: [frames.first, frames.last],
        fps: scene.shot.fps,
        terrain: crate::scene::schema::file_name(&setup.terrain_at(frames.first)),
        files: if setup.sequence().is_some() { frames.count() } else { 1 },
        triangles: inputs.triangles,
        size_m: (high - low).into(),
        cell_m: grid.cell,
        cells: grid.size,
        area_m: area(&grid),
        columns: count,
        layers: layers.max().unwrap_or(0),
        void_cells,
        heights_m: [heights.low, heights.metres(TOP)],
        unit_m: heights.unit,
        viscosity_m2_per_s: setup.params.liquid.viscosity,
        begins_with_ml: begins_with / ML,
        comes_ml: added_volume(scene, setup) / ML,
        deepest_m: heights.length(deepest.into()),
        falls: setup.params.falls.is_some(),
        scalars: setup.scalars.iter().map(|carried| carried.scalar.name.clone()).collect(),
        memory_bytes,
        memory_forecast_bytes,
        disk_bytes: frames.count() as u64 * frame_bytes,
        frame_bytes,
        warnings,
        settings: scene.values.by_path(),
    })
}

/// Moves terrain, obstacles and points through all later frames; returns a sentence for each point that rests while it should be active.
fn warnings_of_later_frames(ctx: &Context, scene: &Scene, mut state: LiquidState<'_>) -> Result<Vec<String>> {
    // The first frame at which a point rests and the number of such frames, by the point's name.
    let mut resting: BTreeMap<String, (i32, usize)> = BTreeMap::new();
    for frame in scene.shot.frames.iter().skip(1) {
        ctx.check()?;
        state.advance_without_flow()?;
        for name in state.resting() {
            resting.entry(name).or_insert((frame, 0)).1 += 1;
        }
    }
    let warning = |(name, (first, count)): (String, (i32, usize))| {
        format!(
            "{name} lies inside solid or outside of the area, and rests, at {count} frames, the first of them {first}"
        )
    };
    Ok(resting.into_iter().map(warning).collect())
}

/// Liquid added after the first frame (m3).
fn added_volume(scene: &Scene, setup: &Shallow) -> f64 {
    let frames = scene.shot.frames;
    let later = |frame: i32| frame > frames.first && frame <= frames.last;
    let poured = setup.pours.iter().filter(|pour| pour.frame.is_some_and(later)).map(|pour| pour.volume);
    let sources = setup.points.iter().filter(|point| point.flow_point.kind == Kind::Source);
    let sourced = sources.map(|point| {
        let from = point.from.unwrap_or(frames.first).max(frames.first + 1);
        let to = point.until.unwrap_or(frames.last).min(frames.last);
        point.flow_point.rate * f64::from((to - from + 1).max(0)) / scene.shot.fps
    });
    // An empty sum is -0.
    poured.sum::<f64>() + sourced.sum::<f64>() + 0.0
}

/// A warning for each scalar that no liquid has.
fn unused_scalars(setup: &Shallow) -> impl Iterator<Item = String> {
    let is_unused = move |(index, carried): &(usize, &SceneScalar)| {
        let sources = setup.points.iter().filter(|point| point.flow_point.kind == Kind::Source);
        let pours = setup.pours.iter().map(|pour| &pour.carries);
        let mut added = sources.map(|point| &point.carries).chain(pours);
        carried.scalar.law != Law::Ages && carried.start == 0.0 && added.all(|carries| carries[*index] == 0.0)
    };
    setup.scalars.iter().enumerate().filter(is_unused).map(|(index, carried)| {
        let name = &carried.scalar.name;
        format!(
            "no liquid has any {name}: carries = {{ {name} = 1.0 }} of a [[pour]] or [[source]], or start of scalar.{}, gives it some",
            index + 1
        )
    })
}

/// Probable mistakes.
fn probable_mistakes(
    setup: &Shallow,
    inputs: &Inputs,
    state: &LiquidState<'_>,
    void_cells: usize,
) -> Vec<String> {
    let mut out = Vec::new();
    let (grid, heights) = (inputs.grid, inputs.heights);
    let share = void_cells as f64 / grid.cells() as f64;
    if share > 0.5 {
        out.push(format!(
            "{:.0} % of the cells have no ground: what gets there is lost (shallow.area takes a smaller part)",
            100.0 * share
        ));
    }
    let [x0, z0, x1, z1] = area(&grid);
    let [low, high] = inputs.bounds;
    if x1 < low.x || x0 > high.x || z1 < low.z || z0 > high.z {
        out.push("shallow.area lies beside the terrain".into());
    }
    if heights.unit > 1e-6 {
        out.push(format!(
            "depths are multiples of {:.2e} m, as heights go from {} to {} m: shallow.bottom and shallow.top make them finer",
            heights.unit,
            heights.low,
            heights.metres(TOP)
        ));
    }
    let depths = state.liquid.depths();
    let columns = state.liquid.columns();
    let is_border = |index: usize| {
        let [x, z] = columns.cell(index);
        x == 0 || z == 0 || x + 1 == grid.size[0] || z + 1 == grid.size[1]
    };
    let fills = setup.fill.is_some() && setup.params.border == Border::Open;
    if fills && columns.indices().any(|index| depths[index] > 0 && is_border(index)) {
        out.push(
            "the liquid of shallow.fill flows off at the border, which is open: \"closed\" or \"absorbing\" keep it".into(),
        );
    }
    out.extend(unused_scalars(setup));
    if setup.points.is_empty() && setup.pours.is_empty() && setup.fill.is_none() {
        out.push("there is no liquid: no [[pour]], no [[source]], no shallow.fill".into());
    }
    if grid.cells() < FEW {
        out.push(format!(
            "{} x {} cells are few: shallow.cell is {} m",
            grid.size[0], grid.size[1], grid.cell
        ));
    }
    out
}
