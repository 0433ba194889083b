//! Closed bodies of many shapes, the same for each state of the dice: round, bumpy, long, flat, with needles, and models from outside
//! with fewer triangles.

use super::skip::skipped;
use std::collections::HashMap;

use frazil::geometry::mesh::coincident;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::mesh;

use super::character::data;
use super::shapes;

/// Numbers that look random and are the same in each run (splitmix64).
pub struct Dice(pub u64);

impl Dice {
    fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number from 0 to under `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.draw() % end.max(1) as u64) as usize
    }

    /// One of a list.
    pub fn one<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }

    /// Whether something happens that does once in so many times.
    pub fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// A number from `low` to under `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.draw() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A vector in a cube of twice `size`.
    pub fn vector(&mut self, size: f64) -> DVec3 {
        DVec3::from([(); 3].map(|()| self.between(-size, size)))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let way = self.vector(1.0);
            if (0.1..1.0).contains(&way.norm()) {
                return way.normalize();
            }
        }
    }
}

/// A body; positions in cells.
#[derive(Clone)]
pub struct Body {
    pub name: String,
    pub positions: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that close it where it is open, each from a rim to a vertex in its middle, which is the last corner; rim by rim.
    pub closing: Vec<[u32; 3]>,
    /// Bodies of one group may share positions, and are inside out together.
    pub group: usize,
    /// Whether edges may have more than two triangles.
    pub is_tangled: bool,
}

impl Body {
    /// A shape that is closed, by position at least, times `size`.
    pub fn of(name: &str, shape: TriMesh, size: f64) -> Self {
        let shape = if shape.volume() < 0.0 { shape.reversed() } else { shape };
        Self {
            name: name.into(),
            positions: shape.positions.iter().map(|position| position.cast::<f64>() * size).collect(),
            triangles: shape.triangles,
            closing: Vec::new(),
            group: 0,
            is_tangled: false,
        }
    }

    /// Moves it (cells).
    pub fn moved(mut self, by: DVec3) -> Self {
        self.positions.iter_mut().for_each(|position| *position += by);
        self
    }

    /// Makes it smaller or larger about its middle.
    pub fn scaled(mut self, by: f64) -> Self {
        let middle = self.positions.iter().sum::<DVec3>() / self.positions.len() as f64;
        self.positions.iter_mut().for_each(|position| *position = middle + (*position - middle) * by);
        self
    }

    /// Turns it about the origin in any way.
    fn turned(mut self, dice: &mut Dice) -> Self {
        let x = dice.direction();
        let z = x.cross(&dice.direction()).normalize();
        let y = z.cross(&x);
        self.positions
            .iter_mut()
            .for_each(|position| *position = x * position.x + y * position.y + z * position.z);
        self
    }

    /// Presses it along the axes.
    fn pressed(mut self, dice: &mut Dice) -> Self {
        let by = DVec3::from([(); 3].map(|()| dice.between(0.25, 1.0)));
        self.positions.iter_mut().for_each(|position| *position = position.component_mul(&by));
        self
    }

    /// Moves each position by up to an edge, so that the surface crosses itself. None where little of the volume would be left.
    fn shaken(&self, dice: &mut Dice) -> Option<Self> {
        let length =
            |[a, b, _]: &[u32; 3]| (self.positions[*a as usize] - self.positions[*b as usize]).norm();
        let mean = self.triangles.iter().map(length).sum::<f64>() / self.triangles.len() as f64;
        let most = mean * dice.between(0.2, 1.0);
        let moves: Vec<DVec3> = self.positions.iter().map(|_| dice.vector(most)).collect();
        let mut shaken = self.clone();
        // Vertices at one position stay together.
        for (position, first) in shaken.positions.iter_mut().zip(coincident(self.positions.iter().copied())) {
            *position += moves[first as usize];
        }
        shaken.name.insert_str(0, "noisy ");
        (shaken.volume() > 0.3 * self.volume()).then_some(shaken)
    }

