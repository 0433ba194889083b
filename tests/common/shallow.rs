//! Terrains and liquids for shallow's tests and gates, made by code, and the symmetries of the ground. Lengths are powers of two where a
//! scene is to be turned: centres of cells are then exact, and so are their turned positions.

use std::hash::{DefaultHasher, Hash, Hasher};

use frazil::shallow::columns::Columns;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::{Friction, Section, TimeStepping};
use frazil::shallow::pipes::{Border, Pipes};
use frazil::shallow::sources::{FlowPoint, Kind, Pulse};
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::solids::{Solid, unite};
use frazil::shallow::{Params, Report, Shallow};
use frazil::{Context, Pool};

use super::bodies::Dice;

/// A context whose work is done by the caller's thread.
pub fn context() -> Context {
    Context::new(Pool::new(0).expect("no threads"))
}

/// A symmetry of the ground: mirrored along x or not, then turned by so many quarters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    pub mirrored: bool,
    pub quarters: usize,
}

impl Turn {
    /// Nothing is turned.
    pub const NONE: Self = Self { mirrored: false, quarters: 0 };
    /// Turned by a quarter, two and three.
    pub const TURNS: [Self; 3] = [Self::of(false, 1), Self::of(false, 2), Self::of(false, 3)];
    /// Mirrored along x, along z, and over both diagonals.
    pub const MIRRORS: [Self; 4] =
        [Self::of(true, 0), Self::of(true, 2), Self::of(true, 1), Self::of(true, 3)];
    /// All of them, the one that changes nothing first.
    pub const ALL: [Self; 8] = [
        Self::NONE,
        Self::TURNS[0],
        Self::TURNS[1],
        Self::TURNS[2],
        Self::MIRRORS[0],
        Self::MIRRORS[1],
        Self::MIRRORS[2],
        Self::MIRRORS[3],
    ];

    const fn of(mirrored: bool, quarters: usize) -> Self {
        Self { mirrored, quarters }
    }

    /// Size of a domain after it.
    pub fn size(self, [nx, nz]: [usize; 2]) -> [usize; 2] {
        if self.quarters.is_multiple_of(2) { [nx, nz] } else { [nz, nx] }
    }

    /// Where a position of a domain goes, in cells from its corner.
    pub fn position(self, [x, z]: [f64; 2], size: [usize; 2]) -> [f64; 2] {
        let mut size = size.map(|count| count as f64);
        let mut at = if self.mirrored { [size[0] - x, z] } else { [x, z] };
        for _ in 0..self.quarters {
            at = [size[1] - at[1], at[0]];
            size.swap(0, 1);
        }
        at
    }

    /// Where a cell of a domain goes.
    pub fn cell(self, cell: [usize; 2], size: [usize; 2]) -> [usize; 2] {
        self.position(cell.map(|at| at as f64 + 0.5), size).map(|at| at as usize)
    }

    /// Where a direction goes.
    pub fn direction(self, direction: [f64; 2]) -> [f64; 2] {
        self.position(direction, [0; 2])
    }
}

/// A terrain and what flows on it, before it is turned.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Count of cells along x and along z.
    pub size: [usize; 2],
    /// Edge of a cell (m).
    pub cell: f64,
    pub heights: Heights,
    pub params: Params,
    /// Solids of each cell, row by row, sorted and apart.
    pub solids: Vec<Vec<Solid>>,
    /// Depths (m) of the columns of each cell at first, as far as there are columns.
    pub depths: Vec<Vec<f64>>,
    /// Flow points; `at` along x and z, and radii, in cells.
    pub points: Vec<FlowPoint>,
}

