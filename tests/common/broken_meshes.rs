//! Meshes with the faults that meshes have in practice, the same for each seed, and the solid that is meant by each: bodies that
//! overlap, touch, are there twice, in one another or inside out; triangles that are turned, doubled, missing, without area or apart.

use frazil::geometry::mesh::spacing;
use frazil::geometry::{DVec3, TriMesh, Vec3};

use super::bodies::{Body, Dice, any, model};

/// A mesh with faults.
pub struct Broken {
    pub mesh: TriMesh,
    /// The cell (m) that is right for it.
    pub cell: f64,
    /// What it is made of, and what was done to it.
    pub what: String,
    /// Closed parts, turned outward: the solid that is meant is where their winding numbers add up to more than 0.
    pub parts: Vec<TriMesh>,
    /// Where it is not known what is meant.
    pub unclear: Vec<Ball>,
}

/// A ball (m).
pub struct Ball {
    pub centre: DVec3,
    pub radius: f64,
}

impl Ball {
    /// Around a hole with these positions: it may be closed in any way within its own size and three cells.
    fn around(positions: &[DVec3], cell: f64) -> Self {
        let centre = positions.iter().sum::<DVec3>() / positions.len() as f64;
        let reach = positions.iter().map(|position| (position - centre).norm()).fold(0.0, f64::max);
        Self { centre, radius: 3.0 * reach + 3.0 * cell }
    }
}

impl Broken {
    /// Whether it is not known what is meant at a position (m).
    pub fn is_unclear(&self, position: DVec3) -> bool {
        self.unclear.iter().any(|ball| (position - ball.centre).norm() < ball.radius)
    }
}

/// Most that 32-bit numbers may be apart (cells).
const COARSEST: f64 = 0.03;
/// Most triangles before some are added, and least of a model.
const MOST: f64 = 16_000.0;
const LEAST_OF_MODEL: usize = 400;
/// Most triangles that are turned where what is meant by them becomes unclear.
const MOST_UNCLEAR: usize = 10;

/// The mesh of a seed, made of bodies or models. At most 20,000 triangles, mostly 200 to 5,000; 10 to 60 cells across, thin chains
/// of boxes more.
pub fn mesh(seed: u64, models: &[TriMesh]) -> Broken {
    let mut dice = Dice(seed);
    let span = dice.between(10.0, 60.0);
    let (low, high) = match dice.below(20) {
        0 => (5000.0, MOST),
        1..=3 => (20.0, 200.0),
        _ => (200.0, 5000.0),
    };
    let budget = libm::exp(dice.between(libm::log(low), libm::log(high))) as usize;
    let kind = dice.below(8);
    let bodies = match kind {
        0 | 1 => touching(&mut dice, span, budget),
        2 if !models.is_empty() => with_model(&mut dice, span, budget, models),
        _ => anywhere(&mut dice, span, budget),
    };
    let mut cell = 0.02 * libm::pow(10.0, dice.between(-3.0, 3.0));
    if kind < 2 && dice.one_in(2) {
        // Multiples of it are exact in 32 bits.
        cell = 2f64.powi(libm::log2(cell).round() as i32);
    }
    let mut at = match dice.below(4) {
        0 => DVec3::new(1000.0, -500.0, 20.0) / cell,
        1 => dice.vector(100.0),
        _ => dice.vector(1.0),
    };
    while spacing((at.amax() + span) * cell) > COARSEST * cell {
        at /= 10.0;
    }
    if kind < 2 {
        at = at.map(f64::round);
    }
    let position = |position: &DVec3| -> Vec3 { ((position + at) * cell).cast() };
    let parts = bodies.iter().map(|body| part(body, position)).collect::<Vec<TriMesh>>();
    let mut making = Making::of(&mut dice, &bodies, &parts, cell);
    if dice.one_in(8) {
        making.what.push("a far vertex that is not used".into());
        making.mesh.positions.push(position(&(dice.direction() * (1000.0 * span))));
    }
    making.add_faults(&mut dice);
    let Making { mesh, unclear, what, .. } = making;
    let what =
        format!("{span:.0} cells of {cell:.2e} m, {} triangles, {}", mesh.triangles.len(), what.join(", "));
    Broken { mesh, cell, what, parts, unclear }
}

/// Bodies of any shape at any position, some of them twice or within another.
fn anywhere(dice: &mut Dice, span: f64, budget: usize) -> Vec<Body> {
    let count = 1 + dice.below(6);
    let mut bodies: Vec<Body> = Vec::new();
    for group in 0..count {
        if group > 0 && dice.one_in(4) {
            let first = bodies[dice.below(group)].clone();
            let (way, body) = match dice.below(3) {
                0 => ("again", first),
                1 => ("again beside itself", first.moved(dice.vector(1e-6 * span))),
                _ => ("smaller within", Body { group, ..first.scaled(dice.between(0.3, 0.9)) }),
            };
            bodies.push(Body { name: format!("{} {way}", body.name), ..body });
            continue;
        }
        let size = span * if count == 1 { 0.5 } else { dice.between(0.1, 0.35) };
        let body = any(dice, size, budget / count).moved(dice.vector(0.5 * span - size));
        bodies.push(Body { group, ..body });
    }
    bodies
}

