//! Rigid motion by keys, of a mesh or on top of another motion.

use nalgebra::{Matrix3, Rotation3};

use super::drawn::Faces;
use super::{Drawn, Motion, Space};
use crate::error::{Error, Result};
use crate::geometry::{DVec3, PolygonMesh, TriMesh};

/// A pose at a time: turned about x, then y, then z through the object's origin, then translated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Time (s).
    pub time: f64,
    /// Position of the origin (m).
    pub at: DVec3,
    /// Angles about x, y and z (radians); whole turns count, so that a wheel rolls.
    pub turn: DVec3,
}

/// Keys in ascending order: position and angles change linearly between them, or eased, and are constant outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Keys {
    keys: Vec<Key>,
    ease: bool,
}

impl Keys {
    /// Checks the order of the keys; without any, the motion is the identity.
    ///
    /// # Errors
    /// Times that do not increase, or a number that is not finite.
    pub fn new(keys: Vec<Key>) -> Result<Self> {
        let finite =
            |key: &Key| key.time.is_finite() && key.at.iter().chain(&key.turn).all(|v| v.is_finite());
        if let Some(bad) = keys.iter().position(|key| !finite(key)) {
            return Err(Error::argument(format!("key {} is not finite", bad + 1)));
        }
        match keys.windows(2).position(|pair| pair[0].time >= pair[1].time) {
            Some(bad) => Err(Error::argument(format!("key {} is not later than the key before it", bad + 2))),
            None => Ok(Self { keys, ease: false }),
        }
    }

    /// The same keys with or without ease. With ease the motion starts and ends at rest and passes the keys smoothly: a cubic in each
    /// number, which never leaves the range of the two keys around it. Where a number reverses, or is the same at two keys, it rests.
    pub fn with_ease(self, ease: bool) -> Self {
        Self { ease, ..self }
    }

    /// Rotation and position at a time.
    pub fn at(&self, time: f64) -> (Rotation3<f64>, DVec3) {
        let (at, turn) = self.numbers(time);
        (turned(turn), at)
    }

    /// Upper bound on the rotation of a body between two times (radians): the sum over the angles about the three axes.
    pub fn turning(&self, from: f64, to: f64) -> f64 {
        let mut times = vec![from];
        times.extend(self.breaks(from, to));
        times.push(to);
        // Between two keys each angle is monotonic.
        let turns: Vec<DVec3> = times.into_iter().map(|time| self.numbers(time).1).collect();
        turns.windows(2).map(|pair| (pair[1] - pair[0]).abs().sum()).sum()
    }

    /// Position and angles at a time.
    fn numbers(&self, time: f64) -> (DVec3, DVec3) {
        let next = self.keys.partition_point(|key| key.time <= time);
        match (next.checked_sub(1).map(|index| self.keys[index]), self.keys.get(next).copied()) {
            (Some(_), Some(_)) if self.ease => self.eased(next, time),
            (None, None) => (DVec3::zeros(), DVec3::zeros()),
            (Some(key), None) | (None, Some(key)) => (key.at, key.turn),
            (Some(a), Some(b)) => {
                let part = (time - a.time) / (b.time - a.time);
                (a.at.lerp(&b.at, part), a.turn.lerp(&b.turn, part))
            }
        }
    }

    /// Position and angles on the cubic before key `next`.
    fn eased(&self, next: usize, time: f64) -> (DVec3, DVec3) {
        let (a, b) = (self.keys[next - 1], self.keys[next]);
        let (span, part) = (b.time - a.time, (time - a.time) / (b.time - a.time));
        let (square, cube) = (part * part, part * part * part);
        let number = |of: &dyn Fn(&Key) -> f64| {
            let [begin, end] = [next - 1, next].map(|key| self.slope(key, of) * span);
            // Hermite basis.
            of(&a)
                + (of(&b) - of(&a)) * (3.0 * square - 2.0 * cube)
                + begin * (cube - 2.0 * square + part)
                + end * (cube - square)
        };
        let at = [0, 1, 2].map(|axis| number(&|key| key.at[axis]));
        let turn = [0, 1, 2].map(|axis| number(&|key| key.turn[axis]));
        (at.into(), turn.into())
    }