impl Plan {
    /// Dry terrain: `solids` gives those of a cell at a position (m) from the middle of the domain, in any order, as heights (m); the first
    /// is the ground, which reaches down for ever.
    pub fn new(
        size: [usize; 2],
        cell: f64,
        [low, high]: [f64; 2],
        mut solids: impl FnMut([f64; 2]) -> Vec<[f64; 2]>,
    ) -> Self {
        let heights = Heights::between(low, high).expect("a range");
        let mut column = |index: usize| {
            let at = [index % size[0], index / size[0]];
            let position = [0, 1].map(|axis| (at[axis] as f64 + 0.5 - 0.5 * size[axis] as f64) * cell);
            let mut out: Vec<Solid> =
                solids(position).iter().map(|solid| solid.map(|h| heights.round(h))).collect();
            if let Some(ground) = out.first_mut() {
                ground[0] = BOTTOMLESS;
            }
            unite(&mut out);
            out
        };
        let solids: Vec<_> = (0..size[0] * size[1]).map(&mut column).collect();
        let depths = vec![Vec::new(); solids.len()];
        Self { size, cell, heights, params: Params::default(), solids, depths, points: Vec::new() }
    }

    /// The terrain after a symmetry.
    pub fn solids(&self, turn: Turn) -> Solids {
        let size = turn.size(self.size);
        let origin = size.map(|count| -0.5 * count as f64 * self.cell);
        let mut cells = vec![Vec::new(); self.solids.len()];
        for (index, solids) in self.solids.iter().enumerate() {
            let [x, z] = turn.cell([index % self.size[0], index / self.size[0]], self.size);
            cells[z * size[0] + x].clone_from(solids);
        }
        Solids::new(Grid { cell: self.cell, origin, size }, self.heights, cells)
    }

    /// The liquid at its start, after a symmetry.
    pub fn make(&self, ctx: &Context, turn: Turn) -> Shallow {
        let solids = self.solids(turn);
        let [x, z] = turn.direction([self.params.gravity[0], self.params.gravity[2]]);
        let params = Params { gravity: [x, self.params.gravity[1], z], ..self.params.clone() };
        let mut liquid = Shallow::new(ctx, &solids, params).expect("a liquid");
        for (index, depths) in self.depths.iter().enumerate() {
            let cell = turn.cell([index % self.size[0], index / self.size[0]], self.size);
            for (layer, &depth) in depths.iter().enumerate() {
                if let Some(column) = liquid.columns().column(cell, layer) {
                    liquid.pour(column, depth);
                }
            }
        }
        let point = |point: &FlowPoint| {
            let [x, z] = turn.position([point.at[0], point.at[2]], self.size);
            let [left, back] = solids.grid.origin;
            let at = [left + x * self.cell, point.at[1], back + z * self.cell];
            FlowPoint { at, radius: point.radius * self.cell, ..point.clone() }
        };
        let points: Vec<FlowPoint> = self.points.iter().map(point).collect();
        liquid.set_flows(&points, |index| format!("point {index}")).expect("flow points");
        liquid
    }

    /// Count of pipes between layers and over the border.
    pub fn links(&self) -> usize {
        Pipes::new(&Columns::new(&self.solids(Turn::NONE)), self.params.border).links.len()
    }

    /// Pours a depth (m; negative: takes it) into every column between two cells.
    pub fn pour(&self, liquid: &mut Shallow, turn: Turn, [a, b]: [[usize; 2]; 2], depth: f64) {
        let range = |axis: usize| a[axis].min(b[axis])..=a[axis].max(b[axis]);
        for z in range(1) {
            for x in range(0) {
                let cell = turn.cell([x, z], self.size);
                for layer in 0..self.solids[z * self.size[0] + x].len() {
                    if let Some(column) = liquid.columns().column(cell, layer) {
                        liquid.pour(column, depth);
                    }
                }
            }
        }
    }

    /// Depths (units) by cell and layer, turned back.
    pub fn depths_of(&self, liquid: &Shallow, turn: Turn) -> Vec<i32> {
        let mut out = Vec::new();
        for index in 0..self.solids.len() {
            let cell = turn.cell([index % self.size[0], index / self.size[0]], self.size);
            out.extend(liquid.columns().of_cell(cell).map(|column| liquid.depths()[column]));
        }
        out
    }
}

/// A hash of the state: depths, and fluxes bit by bit.
pub fn hash(liquid: &Shallow) -> u64 {
    let mut hasher = DefaultHasher::new();
    liquid.depths().hash(&mut hasher);
    for fluxes in liquid.fluxes() {
        fluxes.iter().for_each(|flux| flux.to_bits().hash(&mut hasher));
    }
    hasher.finish()
}

