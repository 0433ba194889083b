//! The gate of the distance rule: what it changes of the snow that a walk leaves, over what another seed changes.

use std::collections::BTreeMap;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::vdb::{file, points};

use crate::harness::Harness;
use crate::process::{json, works};
use crate::scenes::{MAN, context, wanted_data};
use crate::snow::grains::passes::{pass, walk};
use crate::snow::grains::rest::moving;

/// Frames and cell (m) of the walk: coarse, to be quick.
const WALK: (i32, f64) = (48, 0.012);
/// Frames whose time counts: those in which the walker has left snow behind.
const LATE: std::ops::RangeInclusive<i32> = 25..=WALK.0;
/// The distance (m).
const DISTANCE: f64 = 0.15;
const SEEDS: [i32; 2] = [0, 1];
/// Highest snow (m).
const TOP: f64 = 0.6;

/// The top of the grains (m) over squares of the ground.
type Tops = BTreeMap<[i32; 2], f64>;

pub fn run(h: &mut Harness) {
    let name = "snow.grains.distance_rule";
    let Some(man) = wanted_data(h, &[name], MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (frames, cell) = WALK;
    let scene = walk(folder.path(), &man, frames, cell, "");
    let out = folder.path().join("out");
    works(pass(&scene, &out, 2).args(["--stage", "base"]));
    let square = 4.0 * cell / 3.0;
    // The same base for all; the top of the grains, the seconds that they took, and the share that rests.
    let grains = |seed: i32, rule: &[&str]| {
        let mut run = pass(&scene, &out, 2);
        works(
            run.args(["--stage", "grains", "--from", "1", "--set", &format!("grains.seed={seed}")])
                .args(rule),
        );
        let reports = || LATE.map(|frame| out.join(format!("report/grains.{frame:04}.json")));
        let seconds: f64 = reports().map(|report| moving(&report)).sum();
        let shares = reports().map(|report| resting(&report)).sum::<f64>() / LATE.count() as f64;
        (tops(&out.join(format!("grains/grains.{frames:04}.vdb")), square), [seconds, shares])
    };
    let set = format!("grains.active_distance={DISTANCE}");
    let all = SEEDS.map(|seed| grains(seed, &[]));
    let ruled = SEEDS.map(|seed| grains(seed, &["--set", &set]));
    let base = file::read_named(&out.join(format!("base/base.{frames:04}.vdb")), Some("surface"));
    let base = base.expect("the base");
    let ground = |squares: &[[i32; 2]]| ground(&base, squares, square);
    let changed: Vec<f64> = (0..SEEDS.len()).map(|at| apart(&all[at].0, &ruled[at].0, ground)).collect();
    let changed = changed.iter().sum::<f64>() / changed.len() as f64;
    let by_seed = apart(&all[0].0, &all[1].0, ground);
    let mean = |runs: &[(Tops, [f64; 2])], which: usize| {
        runs.iter().map(|(_, numbers)| numbers[which]).sum::<f64>() / runs.len() as f64
    };
    let diameter = 0.5 * square;
    // A rule that does nothing would change nothing: how many rest shows that it does something.
    let note = format!(
        "p99 {:.2} d, {:.2} d between seeds; threads=2 frames {} to {frames}: {:.2} x as fast, {:.1} % rest, {:.1} % without",
        changed / diameter,
        by_seed / diameter,
        LATE.start(),
        mean(&all, 0) / mean(&ruled, 0),
        100.0 * mean(&ruled, 1),
        100.0 * mean(&all, 1),
    );
    h.gate(name, changed / by_seed, &note);
}

/// Share of the grains that rest, of a report.
fn resting(report: &Path) -> f64 {
    let report = json(report);
    let count = |name: &str| report[name].as_f64().expect("a number");
    count("resting") / count("grains")
}

/// The tops of the grains of a file over squares of an edge (m).
fn tops(file: &Path, edge: f64) -> Tops {
    let grains = points::read(file, None).expect("grains");
    let mut tops = Tops::new();
    for position in (0..grains.count()).map(|index| grains.position(index)) {
        let at = [position.x, position.z].map(|x| (x / edge).floor() as i32);
        let top = tops.entry(at).or_insert(f64::MIN);
        *top = top.max(position.y + 0.25 * edge);
    }
    tops
}

/// The height of a level set (m) in the middle of squares of an edge (m).
fn ground(base: &frazil::vdb::FloatGrid, squares: &[[i32; 2]], edge: f64) -> Vec<f64> {
    let step = 0.5 * base.voxel_size();
    let levels = (TOP / step).ceil() as usize;
    let position = |[x, z]: &[i32; 2], level: usize| {
        DVec3::new((f64::from(*x) + 0.5) * edge, TOP - level as f64 * step, (f64::from(*z) + 0.5) * edge)
    };
    let positions: Vec<DVec3> =
        squares.iter().flat_map(|square| (0..levels).map(move |level| position(square, level))).collect();
    let mut distances = Vec::new();
    base.sample_linear(&context(2), &positions, &mut distances).expect("distances");
    let first = |column: &[f32]| column.iter().position(|distance| *distance <= 0.0);
    let height = |column| first(column).map_or(0.0, |level| TOP - level as f64 * step);
    distances.chunks(levels).map(height).collect()
}

/// The 99th percentile of the difference (m) of two height fields, where one of them has grains.
fn apart(a: &Tops, b: &Tops, ground: impl Fn(&[[i32; 2]]) -> Vec<f64>) -> f64 {
    let mut squares: Vec<[i32; 2]> = a.keys().chain(b.keys()).copied().collect();
    squares.sort_unstable();
    squares.dedup();
    let heights = squares.iter().zip(ground(&squares)).map(|(square, ground)| {
        let height = |tops: &Tops| tops.get(square).map_or(ground, |top| top.max(ground));
        (height(a) - height(b)).abs()
    });
    let mut heights: Vec<f64> = heights.collect();
    heights.sort_by(f64::total_cmp);
    heights[heights.len() * 99 / 100]
}