    /// Enclosed volume (cells^3).
    fn volume(&self) -> f64 {
        let six = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
            a.dot(&b.cross(&c))
        };
        self.triangles.iter().chain(&self.closing).map(six).sum::<f64>() / 6.0
    }

    /// Finds its openings, and what closes them.
    fn closed(mut self) -> Self {
        let edges = self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut edges: Vec<([u32; 2], i32)> =
            edges.map(|[a, b]| if a < b { ([a, b], 1) } else { ([b, a], -1) }).collect();
        edges.sort_unstable();
        // The edges that are run along more often one way than the other.
        let sum = |uses: &[([u32; 2], i32)]| (uses[0].0, uses.iter().map(|(_, way)| way).sum::<i32>());
        let open: Vec<([u32; 2], i32)> =
            edges.chunk_by(|a, b| a.0 == b.0).map(sum).filter(|(_, times)| *times != 0).collect();
        // Those that hang together get the least of their vertices as label.
        let mut labels: Vec<u32> = (0..self.positions.len() as u32).collect();
        loop {
            let mut is_settled = true;
            for ([a, b], _) in &open {
                let least = labels[*a as usize].min(labels[*b as usize]);
                for end in [a, b] {
                    is_settled &= labels[*end as usize] == least;
                    labels[*end as usize] = least;
                }
            }
            if is_settled {
                break;
            }
        }
        let label = |([a, _], _): &([u32; 2], i32)| labels[*a as usize];
        let mut rims: Vec<u32> = open.iter().map(label).collect();
        rims.sort_unstable();
        rims.dedup();
        for rim in rims {
            let middle = self.positions.len() as u32;
            let (mut sum, mut count) = (DVec3::zeros(), 0.0);
            for ([a, b], times) in open.iter().filter(|&edge| label(edge) == rim) {
                sum += self.positions[*a as usize] + self.positions[*b as usize];
                count += 2.0;
                let back = if *times > 0 { [*b, *a, middle] } else { [*a, *b, middle] };
                self.closing.extend((0..times.abs()).map(|_| back));
            }
            self.positions.push(sum / count);
        }
        self
    }
}

/// A body of any shape around the origin, `size` cells from it or less, of about so many triangles or fewer.
pub fn any(dice: &mut Dice, size: f64, budget: usize) -> Body {
    // Half as thick as 0.1 to 1.6 cells.
    let thin = (dice.between(0.05, 0.8) / size) as f32;
    let wide = dice.between(0.3, 1.0) as f32;
    let (name, shape, is_round) = match dice.below(9) {
        0 => ("icosphere", icosphere(level(budget)), true),
        1 => {
            let rings = 4 + dice.below(8);
            ("globe", shapes::globe(1.0, (budget / (2 * rings)).clamp(8, 400), rings), true)
        }
        2 => {
            let (tube, around) = (dice.between(0.1, 0.45) as f32, 4 + dice.below(16));
            let along = (budget / (2 * around)).clamp(5, 400);
            ("torus", shapes::torus(1.0 - tube, tube, along, around), true)
        }
        3 => {
            let half = [1.0, wide, dice.between(0.3, 1.0) as f32];
            ("cuboid", TriMesh::cuboid(half.map(|x| -x), half), false)
        }
        4 => ("star", star(dice, level(budget)), true),
        5 => {
            let around = 3 + dice.below(8);
            ("rod", shapes::tube(thin, 2.0, around, (budget / (2 * around)).clamp(1, 300)), false)
        }
        6 => ("plate", TriMesh::cuboid([-1.0, -wide, -thin], [1.0, wide, thin]), false),
        7 => ("disc", shapes::wheel(1.0, 2.0 * thin, (budget / 4).clamp(8, 1000)), false),
        _ => {
            let squares = (budget as f64 / 12.0).sqrt() as usize;
            ("blob with seams", shapes::blob(2.0, squares.clamp(2, 36)), true)
        }
    };
    let mut body = Body::of(name, shape, size);
    if is_round && dice.one_in(4) {
        body = body.pressed(dice);
    }
    if is_round && dice.one_in(4) {
        body = body.shaken(dice).unwrap_or(body);
    }
    if dice.one_in(5) { body } else { body.turned(dice) }
}

/// How often an icosahedron's triangles can be cut in four.
fn level(budget: usize) -> usize {
    (1..=4).rev().find(|level| 20 << (2 * level) <= budget).unwrap_or(0)
}

/// A bumpy body within the unit sphere; all of it is seen from the origin.
fn star(dice: &mut Dice, level: usize) -> TriMesh {
    let waves = [(); 3].map(|()| (dice.vector(6.0), dice.between(0.0, 6.3)));
    let mut mesh = icosphere(level);
    for position in &mut mesh.positions {
        let unit: DVec3 = position.cast();
        let high = waves.iter().map(|(along, begin)| libm::sin(along.dot(&unit) + begin)).sum::<f64>();
        *position = (unit * (0.7 + 0.1 * high)).cast();
    }
    mesh
}