/// Columns whose depth is not within 0 to their room, indices without a column that hold liquid, and fluxes that are not finite.
pub fn violations(liquid: &Shallow) -> usize {
    let (columns, depths) = (liquid.columns(), liquid.depths());
    let is_off = |index: &usize| {
        let room = columns.ceilings()[*index] - columns.bases()[*index];
        !(0..=if columns.is_column(*index) { room } else { 0 }).contains(&depths[*index])
    };
    let not_finite = liquid.fluxes().into_iter().flatten().filter(|flux| !flux.is_finite());
    (0..columns.len()).filter(is_off).count() + not_finite.count()
}

/// A source of a rate (m3/s); position and radius in cells.
pub fn source(at: [f64; 3], radius: f64, rate: f64) -> FlowPoint {
    FlowPoint { kind: Kind::Source, at, radius, rate, pulse: None }
}

/// Ground of a height (m) at each position (m) from the middle of the domain.
pub fn ground(
    size: [usize; 2],
    cell: f64,
    [low, high]: [f64; 2],
    height: impl Fn([f64; 2]) -> f64,
) -> Solids {
    floors(size, cell, [low, high], 1, |at, _| Some([low, height(at)]))
}

/// So many floors: bottom and top (m) of each at a position (m) from the middle of the domain, if it is there. The lowest reaches down for
/// ever.
pub fn floors(
    size: [usize; 2],
    cell: f64,
    [low, high]: [f64; 2],
    count: usize,
    floor: impl Fn([f64; 2], usize) -> Option<[f64; 2]>,
) -> Solids {
    let origin = size.map(|count| -0.5 * count as f64 * cell);
    let grid = Grid { cell, origin, size };
    let heights = Heights::between(low, high).expect("a range");
    let solids = |index: usize| {
        let at = grid.centre([index % size[0], index / size[0]]);
        let solid = |layer: usize| {
            let [bottom, top] = floor(at, layer)?.map(|height| heights.round(height));
            Some(if layer == 0 { [BOTTOMLESS, top] } else { [bottom, top] })
        };
        (0..count).filter_map(solid).collect()
    };
    Solids::new(grid, heights, (0..grid.cells()).map(solids))
}

/// Waves of some 60 cells, from -1 to 1.
pub fn waves([x, z]: [f64; 2], cell: f64) -> f64 {
    0.5 * (libm::sin(0.1 * x / cell) + libm::cos(0.13 * z / cell))
}

/// A liquid of a depth (m) in each column, given by its cell's position (m) and layer.
pub fn covered(
    ctx: &Context,
    solids: &Solids,
    params: Params,
    depth: impl Fn([f64; 2], usize) -> f64,
) -> Shallow {
    let mut liquid = Shallow::new(ctx, solids, params).expect("a liquid");
    for index in 0..liquid.columns().len() {
        if liquid.columns().is_column(index) {
            let at = solids.grid.centre(liquid.columns().cell(index));
            liquid.pour(index, depth(at, liquid.columns().layer(index)));
        }
    }
    liquid
}

