//! Rigid motion by keys, of a mesh or over another motion.

use nalgebra::Rotation3;

use super::{Motion, Space};
use crate::base::{DVec3, TriMesh};
use crate::error::{Error, Result};

/// A pose at a time: turned about x, then y, then z through the object's origin, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// When (s).
    pub time: f64,
    /// Where the origin is (m).
    pub at: DVec3,
    /// Angles about x, y and z (radians); whole turns count, so that a wheel rolls.
    pub turn: DVec3,
}

/// Keys in ascending order: place and angles change linearly between them, and rest outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Keys(Vec<Key>);

impl Keys {
    /// Checks the order of the keys; none at all is the identity.
    ///
    /// # Errors
    /// Times that do not rise, or a number that is not finite.
    pub fn new(keys: Vec<Key>) -> Result<Self> {
        let finite =
            |key: &Key| key.time.is_finite() && key.at.iter().chain(&key.turn).all(|v| v.is_finite());
        if let Some(bad) = keys.iter().position(|key| !finite(key)) {
            return Err(Error::argument(format!("key {} is not finite", bad + 1)));
        }
        match keys.windows(2).position(|pair| pair[0].time >= pair[1].time) {
            Some(bad) => Err(Error::argument(format!("key {} is not later than the key before it", bad + 2))),
            None => Ok(Self(keys)),
        }
    }

    /// Rotation and place at a time.
    pub fn at(&self, time: f64) -> (Rotation3<f64>, DVec3) {
        let next = self.0.partition_point(|key| key.time <= time);
        let (at, turn) = match (next.checked_sub(1).map(|index| self.0[index]), self.0.get(next)) {
            (None, None) => (DVec3::zeros(), DVec3::zeros()),
            (Some(key), None) => (key.at, key.turn),
            (None, Some(key)) => (key.at, key.turn),
            (Some(a), Some(b)) => {
                let part = (time - a.time) / (b.time - a.time);
                (a.at.lerp(&b.at, part), a.turn.lerp(&b.turn, part))
            }
        };
        (Rotation3::from_euler_angles(turn.x, turn.y, turn.z), at)
    }

    /// Key times inside an interval.
    pub fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.0.iter().map(|key| key.time).filter(|&time| time > from && time < to).collect()
    }
}

/// A mesh that moves rigidly.
pub struct Rigid {
    triangles: Vec<[u32; 3]>,
    positions: Vec<DVec3>,
    keys: Keys,
}

impl Rigid {
    /// A mesh (m, in its own space) and its keys; without keys it stands still.
    pub fn new(mesh: TriMesh, keys: Keys) -> Self {
        let positions = mesh.positions.iter().map(|p| p.cast()).collect();
        Self { triangles: mesh.triangles, positions, keys }
    }
}

impl Motion for Rigid {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let (rotation, at) = self.keys.at(time);
        out.clear();
        out.extend(self.positions.iter().map(|p| rotation * p + at));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.keys.breaks(from, to)
    }
}

/// Another motion, brought into metres with Y up and carried along by keys.
pub struct Placed {
    inner: Box<dyn Motion>,
    space: Space,
    keys: Keys,
}

impl Placed {
    /// `inner` as it moves in `space`, then turned and moved by the keys.
    pub fn new(inner: Box<dyn Motion>, space: Space, keys: Keys) -> Self {
        Self { inner, space, keys }
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
        let (rotation, at) = self.keys.at(time);
        out.iter_mut().for_each(|p| *p = rotation * self.space.place(*p) + at);
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

    fn keeps_its_welds(&self) -> bool {
        self.inner.keeps_its_welds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Vec3;

    #[test]
    fn turns_are_about_x_then_y_then_z() {
        let turn = DVec3::new(0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2);
        let keys = Keys::new(vec![Key { time: 0.0, at: DVec3::x(), turn }]).unwrap();
        let (rotation, at) = keys.at(5.0);
        // z goes to x about y, then to y about z.
        assert!((rotation * DVec3::z() + at - DVec3::new(1.0, 1.0, 0.0)).norm() < 1e-12);
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
    fn keys_must_rise() {
        let key = Key { time: 1.0, at: DVec3::zeros(), turn: DVec3::zeros() };
        assert!(Keys::new(vec![key, key]).is_err());
    }
}
