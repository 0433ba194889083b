//! Grains and how they move: sub-steps of [`super::solve`] between sortings.

use rayon::prelude::*;

use super::contacts::{Contacts, GONE, MOST, SKIN};
use super::field::Field;
use super::layout::{At, Layout, locate, world};
use super::rows::{Row, V, norm, sub};
pub use super::shell::Shell;
use super::solve::{Coefficients, sub_step};
use super::touch::{self, Touch};
use crate::base::DVec3;
use crate::context::Context;
use crate::error::{Error, Result};

/// A level plane that grains lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Height (m).
    pub height: f64,
    /// Friction against it.
    pub friction: f32,
}

/// Writes the places (m) of a mesh's vertices at a share 0..=1 of a step.
pub type Pose<'a> = Box<dyn Fn(f64, &mut Vec<DVec3>) -> Result<()> + Send + Sync + 'a>;

/// What grains cannot move.
#[derive(Default)]
pub struct Colliders<'a> {
    /// A level plane.
    pub floor: Option<Floor>,
    /// Level sets that rest during the step.
    pub fields: Vec<Field<'a>>,
    /// Meshes that move, each with its pose (m) at a share 0..=1 of the step.
    pub shells: Vec<(Shell, Pose<'a>)>,
}

/// Collider number of the floor.
const FLOOR: u32 = 0;

/// Grains with their contacts.
#[derive(Clone)]
pub struct Heap {
    pub(super) diameter: f64,
    pub(super) rows: Vec<Row>,
    pub(super) ids: Vec<u32>,
    pub(super) at: Vec<At>,
    /// Place of each grain when they were sorted (diameters).
    anchors: Vec<V>,
    layout: Layout,
    pub(super) contacts: Contacts,
    pub(super) touches: Vec<Touch>,
    /// Whether grains were added or have moved so far that neighbours must be found again.
    is_stale: bool,
}

/// How a step is divided.
#[derive(Debug, Clone, Copy)]
pub struct Division {
    /// Length of the step (s).
    pub dt: f64,
    /// Sub-steps.
    pub sub_steps: usize,
}

impl Heap {
    /// No grains yet, of a diameter (m).
    pub fn new(diameter: f64) -> Self {
        Self {
            diameter,
            rows: Vec::new(),
            ids: Vec::new(),
            at: Vec::new(),
            anchors: Vec::new(),
            layout: Layout::default(),
            contacts: Contacts::default(),
            touches: Vec::new(),
            is_stale: true,
        }
    }

    /// Number of grains.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Adds a grain with an identity, at a place (m) with a velocity (m/s).
    ///
    /// # Errors
    /// A place too far away; too many grains.
    pub fn add(&mut self, id: u32, place: DVec3, velocity: V) -> Result<()> {
        let (at, place) = locate(place, self.diameter);
        if !Layout::holds(at) {
            return Err(Error::argument("a grain is too far from the origin"));
        }
        if self.rows.len() >= MOST {
            return Err(Error::argument(format!("there are more than {MOST} grains")));
        }
        self.rows.push(Row { place, weight: 1.0, velocity, ..Row::default() });
        self.ids.push(id);
        self.at.push(at);
        self.is_stale = true;
        Ok(())
    }

    /// Leaves out the grains below a height (m).
    pub fn drop_below(&mut self, height: f64) {
        let diameter = self.diameter;
        let mut is_any = false;
        for (row, at) in self.rows.iter().zip(&mut self.at) {
            if world(*at, row.place, diameter).y < height {
                *at = Layout::NOWHERE;
                is_any = true;
            }
        }
        if is_any {
            self.sort();
        }
    }