    /// Slope of a number at a key: 0 at the ends, else the weighted harmonic mean of both sides (Fritsch and Butland 1984), which keeps the
    /// curve between its keys.
    fn slope(&self, key: usize, of: &dyn Fn(&Key) -> f64) -> f64 {
        if key == 0 || key + 1 == self.keys.len() {
            return 0.0;
        }
        let [before, here, after] = [key - 1, key, key + 1].map(|index| &self.keys[index]);
        let (left, right) = (here.time - before.time, after.time - here.time);
        let (below, above) = ((of(here) - of(before)) / left, (of(after) - of(here)) / right);
        if below * above <= 0.0 {
            return 0.0;
        }
        let (first, second) = (2.0 * right + left, right + 2.0 * left);
        (first + second) / (first / below + second / above)
    }

    /// Key times inside an interval.
    pub fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.keys.iter().map(|key| key.time).filter(|&time| time > from && time < to).collect()
    }
}

/// Turned about x, then y, then z. Sines are from crate `libm`: C libraries differ.
fn turned(turn: DVec3) -> Rotation3<f64> {
    let [(sx, cx), (sy, cy), (sz, cz)] = [turn.x, turn.y, turn.z].map(libm::sincos);
    Rotation3::from_matrix_unchecked(Matrix3::new(
        cz * cy,
        cz * sy * sx - sz * cx,
        cz * sy * cx + sz * sx,
        sz * cy,
        sz * sy * sx + cz * cx,
        sz * sy * cx - cz * sx,
        -sy,
        cy * sx,
        cy * cx,
    ))
}

/// A mesh that moves rigidly.
pub struct Rigid {
    faces: Faces,
    /// All vertices of the mesh.
    positions: Vec<DVec3>,
    keys: Keys,
}

impl Rigid {
    /// A mesh (m, in its own space) and its keys; without keys it does not move.
    pub fn new(mesh: TriMesh, keys: Keys) -> Self {
        let mut polygons = PolygonMesh { positions: mesh.positions, ..PolygonMesh::default() };
        mesh.triangles.iter().for_each(|triangle| polygons.push(*triangle));
        Self::of_polygons(polygons, keys)
    }

    /// As [`Rigid::new`], for the mesh of a file: vertices without a face move too, but sweep nothing.
    pub fn of_polygons(polygons: PolygonMesh, keys: Keys) -> Self {
        let (faces, positions) = Faces::new(polygons);
        Self { faces, positions: positions.iter().map(|p| p.cast()).collect(), keys }
    }
}

impl Motion for Rigid {
    fn triangles(&self) -> &[[u32; 3]] {
        self.faces.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.faces.used.count
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.drawn_pose(time, out)?;
        self.faces.used.keep(out);
        Ok(())
    }

    fn pose_as_read(&self, _time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        out.clone_from(&self.positions);
        self.faces.used.keep(out);
        Ok(())
    }

    fn drawn(&self) -> Drawn<'_> {
        self.faces.drawn()
    }

    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let (rotation, at) = self.keys.at(time);
        out.clear();
        out.extend(self.positions.iter().map(|p| rotation * p + at));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.keys.breaks(from, to)
    }

    fn turning(&self, from: f64, to: f64) -> f64 {
        self.keys.turning(from, to)
    }
}

/// Another motion, converted to metres with Y up and moved by keys.
pub struct Placed {
    inner: Box<dyn Motion>,
    space: Space,
    keys: Keys,
}

impl Placed {
    /// `inner` converted from `space`, then turned and moved by the keys.
    pub fn new(inner: Box<dyn Motion>, space: Space, keys: Keys) -> Self {
        Self { inner, space, keys }
    }

    fn place(&self, time: f64, positions: &mut [DVec3]) {
        let (rotation, at) = self.keys.at(time);
        positions.iter_mut().for_each(|p| *p = rotation * self.space.position(*p) + at);
    }
}

impl Motion for Placed {
    fn triangles(&self) -> &[[u32; 3]] {
        self.inner.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.inner.vertex_count()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.inner.pose(time, out)?;
        self.place(time, out);
        Ok(())
    }

    fn pose_as_read(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.inner.pose_as_read(time, out)
    }

