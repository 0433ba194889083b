//! Gates of shallow's surface: thread CPU time on one core, and edges between columns that are not linked.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::Shallow;
use frazil::shallow::columns::{Columns, NONE};
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::{Counts, Depths, Layout, Surface, check};

use crate::common::bodies::Dice;
use crate::common::shallow::{Turn, context, turnable};
use crate::harness::{Harness, median};
use crate::shallow::buffers::Buffers;
use crate::shallow::speed::{five_floors, on_floors, one_floor, stacked, thread_seconds, three_floors};

const FRAME: f64 = 1.0 / 60.0;
/// Surfaces that are timed, one after a frame.
const SURFACES: usize = 101;
/// Random scenes whose surfaces are looked at, and frames of each.
const SCENES: u64 = 400;
const FRAMES: usize = 12;

/// All of them.
pub fn run(h: &mut Harness) {
    type Make = fn() -> Shallow;
    let scenes: [(&str, Make, f64); 3] = [
        ("shallow.surface_one_floor", one_floor, 0.43),
        ("shallow.surface_five_floors", five_floors, 1.1),
        ("shallow.surface_three_floors", three_floors, 0.37),
    ];
    for (name, make, thesis) in scenes {
        h.measure(name, || {
            let (time, note) = timed(&mut make());
            (time, format!("{:?} thesis={thesis} ms on a GTX 970; {note}", cpu_level()))
        });
    }
    h.measure("shallow.surface_copy", || {
        let each = scenes.map(|(name, make, _)| {
            let [surface, copy] = copied(&mut make());
            let name = name.replace("shallow.surface_", "");
            (surface / copy, format!("{name}: {surface:.3} ms, copy {copy:.3} ms"))
        });
        let most = each.iter().map(|(ratio, _)| *ratio).fold(0.0, f64::max);
        (most, format!("{:?} {}", cpu_level(), each.map(|(_, note)| note).join("; ")))
    });
    h.measure_all(["shallow.surface_unlinked", "shallow.surface_cracks"], unlinked);
}

/// Median time of a surface that is drawn (ms) while the liquid flows, and what it and others cost.
fn timed(liquid: &mut Shallow) -> (f64, String) {
    let mut surface = Surface::default();
    surface.reserve(liquid.columns());
    let mut buffers = Buffers::new(liquid.columns(), &Ledges::default(), 0);
    let mut counts = Counts::default();
    let layout = Layout::default();
    let drawn = each_frame(liquid, |liquid| {
        let depths = Depths { depth: liquid.depths(), active: Some(liquid.active()), ..Depths::default() };
        let built = surface.build(liquid.columns(), &depths, &layout, &mut buffers.drawn());
        counts = built.expect("a surface");
    });
    let mut velocity = vec![[0.0; 2]; liquid.columns().len()];
    let all = each_frame(liquid, |liquid| {
        liquid.velocities(&mut velocity).expect("as many positions");
        let depths = Depths {
            depth: liquid.depths(),
            velocity: &velocity,
            active: Some(liquid.active()),
            ..Depths::default()
        };
        surface.build(liquid.columns(), &depths, &layout, &mut buffers.all()).expect("a surface");
    });
    let least = drawn.iter().copied().fold(f64::INFINITY, f64::min);
    let worst = drawn.iter().copied().fold(0.0, f64::max);
    let note = format!(
        "{} vertices, {} triangles; {least:.3} to {worst:.3} ms; {:.3} ms with the velocity, opacity, layer and column of each vertex",
        counts.vertices,
        counts.indices / 3,
        median(all)
    );
    (median(drawn), note)
}