/// A slope with islands, a bridge with a hole, gauze, drains and two sources, one of which pulsates; liquid leaves over the border.
pub fn busy(size: [usize; 2]) -> Plan {
    let cell = 1.0 / 1024.0;
    let half = size.map(|count| 0.5 * count as f64 * cell);
    let mut plan = Plan::new(size, cell, [0.0, 0.0625], |[x, z]| {
        let [across, along] = [x / half[0], z / half[1]];
        let island = |cx: f64, cz: f64, r: f64| {
            let square = (across - cx).powi(2) + (along - cz).powi(2);
            (0.004 * (1.0 - square / (r * r))).max(0.0)
        };
        let hills = island(0.5, 0.4, 0.2) + island(-0.6, -0.5, 0.15) + island(0.1, -0.6, 0.1);
        let mut out = vec![[0.0, 0.01 - 0.005 * across + hills]];
        let from_bridge = (across + 0.1).abs();
        let in_hole = from_bridge < 0.03 && along.abs() < 0.07;
        if from_bridge < 0.09 && !in_hole {
            // At one end it comes down to the ground.
            out.push([0.013 - 0.003 * along, 0.015 - 0.003 * along]);
        }
        out
    });
    // Positions are halves of cells, so that they can be turned.
    let on = |[x, z]: [f64; 2], layer: usize| {
        let cell = [(x * size[0] as f64) as usize, (z * size[1] as f64) as usize];
        let solids = &plan.solids[cell[1] * size[0] + cell[0]];
        let [x, z] = cell.map(|at| at as f64 + 0.5);
        [x, plan.heights.metres(solids[layer.min(solids.len() - 1)][1]), z]
    };
    let pulse = Some(Pulse { frequency: 1.2, share: 1.0 });
    let points = vec![
        source(on([0.2, 0.5], 0), 2.5, 2.0e-6),
        FlowPoint { pulse, ..source(on([0.45, 0.3], 1), 1.5, 1.0e-6) },
        FlowPoint { kind: Kind::Drain, ..source(on([0.7, 0.7], 0), 2.0, 5.0e-7) },
        FlowPoint { kind: Kind::Drain, ..source(on([0.02, 0.02], 0), 0.0, 1.0e-3) },
        FlowPoint { kind: Kind::Absorber(2.0e-6), ..source(on([0.3, 0.4], 0), 3.0, 3.0e-7) },
    ];
    plan.points = points;
    plan.params = Params { border: Border::Open, ..Params::default() };
    plan
}

/// Hills, slabs that hang over them, low ceilings and holes, all by chance, with liquid in most columns.
pub fn random(dice: &mut Dice, size: [usize; 2], cell: f64, range: f64, depth: f64) -> Plan {
    let half = size.map(|count| 0.5 * count as f64 * cell);
    let reach = half[0].max(half[1]);
    let somewhere = |dice: &mut Dice| half.map(|half| dice.between(-half, half));
    let steep = range * [0.0, 0.01, 0.3][dice.below(3)];
    let slope = [(); 2].map(|()| dice.between(-0.3, 0.3) * steep / reach);
    let hills: Vec<_> = (0..dice.below(6))
        .map(|_| (somewhere(dice), reach * dice.between(0.1, 0.8), steep * dice.between(-0.3, 1.0)))
        .collect();
    let slabs: Vec<_> = (0..dice.below(5))
        .map(|_| {
            let (a, b) = (somewhere(dice), somewhere(dice));
            let gap = 1e-8 * libm::pow(10.0, dice.between(0.0, 6.5));
            let follows = dice.one_in(2);
            let tilt = [dice.between(-0.2, 0.2), dice.between(-0.2, 0.2)];
            let hole = (somewhere(dice), reach * dice.between(0.0, 0.3));
            (a, b, gap, follows, tilt, hole)
        })
        .collect();
    let pits = dice.one_in(4);
    let pit = (somewhere(dice), reach * dice.between(0.0, 0.3));
    let within =
        |[x, z]: [f64; 2], ([cx, cz], r): ([f64; 2], f64)| (x - cx).powi(2) + (z - cz).powi(2) < r * r;
    let mut plan = Plan::new(size, cell, [0.0, range], |at @ [x, z]| {
        if pits && within(at, pit) {
            return Vec::new();
        }
        let hill = |&([cx, cz], r, height): &([f64; 2], f64, f64)| {
            height * (1.0 - ((x - cx).powi(2) + (z - cz).powi(2)) / (r * r)).max(0.0)
        };
        let ground = 0.2 * range + slope[0] * x + slope[1] * z + hills.iter().map(hill).sum::<f64>();
        let mut out = vec![[0.0, ground.max(0.0)]];
        for &(a, b, gap, follows, tilt, hole) in &slabs {
            let inside = (0..2).all(|axis| (at[axis] - a[axis]) * (at[axis] - b[axis]) <= 0.0);
            if inside && !within(at, hole) {
                let level = if follows { ground } else { 0.2 * range + tilt[0] * x + tilt[1] * z };
                out.push([level + gap, level + gap + 0.02 * range]);
            }
        }
        out
    });
    let fill = dice.below(4);
    for (solids, depths) in plan.solids.iter().zip(&mut plan.depths) {
        let one = |_: &Solid| if fill > 0 || dice.one_in(3) { depth * dice.between(0.0, 1.0) } else { 0.0 };
        *depths = solids.iter().map(one).collect();
    }
    for _ in 0..dice.below(4) {
        let [x, z] = size.map(|count| dice.below(count));
        let Some(&[_, top]) = plan.solids[z * size[0] + x].last() else { continue };
        let kind =
            [Kind::Source, Kind::Source, Kind::Drain, Kind::Absorber(cell * cell * depth)][dice.below(4)];
        let rate = dice.between(0.0, 3.0) * depth * cell * cell * 60.0;
        let at = [x as f64 + 0.5, plan.heights.metres(top), z as f64 + 0.5];
        plan.points.push(FlowPoint { kind, ..source(at, dice.below(4) as f64, rate) });
    }
    plan
}