    fn drawn(&self) -> Drawn<'_> {
        self.inner.drawn()
    }

    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.inner.drawn_pose(time, out)?;
        self.place(time, out);
        Ok(())
    }

    fn ends_before(&self, time: f64) -> bool {
        self.inner.ends_before(time)
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let mut breaks = self.inner.breaks(from, to);
        breaks.extend(self.keys.breaks(from, to));
        breaks.sort_unstable_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }

    fn turning(&self, from: f64, to: f64) -> f64 {
        self.inner.turning(from, to) + self.keys.turning(from, to)
    }

    fn is_welded(&self) -> bool {
        self.inner.is_welded()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn turns_are_about_x_then_y_then_z() {
        let turn = DVec3::new(0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2);
        let keys = Keys::new(vec![Key { time: 0.0, at: DVec3::x(), turn }]).unwrap();
        let (rotation, at) = keys.at(5.0);
        // z goes to x about y, then to y about z.
        assert!((rotation * DVec3::z() + at - DVec3::new(1.0, 1.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn sines_are_those_of_libm() {
        for step in 0..40_000 {
            let angle = f64::from(step) * 0.000_37 - 3.0;
            let key = Key { time: 0.0, at: DVec3::zeros(), turn: DVec3::new(angle, 0.0, 0.0) };
            let (rotation, _) = Keys::new(vec![key]).unwrap().at(0.0);
            let found = [rotation.matrix()[(2, 1)], rotation.matrix()[(2, 2)]].map(f64::to_bits);
            assert_eq!(found, [libm::sin(angle), libm::cos(angle)].map(f64::to_bits), "at {angle}");
        }
    }

    #[test]
    fn a_wheel_that_rolls_does_not_slip_where_it_touches() {
        let wheel =
            TriMesh { positions: vec![-Vec3::y(), Vec3::zeros(), Vec3::y()], triangles: vec![[0, 1, 2]] };
        let key = |time: f64| Key { time, at: DVec3::z() * time, turn: DVec3::x() * time };
        let wheel = Rigid::new(wheel, Keys::new(vec![key(-1.0), key(1.0)]).unwrap());
        let mut velocity = Vec::new();
        wheel.velocities(-0.5e-3, 1e-3, &mut velocity).unwrap();
        let expected = [DVec3::zeros(), DVec3::z(), DVec3::z() * 2.0];
        velocity.iter().zip(expected).for_each(|(v, e)| assert!((v - e).norm() < 1e-6, "{v} is not {e}"));
    }

    #[test]
    fn ease_starts_and_ends_at_rest_and_has_no_jerk_between() {
        let key = |time: f64, x: f64| Key { time, at: DVec3::x() * x, turn: DVec3::y() * x };
        let keys = vec![key(0.0, 0.0), key(1.0, 1.0), key(3.0, 2.0), key(4.0, 2.0), key(5.0, 1.5)];
        let eased = Keys::new(keys.clone()).unwrap().with_ease(true);
        let x = |time: f64| eased.at(time).1.x;
        keys.iter().for_each(|key| assert!((x(key.time) - key.at.x).abs() < 1e-12));
        let speed = |time: f64| (x(time + 1e-5) - x(time - 1e-5)) / 2e-5;
        for rest in [0.0, 3.0, 4.0, 5.0] {
            assert!(speed(rest).abs() < 1e-3, "{rest}: {}", speed(rest));
        }
        assert!((x(0.5) - 0.5).abs() < 0.1 && x(0.1) < 0.05 && speed(1.0) > 0.3);
        // The speed is continuous at the key, and nothing overshoots.
        assert!((speed(1.0 - 1e-4) - speed(1.0 + 1e-4)).abs() < 1e-3);
        assert!((0..=500).all(|step| (0.0..2.0 + 1e-12).contains(&x(f64::from(step) * 0.01))));
        assert!((300..400).all(|step| x(f64::from(step) * 0.01) == 2.0));
        let two = Keys::new(vec![key(0.0, 0.0), key(1.0, 1.0)]).unwrap().with_ease(true);
        assert!((two.at(0.25).1.x - 0.15625).abs() < 1e-12, "the smooth step");
    }

    #[test]
    fn keys_must_ascend() {
        let key = Key { time: 1.0, at: DVec3::zeros(), turn: DVec3::zeros() };
        assert!(Keys::new(vec![key, key]).is_err());
    }
}