    /// Identities, in the order of the places.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Velocities (m/s).
    pub fn velocities(&self) -> impl Iterator<Item = V> + '_ {
        self.rows.iter().map(|row| row.velocity)
    }

    /// Places (m).
    pub fn places(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.rows.iter().zip(&self.at).map(|(row, at)| world(*at, row.place, self.diameter))
    }

    /// Places as a block and a place within it (diameters).
    pub fn located(&self) -> impl Iterator<Item = (At, V)> + '_ {
        self.rows.iter().zip(&self.at).map(|(row, at)| (*at, row.place))
    }

    /// Largest speed (m/s).
    pub fn fastest(&self) -> f32 {
        self.rows.par_iter().map(|row| norm(row.velocity)).reduce(|| 0.0, f32::max)
    }

    /// Moves the grains through a step.
    ///
    /// # Errors
    /// Cancel; a pose that cannot be computed; a grid that cannot be read.
    pub fn step(
        &mut self,
        ctx: &Context,
        division: Division,
        coefficients: Coefficients,
        colliders: &mut Colliders<'_>,
    ) -> Result<()> {
        let dt = division.dt / division.sub_steps as f64;
        let mut still: Vec<Touch> = Vec::new();
        let mut pose = Vec::new();
        for (shell, at) in &mut colliders.shells {
            at(0.0, &mut pose)?;
            shell.follow(&pose);
        }
        let mut moved = 0.0;
        self.is_stale = true;
        for sub in 0..division.sub_steps {
            ctx.check()?;
            if self.is_stale || 2.0 * moved > SKIN {
                self.sort();
                still = self.still(colliders, dt)?;
            }
            let mut touches = still.clone();
            for (shell, at) in &mut colliders.shells {
                at((sub + 1) as f64 / division.sub_steps as f64, &mut pose)?;
                shell.follow(&pose);
                touches.extend(shell.touches(&self.layout, &self.rows, self.diameter, dt));
            }
            touch::carry(&mut touches, &self.touches);
            touch::release_pressed(&mut touches);
            self.touches = touches;
            sub_step(&mut self.rows, &mut self.contacts, &mut self.touches, &self.layout, &coefficients);
            moved = self.farthest();
        }
        Ok(())
    }

    /// How far a grain has come since the grains were sorted (diameters), at most.
    fn farthest(&self) -> f32 {
        let way = |(row, anchor): (&Row, &V)| norm(sub(row.place, *anchor));
        self.rows.par_iter().zip(&self.anchors).map(way).reduce(|| 0.0, f32::max)
    }

    /// Sorts the grains and finds their neighbours.
    fn sort(&mut self) {
        let mut slots = vec![GONE; self.rows.len()];
        let from = self.layout.sort(&mut self.rows, &mut self.ids, &mut self.at);
        from.iter().enumerate().for_each(|(slot, &was)| slots[was as usize] = slot as u32);
        self.contacts.find(&self.layout, &mut self.rows, &slots);
        touch::rename(&mut self.touches, &slots);
        self.anchors.clear();
        self.anchors.extend(self.rows.iter().map(|row| row.place));
        self.is_stale = false;
    }

    /// Touches with what does not move, for as long as the sorting lasts.
    fn still(&self, colliders: &Colliders<'_>, dt: f64) -> Result<Vec<Touch>> {
        let reach = (2.0 * dt / self.diameter) as f32;
        let mut touches = Vec::new();
        if let Some(floor) = colliders.floor {
            let near = self.rows.iter().zip(&self.at).enumerate().filter_map(|(slot, (row, at))| {
                // From the block's lower side to the floor (diameters).
                let height =
                    (floor.height / self.diameter - f64::from(at[1]) * f64::from(super::layout::EDGE)) as f32;
                let gap = row.place[1] - height - 0.5;
                (gap < SKIN + norm(row.velocity) * reach).then_some(Touch {
                    grain: slot as u32,
                    collider: FLOOR,
                    normal: [0.0, 1.0, 0.0],
                    offset: height + 0.5,
                    velocity: [0.0; 3],
                    friction: floor.friction,
                    impulse: 0.0,
                    across: [0.0; 3],
                })
            });
            touches.extend(near);
        }
        for field in &colliders.fields {
            touches.extend(field.touches(&self.layout, &self.rows, self.diameter, reach)?);
        }
        Ok(touches)
    }

    /// Overlaps (diameters) of the pairs that touch, for tests and reports.
    pub fn overlaps(&self) -> Vec<f32> {
        let owners = 0..self.contacts.starts.len().saturating_sub(1);
        let overlap = |owner: usize, at: usize| {
            let other = self.contacts.pairs[at].other();
            1.0 - norm(self.layout.apart(&self.rows, owner, other))
        };
        let all = owners.flat_map(|owner| self.contacts.of(owner).map(move |at| (owner, at)));
        let near = all.map(|(owner, at)| overlap(owner, at)).filter(|overlap| *overlap > -0.02);
        near.map(|overlap| overlap.max(0.0)).collect()
    }
}
