//! Solids as triangle soup: each triangle has corners of its own, and these are off by some neighbouring 32-bit numbers, as programs
//! write them that compute a corner once for each of its triangles.

use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::vdb::FloatGrid;

use super::bodies::{Dice, icosphere};
use super::shapes;

/// A closed body in 64 bits, its size about 1.
pub struct Solid {
    pub name: &'static str,
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Volume of these triangles, by a formula where there is one.
    pub volume: f64,
}

impl Solid {
    fn of(name: &'static str, mesh: &TriMesh) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
        let mut solid = Self { name, positions, triangles: mesh.triangles.clone(), volume: 0.0 };
        solid.volume = solid.by_divergence();
        solid
    }

    fn cuboid(name: &'static str, size: [f64; 3]) -> Self {
        let cube = TriMesh::cuboid([-0.5; 3], [0.5; 3]);
        let positions =
            cube.positions.iter().map(|position| position.cast().component_mul(&DVec3::from(size)));
        let volume = size.iter().product();
        Self { name, positions: positions.collect(), triangles: cube.triangles, volume }
    }

    /// Volume by the divergence theorem about its own first corner.
    fn by_divergence(&self) -> f64 {
        let six = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize] - self.positions[0]);
            a.dot(&b.cross(&c))
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    fn moved(mut self, by: DVec3) -> Self {
        self.positions.iter_mut().for_each(|position| *position += by);
        self
    }

    fn with(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|vertex| vertex + first)));
        self.volume += other.volume;
        self
    }

    /// Turned about an axis aslant.
    fn turned(mut self) -> Self {
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, 0.9, -0.7);
        self.positions.iter_mut().for_each(|position| *position = turn * *position);
        self
    }

    /// Times `size` and moved, in 32 bits: each corner up to `steps` neighbouring numbers further from 0 or nearer to it on each axis, all
    /// in the same direction.
    pub fn soup(&self, size: f64, at: DVec3, steps: usize, dice: &mut Dice) -> TriMesh {
        let corners =
            self.triangles.as_flattened().iter().map(|&vertex| self.positions[vertex as usize] * size + at);
        let noisy =
            |value: f32, dice: &mut Dice| (0..dice.below(steps + 1)).fold(value, |value, _| value.next_up());
        let positions: Vec<Vec3> = corners
            .map(|corner| {
                let exact: Vec3 = corner.cast();
                Vec3::new(noisy(exact.x, dice), noisy(exact.y, dice), noisy(exact.z, dice))
            })
            .collect();
        let triangles =
            (0..self.triangles.len() as u32).map(|first| [3 * first, 3 * first + 1, 3 * first + 2]);
        TriMesh { triangles: triangles.collect(), positions }
    }
}

/// Solids of many kinds, none thinner than a fifth of its size.
pub fn solids(dice: &mut Dice) -> Vec<Solid> {
    let ball = Solid::of("ball", &shapes::welded(&shapes::sphere(0.5, 6)));
    let two = Solid::cuboid("two boxes", [0.4, 0.5, 0.6]).moved(DVec3::new(-0.3, 0.0, 0.0));
    let shell = |name| Solid::of(name, &icosphere(2));
    let mut lump = shell("lump");
    // A convex body without any symmetry.
    let squeeze = DVec3::new(dice.between(0.3, 0.5), dice.between(0.3, 0.5), dice.between(0.3, 0.5));
    lump.positions.iter_mut().for_each(|position| *position = position.component_mul(&squeeze));
    lump.volume = lump.by_divergence();
    vec![
        Solid::cuboid("cube", [1.0; 3]),
        Solid::cuboid("turned box", [0.9, 0.6, 0.5]).turned(),
        Solid::cuboid("plate", [1.0, 0.2, 0.8]),
        ball,
        Solid::of("ring", &shapes::torus(0.35, 0.14, 24, 12)),
        lump.turned(),
        two.with(&Solid::cuboid("", [0.3, 0.6, 0.4]).moved(DVec3::new(0.35, 0.05, 0.0))),
    ]
}

/// Volume (m3) inside of a level set, voxel by voxel: far from the origin the measure of OpenVDB's tools loses its digits.
pub fn volume_inside(grid: &FloatGrid) -> f64 {
    let Some((low, high)) = grid.active_bbox() else { return 0.0 };
    let cell = grid.voxel_size();
    let mut inside = 0.0;
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                inside += (0.5 - f64::from(grid.value([x, y, z])) / cell).clamp(0.0, 1.0);
            }
        }
    }
    inside * cell.powi(3)
}