/// Median times of a surface that is drawn, and of copying its bytes (ms): in turns, each after a frame.
fn copied(liquid: &mut Shallow) -> [f64; 2] {
    let mut surface = Surface::default();
    surface.reserve(liquid.columns());
    let [mut to, mut from] = [(); 2].map(|()| Buffers::new(liquid.columns(), &Ledges::default(), 0));
    // Memory that was never written is one page of zeros.
    for numbers in [&mut from.positions, &mut from.normals, &mut from.depths] {
        numbers.fill(1.0);
    }
    from.indices.fill(1);
    let layout = Layout::default();
    let mut counts = Counts::default();
    let mut is_copy = true;
    let times = each_frame(liquid, |liquid| {
        is_copy = !is_copy;
        if is_copy {
            let Counts { vertices, indices, .. } = counts;
            to.positions[..3 * vertices].copy_from_slice(&from.positions[..3 * vertices]);
            to.normals[..3 * vertices].copy_from_slice(&from.normals[..3 * vertices]);
            to.depths[..vertices].copy_from_slice(&from.depths[..vertices]);
            to.indices[..indices].copy_from_slice(&from.indices[..indices]);
            std::hint::black_box(&mut to);
            return;
        }
        let depths = Depths { depth: liquid.depths(), active: Some(liquid.active()), ..Depths::default() };
        counts = surface.build(liquid.columns(), &depths, &layout, &mut to.drawn()).expect("a surface");
    });
    // The first time is that of a copy.
    [1, 0].map(|first| median(times.iter().skip(first).step_by(2).copied().collect()))
}

/// Times of what is done after each frame (ms), but the first.
fn each_frame(liquid: &mut Shallow, mut work: impl FnMut(&Shallow)) -> Vec<f64> {
    let ctx = context();
    let mut time = || {
        liquid.step(&ctx, FRAME).expect("a frame");
        let start = thread_seconds();
        work(liquid);
        1e3 * (thread_seconds() - start)
    };
    time();
    (0..SURFACES).map(|_| time()).collect()
}

/// Pairs of wet columns side by side, and edges, that are not as the links say.
#[derive(Default)]
struct Pairs {
    /// Edges between wet columns.
    edges: usize,
    /// Such edges whose columns are not linked.
    false_edges: usize,
    /// Linked columns that share no edge.
    missing: usize,
    /// Linked columns that no third one is linked with.
    alone: usize,
    /// Edges between wet columns, within the domain, that have one triangle only: without skirts, and with them.
    open: usize,
    cracks: usize,
}

impl Pairs {
    /// Looks at the surface of a liquid.
    fn look(&mut self, surface: &mut Surface, columns: &Columns, depth: &[i32]) {
        let mut ledges = Ledges::default();
        ledges.find(columns);
        let mut buffers = Buffers::new(columns, &ledges, 0);
        let depths = Depths { depth, ledges: Some(&ledges), ..Depths::default() };
        let counts =
            surface.build(columns, &depths, &Layout::default(), &mut buffers.checked()).expect("a surface");
        let [open, doubled] = open_edges(columns, depth, &buffers, &counts);
        self.cracks += open + doubled;
        let depths = Depths { depth, ..Depths::default() };
        let counts =
            surface.build(columns, &depths, &Layout::default(), &mut buffers.checked()).expect("a surface");
        let [open, doubled_before] = open_edges(columns, depth, &buffers, &counts);
        self.open += open;
        // Where liquid parts into two layers, and nowhere else, edges are doubled.
        self.cracks -= doubled.min(doubled_before);
        let indices = &buffers.indices[..counts.indices];
        let checked = check(columns, depth, &buffers.columns[..counts.vertices], indices);
        self.missing += checked.unlinked;
        self.alone += checked.alone;
        // Each column's room holds the other's height.
        let holds = |i: usize, j: usize| {
            let height = columns.bases()[j] + depth[j];
            (columns.unders()[i]..columns.ceilings()[i]).contains(&height)
        };
        for [a, b, c] in
            indices.as_chunks::<3>().0.iter().map(|corners| corners.map(|at| buffers.columns[at as usize]))
        {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if a != NONE && b != NONE && depth[a as usize] > 0 && depth[b as usize] > 0 {
                    let (a, b) = (a as usize, b as usize);
                    self.edges += 1;
                    self.false_edges += usize::from(!holds(a, b) || !holds(b, a));
                }
            }
        }
    }
}