/// The faces of an icosahedron.
const FACES: [[u32; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// A unit sphere of 20 x 4^level triangles, all of about one size.
pub fn icosphere(level: usize) -> TriMesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    // Three rectangles across each other.
    let corner = |n: usize| {
        let (long, short) = (golden * [1.0, -1.0][n / 2 % 2], [-1.0, 1.0][n % 2]);
        match n / 4 {
            0 => DVec3::new(short, long, 0.0),
            1 => DVec3::new(0.0, short, long),
            _ => DVec3::new(long, 0.0, short),
        }
    };
    let mut places: Vec<DVec3> = (0..12).map(|n| corner(n).normalize()).collect();
    let mut triangles = FACES.to_vec();
    for _ in 0..level {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    places.push((places[from as usize] + places[to as usize]).normalize());
                    places.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    TriMesh { positions: places.iter().map(|place| place.cast()).collect(), triangles }
}

/// Models of the outside data: closed ones, one with holes, and open ones.
const MODELS: [&str; 7] = [
    "spot.obj",
    "cow.obj",
    "armadillo.obj",
    "igea.ply",
    "stanford-bunny.obj",
    "teapot.obj",
    "beetle-alt.obj",
];

/// The models that are there, vertices at one position joined.
pub fn models() -> Vec<TriMesh> {
    let read = |name: &&str| {
        let path = data(&format!("mesh/{name}"));
        if path.is_none() {
            skipped(&format!("no mesh/{name}"));
        }
        let mut model = mesh::read(&path?).expect("a mesh");
        let same = coincident(model.positions.iter().map(|position| position.cast()));
        model.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(|n| same[n as usize]));
        model.triangles.retain(|triangle| !is_collapsed(triangle));
        Some(model.without_unused())
    };
    MODELS.iter().filter_map(read).collect()
}

fn is_collapsed([a, b, c]: &[u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// One of the models around the origin, `size` cells from it or less on each axis before it is turned.
pub fn model(dice: &mut Dice, models: &[TriMesh], size: f64, budget: usize) -> Body {
    let which = dice.below(models.len());
    let mut mesh = decimated(dice, &models[which], budget);
    let (low, high) = mesh.bounds().expect("a model has vertices");
    let (middle, half) = ((low + high) / 2.0, (high - low).amax() / 2.0);
    mesh.positions.iter_mut().for_each(|position| *position = (*position - middle) / half);
    let mut body = Body::of("model", mesh, size).closed();
    body.is_tangled = true;
    if !body.closing.is_empty() {
        body.name.insert_str(0, "open ");
    }
    body.turned(dice)
}

/// A model whose vertices are joined within cubes, so that about so many triangles are left. What that makes is kept: doubled
/// triangles, edges with four of them, parts that are folded flat.
fn decimated(dice: &mut Dice, model: &TriMesh, budget: usize) -> TriMesh {
    if model.triangles.len() <= budget {
        return model.clone();
    }
    // A surface meets about 1.5 cubes for each square of its area, and has two triangles for each vertex.
    let cube = (3.0 * model.area() / budget as f64).sqrt();
    let shift = dice.vector(cube);
    let mut numbers: HashMap<[i64; 3], u32> = HashMap::new();
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    let mut joined = Vec::with_capacity(model.positions.len());
    for position in &model.positions {
        let position: DVec3 = position.cast();
        let at = (position + shift) / cube;
        let next = sums.len() as u32;
        let number = *numbers.entry([at.x, at.y, at.z].map(|x| x.floor() as i64)).or_insert(next);
        if number == next {
            sums.push((DVec3::zeros(), 0.0));
        }
        let (sum, count) = &mut sums[number as usize];
        *sum += position;
        *count += 1.0;
        joined.push(number);
    }
    let positions: Vec<Vec3> = sums.iter().map(|(sum, count)| (sum / *count).cast()).collect();
    let triangles = model.triangles.iter().map(|triangle| triangle.map(|n| joined[n as usize]));
    let triangles = triangles.filter(|triangle| !is_collapsed(triangle)).collect();
    TriMesh { positions, triangles }.without_unused()
}
