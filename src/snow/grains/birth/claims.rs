//! Decides which object removed the snow at a position when objects have different compression: the one whose surface comes
//! nearest to the position at one of `MOMENTS` moments from the start to the end of the step; the first of equals.

use crate::error::Result;
use crate::geometry::DVec3;
use crate::snow::bounds::bounds;
use crate::snow::grains::colliders::shell::Shell;
use crate::snow::grains::surroundings::{Bounds, Object};

/// Count of poses that are examined in a step.
const MOMENTS: u32 = 9;

/// Share of the removed snow that becomes grains.
pub enum Claims {
    /// The same everywhere.
    One(f64),
    /// That of the object that took the snow.
    Each(Vec<Claim>),
}

/// An object that may have taken snow.
pub struct Claim {
    share: f64,
    /// Its mesh at each moment.
    meshes: Vec<Shell>,
    /// Bounding box (m) of all of them.
    bounds: Bounds,
}

impl Claims {
    /// Claims of the objects that remove snow from `from` to `to` (s); `compression` is the default compression, for objects that have none of
    /// their own.
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn new(objects: &[Object<'_>], compression: f64, [from, to]: [f64; 2]) -> Result<Self> {
        let share = |object: &Object<'_>| 1.0 - object.compression.unwrap_or(compression);
        let removing: Vec<_> = objects.iter().filter(|object| object.removes).collect();
        let first = removing.first().map_or(1.0 - compression, |object| share(object));
        if removing.iter().all(|object| share(object) == first) {
            return Ok(Self::One(first));
        }
        let claim = |object: &&Object<'_>| {
            let motion = object.body.motion();
            let (mut meshes, mut positions) = (Vec::new(), Vec::new());
            for moment in 0..MOMENTS {
                let part = f64::from(moment) / f64::from(MOMENTS - 1);
                let mut pose = Vec::new();
                motion.pose(from + (to - from) * part, &mut pose)?;
                positions.extend(bounds(&pose));
                meshes.push(Shell::at_rest(motion.triangles().to_vec(), pose));
            }
            Ok(Claim { share: share(object), meshes, bounds: bounds(&positions) })
        };
        Ok(Self::Each(removing.iter().map(claim).collect::<Result<_>>()?))
    }

    /// The claims that reach into a box (m).
    pub fn in_box(&self, around: &Bounds) -> ClaimsHere<'_> {
        match self {
            Self::One(share) => ClaimsHere { share: *share, claims: Vec::new() },
            Self::Each(all) => {
                let claims: Vec<&Claim> = all.iter().filter(|claim| claim.reaches(around)).collect();
                match claims[..] {
                    [only] => ClaimsHere { share: only.share, claims: Vec::new() },
                    [] => ClaimsHere { share: all[0].share, claims: all.iter().collect() },
                    _ => ClaimsHere { share: claims[0].share, claims },
                }
            }
        }
    }
}

/// Claims that reach into a box.
pub struct ClaimsHere<'a> {
    /// Used where no surface is found.
    share: f64,
    claims: Vec<&'a Claim>,
}

impl ClaimsHere<'_> {
    /// Share of the snow at a position (m) that becomes grains.
    pub fn share(&self, position: DVec3) -> f64 {
        let mut best = (f64::INFINITY, self.share);
        for claim in &self.claims {
            for mesh in &claim.meshes {
                // Only surfaces nearer than the best so far.
                if let Some(distance) =
                    mesh.distance(position, best.0.min(MAX_DISTANCE)).filter(|near| *near < best.0)
                {
                    best = (distance, claim.share);
                }
            }
        }
        best.1
    }
}

/// Search distance for surfaces (m).
const MAX_DISTANCE: f64 = 1.0e6;
/// Margin around the box of an object, for its noise (share of a block).
const MARGIN: f64 = 0.5;

impl Claim {
    /// Whether the object may have taken snow in a box.
    fn reaches(&self, [low, high]: &Bounds) -> bool {
        let margin = (high - low) * MARGIN;
        (0..3).all(|axis| {
            self.bounds[0][axis] <= high[axis] + margin[axis]
                && self.bounds[1][axis] >= low[axis] - margin[axis]
        })
    }
}