/// Count of edges between wet columns that have a triangle on one side only, but for those along the domain's border; and of those that have two on a
/// side.
fn open_edges(columns: &Columns, depth: &[i32], buffers: &Buffers, counts: &Counts) -> [usize; 2] {
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(counts.indices);
    for [a, b, c] in buffers.indices[..counts.indices].as_chunks::<3>().0 {
        edges.extend([[*a, *b], [*b, *c], [*c, *a]]);
    }
    edges.sort_unstable();
    let [nx, nz] = columns.grid.size;
    let is_wet = |vertex: u32| {
        let column = buffers.columns[vertex as usize];
        column != NONE && depth[column as usize] > 0
    };
    let is_twice = |two: &&[[u32; 2]]| two[0] == two[1] && two[0].into_iter().all(is_wet);
    let doubled = edges.windows(2).filter(is_twice).count();
    let is_open = |&&[a, b]: &&[u32; 2]| {
        if edges.binary_search(&[b, a]).is_ok() || !is_wet(a) || !is_wet(b) {
            return false;
        }
        let [[ax, az], [bx, bz]] =
            [a, b].map(|vertex| columns.cell(buffers.columns[vertex as usize] as usize));
        !(ax == bx && [0, nx - 1].contains(&ax) || az == bz && [0, nz - 1].contains(&az))
    };
    [edges.iter().filter(is_open).count(), doubled]
}

/// Random terrains with layers: liquid that flows there, and depths by chance, in part up to ceilings.
fn unlinked() -> [(f64, String); 2] {
    let ctx = context();
    let (mut pairs, mut surface, mut surfaces) = (Pairs::default(), Surface::default(), 0);
    let mut look = |columns: &Columns, depth: &[i32]| {
        surface.reserve(columns);
        pairs.look(&mut surface, columns, depth);
        surfaces += 1;
    };
    let mut layers = 0;
    for seed in 0..SCENES {
        let plan = turnable(seed);
        let mut liquid = plan.make(&ctx, Turn::NONE);
        for frame in 0..FRAMES {
            liquid.step(&ctx, FRAME).expect("a frame");
            if frame % 4 == 3 {
                look(liquid.columns(), liquid.depths());
            }
        }
        let columns = liquid.columns();
        layers = layers.max(columns.indices().map(|index| columns.layer(index) + 1).max().unwrap_or(0));
        let mut dice = Dice(seed);
        let mut depth = vec![0; columns.len()];
        let levels: Vec<i32> = (0..6).map(|_| plan.heights.round(dice.between(0.0, 0.125))).collect();
        for index in columns.indices() {
            let room = columns.ceilings()[index] - columns.bases()[index];
            depth[index] = match dice.below(6) {
                0 => 0,
                1 => room,
                2 => (f64::from(room) * dice.between(0.0, 0.1)) as i32,
                _ => (levels[columns.layer(index).min(5)] - columns.bases()[index]).clamp(0, room),
            };
        }
        look(columns, &depth);
    }
    // Holes in five floors, through which liquid falls.
    let mut liquid = on_floors(&stacked(100, 0.0005, 5, true), 0.003);
    for _ in 0..20 {
        liquid.step(&ctx, FRAME).expect("a frame");
        look(liquid.columns(), liquid.depths());
    }
    let Pairs { edges, false_edges, missing, alone, open, cracks } = pairs;
    let looked = format!("{surfaces} surfaces, up to {layers} layers");
    let of_links = format!(
        "{looked}; of {edges} edges between wet columns {false_edges} join what is not linked; {missing} linked pairs without an edge, but \
         {alone} that no third column is linked with"
    );
    let of_cracks = format!("{looked}; without skirts {open} of {edges} edges");
    [((false_edges + missing) as f64, of_links), (cracks as f64, of_cracks)]
}