/// A liquid and manners of flow by chance; steps of `step` (s).
pub fn random_params(dice: &mut Dice, step: f64) -> Params {
    let viscosity = if dice.one_in(5) { 0.0 } else { libm::pow(10.0, dice.between(-9.0, 6.0)) };
    let leans = if dice.one_in(3) { 5.0 } else { 0.0 };
    Params {
        liquid: Liquid::new(viscosity),
        gravity: [dice.between(-leans, leans), -9.81, dice.between(-leans, leans)],
        kept: [0.0, 0.5, 1.0][dice.below(3)],
        pace: TimeStepping::Realtime(step.clamp(1e-6, 1.0)),
        border: [Border::Closed, Border::Open, Border::Absorbing][dice.below(3)],
        section: if dice.one_in(4) { Section::Whole } else { Section::Wetted },
        friction: Friction::Ground,
        thickening: None,
        falls: None,
        rest: Params::default().rest,
    }
}

/// A scene by chance whose sizes are no multiples of a strip, with lengths that are powers of two; 0 is a busy one.
pub fn turnable(seed: u64) -> Plan {
    if seed == 0 {
        return busy([93, 61]);
    }
    let mut dice = Dice(seed);
    let size = [0, 1].map(|axis| 17 + 16 * dice.below(2 - axis) + dice.below(15));
    let depth = [1e-5, 2e-4, 2e-3, 1e-2][dice.below(4)];
    let mut plan = random(&mut dice, size, 1.0 / 1024.0, 0.125, depth);
    let step = [0.001, 0.003, 0.01][dice.below(3)];
    plan.params = random_params(&mut dice, step);
    if dice.one_in(3) {
        plan.params.pace = TimeStepping::Exact;
        plan.params.liquid.viscosity = plan.params.liquid.viscosity.min(1e-3);
    }
    plan
}

/// A scene by chance and its step (s): viscosity 0 to 1e6 m2/s, depths 1e-9 to 0.1 m, 0.1 to 10 times the longest stable step.
pub fn extreme(seed: u64) -> (Plan, f64) {
    let mut dice = Dice(seed);
    let size = [2 + dice.below(22), 1 + dice.below(22)];
    let cell = libm::pow(10.0, dice.between(-4.0, -2.0));
    let depth = libm::pow(10.0, dice.between(-9.0, -1.0));
    let range = if dice.one_in(2) { 0.5 } else { (4.0 * depth).max(1e-4) };
    let stable = cell / (2.0 * 9.81 * depth).sqrt();
    let step = stable * libm::pow(10.0, dice.between(-1.0, 1.0));
    let mut plan = random(&mut dice, size, cell, range, depth);
    plan.params = random_params(&mut dice, step);
    if dice.one_in(3) {
        plan.params.pace = TimeStepping::Exact;
    }
    (plan, step)
}

/// A frame of an extreme scene.
pub fn extreme_frame(ctx: &Context, liquid: &mut Shallow, step: f64, frame: usize) -> Report {
    let report = match liquid.params().pace {
        // A recorded run may hold steps of any length, and nothing caps what flows in them.
        TimeStepping::Exact => liquid.replay(ctx, &[step, 0.3 * step, 3.0 * step][..1 + frame % 3]),
        TimeStepping::Realtime(longest) => liquid.step(ctx, longest * (0.7 + (frame % 4) as f64)),
    };
    report.expect("a frame")
}