/// Boxes of whole cells that have faces, edges or corners in common, or planes; now and then with another body.
fn touching(dice: &mut Dice, span: f64, budget: usize) -> Vec<Body> {
    let most = (span / 3.0) as usize;
    // Both ends on each axis.
    let mut boxes = vec![[(); 3].map(|()| [0, 1 + dice.below(most) as i32])];
    for _ in 0..1 + dice.below(5) {
        let mut sides = boxes[dice.below(boxes.len())];
        // Beyond one that is there on so many axes: next to its face, its edge or its corner.
        let (beyond, first) = (dice.below(4), dice.below(3));
        for step in 0..3 {
            let side = &mut sides[(first + step) % 3];
            let ([low, high], length) = (*side, 1 + dice.below(most) as i32);
            *side = match step < beyond {
                true if dice.one_in(2) => [high, high + length],
                true => [low - length, low],
                false if beyond == 0 || dice.one_in(3) => [low, high].map(|end| end + length % 5 - 2),
                false => [low, high],
            };
        }
        boxes.push(sides);
    }
    let mut bodies: Vec<Body> = boxes.iter().map(|sides| cuboid(dice, sides)).collect();
    if dice.one_in(3) {
        let size = span * dice.between(0.1, 0.3);
        bodies.push(Body { group: 1, ..any(dice, size, budget / 2).moved(dice.vector(0.3 * span)) });
    }
    bodies
}

/// A box of 12 triangles, with the one or the other diagonal on all faces.
fn cuboid(dice: &mut Dice, sides: &[[i32; 2]; 3]) -> Body {
    let mut shape = TriMesh::cuboid(sides.map(|[low, _]| low as f32), sides.map(|[_, high]| high as f32));
    if dice.one_in(2) {
        for pair in shape.triangles.chunks_exact_mut(2) {
            let ([a, b, c], [_, _, d]) = (pair[0], pair[1]);
            pair.copy_from_slice(&[[a, b, d], [b, c, d]]);
        }
    }
    Body::of("box", shape, 1.0)
}

/// A model from outside, now and then with another body.
fn with_model(dice: &mut Dice, span: f64, budget: usize, models: &[TriMesh]) -> Vec<Body> {
    let mut bodies = vec![model(dice, models, 0.5 * span, budget.max(LEAST_OF_MODEL))];
    if dice.one_in(2) {
        let size = span * dice.between(0.1, 0.3);
        bodies.push(Body { group: 1, ..any(dice, size, budget / 4).moved(dice.vector(0.5 * span - size)) });
    }
    bodies
}

/// What a body is meant to be: closed, and turned outward as rounding leaves it.
fn part(body: &Body, position: impl Fn(&DVec3) -> Vec3) -> TriMesh {
    let triangles = [&body.triangles[..], &body.closing[..]].concat();
    let part = TriMesh { positions: body.positions.iter().map(position).collect(), triangles };
    if part.volume() < 0.0 { part.reversed() } else { part }
}

/// A mesh that faults are put into.
struct Making {
    mesh: TriMesh,
    /// Of each triangle, whether what is meant becomes unclear when it is turned.
    is_tangled: Vec<bool>,
    cell: f64,
    unclear: Vec<Ball>,
    what: Vec<String>,
}

impl Making {
    /// Bodies as they are placed, some of them inside out.
    fn of(dice: &mut Dice, bodies: &[Body], parts: &[TriMesh], cell: f64) -> Self {
        let is_inverted: Vec<bool> = bodies.iter().map(|_| dice.one_in(4)).collect();
        let mut making = Self {
            mesh: TriMesh::default(),
            is_tangled: Vec::new(),
            cell,
            unclear: Vec::new(),
            what: Vec::new(),
        };
        for (body, part) in bodies.iter().zip(parts) {
            let first = making.mesh.positions.len() as u32;
            making.mesh.positions.extend_from_slice(&part.positions);
            for fan in body.closing.chunk_by(|a, b| a[2] == b[2]) {
                let rim: Vec<DVec3> =
                    fan.iter().map(|[corner, ..]| part.positions[*corner as usize].cast()).collect();
                making.unclear.push(Ball::around(&rim, cell));
            }
            let inverted = is_inverted[body.group];
            for triangle in &body.triangles {
                let [a, b, c] = triangle.map(|corner| corner + first);
                making.mesh.triangles.push(if inverted { [a, c, b] } else { [a, b, c] });
            }
            let is_tangled =
                body.is_tangled || bodies.iter().filter(|other| other.group == body.group).count() > 1;
            making.is_tangled.resize(making.mesh.triangles.len(), is_tangled);
            making.what.push(format!("{}{}", body.name, if inverted { " inside out" } else { "" }));
        }
        making
    }

    fn add_faults(&mut self, dice: &mut Dice) {
        let count = self.mesh.triangles.len();
        if dice.one_in(4) {
            let times = 1 + dice.below(20);
            (0..times).for_each(|_| self.add_flat(dice));
            self.what.push(format!("{times} times triangles without area"));
        }
        if dice.one_in(5) {
            let times = 1 + dice.below(10);
            (0..times).for_each(|_| self.double(dice));
            self.what.push(format!("{times} doubled"));
        }
        if dice.one_in(4) {
            let times = 1 + dice.below(count / 20 + 1);
            self.turn(dice, times);
            self.what.push(format!("{times} turned"));
        }
        if dice.one_in(6) {
            let times = 1 + dice.below(3);
            (0..times).for_each(|_| self.open(dice, count));
            self.what.push(format!("{times} holes"));
        }
        match dice.below(6) {
            0 => self.split(dice, true),
            1 => self.split(dice, false),
            _ => {}
        }
        if dice.one_in(2) {
            self.shuffle(dice);
        }
    }

    /// Splits an edge by a vertex at one of its ends or on it, and closes what this opens by triangles without area.
    fn add_flat(&mut self, dice: &mut Dice) {
        let TriMesh { positions, triangles } = &mut self.mesh;
        let first = dice.below(triangles.len());
        triangles[first].rotate_left(dice.below(3));
        let [a, b, c] = triangles[first];
        let middle = positions.len() as u32;
        let [from, to] = [a, b].map(|vertex| positions[vertex as usize].cast::<f64>());
        let share = [0.0, 0.5, 1.0, dice.between(0.0, 1.0)][dice.below(4)];
        positions.push((from + (to - from) * share).cast());
        triangles[first] = [a, middle, c];
        triangles.push([middle, b, c]);
        self.is_tangled.push(self.is_tangled[first]);
        // The triangle beyond the edge is split too, or one without area lies between.
        let beyond = |[i, j, k]: &[u32; 3]| [[*i, *j], [*j, *k], [*k, *i]].contains(&[b, a]);
        let other = triangles.iter().position(beyond).filter(|_| dice.one_in(2));
        match other {
            Some(other) => {
                let far = triangles[other].into_iter().find(|corner| *corner != a && *corner != b);
                let far = far.expect("a third corner");
                triangles[other] = [b, middle, far];
                triangles.push([middle, a, far]);
                self.is_tangled.push(self.is_tangled[other]);
            }
            None => {
                triangles.push([b, middle, a]);
                self.is_tangled.push(self.is_tangled[first]);
            }
        }
    }

    /// Adds a triangle that is there already, the same way round or the other.
    fn double(&mut self, dice: &mut Dice) {
        let first = dice.below(self.mesh.triangles.len());
        let [a, b, c] = self.mesh.triangles[first];
        if dice.one_in(2) {
            self.mesh.triangles.push([b, c, a]);
        } else {
            self.mesh.triangles.push([a, c, b]);
            self.blur(&[first]);
        }
        self.is_tangled[first] = true;
        self.is_tangled.push(true);
    }

    /// Turns triangles round: where edges have two of them, their neighbours tell how they were.
    fn turn(&mut self, dice: &mut Dice, times: usize) {
        let mut unclear = 0;
        for _ in 0..times {
            let which = dice.below(self.mesh.triangles.len());
            if self.is_tangled[which] {
                unclear += 1;
                if unclear > MOST_UNCLEAR {
                    continue;
                }
                self.blur(&[which]);
            }
            self.mesh.triangles[which].swap(1, 2);
        }
    }

    /// Takes some triangles around a corner away; fewer from a mesh of few.
    fn open(&mut self, dice: &mut Dice, count: usize) {
        let triangles = &self.mesh.triangles;
        let first = dice.below(triangles.len());
        let is_beside = |which: &usize| {
            *which != first && triangles[*which].iter().any(|corner| triangles[first].contains(corner))
        };
        let most = dice.below((count / 50 + 1).min(5));
        let mut patch: Vec<usize> = (0..triangles.len()).filter(is_beside).take(most).collect();
        patch.push(first);
        self.blur(&patch);
        patch.sort_unstable();
        for which in patch.into_iter().rev() {
            self.mesh.triangles.swap_remove(which);
            self.is_tangled.swap_remove(which);
        }
    }

    /// What is meant is not known around these triangles.
    fn blur(&mut self, triangles: &[usize]) {
        let positions: Vec<DVec3> =
            triangles.iter().flat_map(|triangle| self.mesh.corners(*triangle)).collect();
        self.unclear.push(Ball::around(&positions, self.cell));
    }

    /// Gives all or some corners vertices of their own.
    fn split(&mut self, dice: &mut Dice, all: bool) {
        let TriMesh { positions, triangles } = &mut self.mesh;
        for corner in triangles.as_flattened_mut() {
            if all || dice.one_in(10) {
                positions.push(positions[*corner as usize]);
                *corner = positions.len() as u32 - 1;
            }
        }
        self.what.push(if all { "loose triangles" } else { "some corners loose" }.into());
    }

    /// Brings triangles and their corners into another order.
    fn shuffle(&mut self, dice: &mut Dice) {
        let triangles = &mut self.mesh.triangles;
        for last in (1..triangles.len()).rev() {
            triangles.swap(last, dice.below(last + 1));
            triangles[last].rotate_left(dice.below(3));
        }
        self.what.push("shuffled".into());
    }
}
