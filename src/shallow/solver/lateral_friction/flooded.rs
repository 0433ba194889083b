//! Lateral friction of the pipes of full columns, one at a time. Their heads come from a separate system, which uses the last step's flow
//! beside them.

use super::LateralFriction;
use super::surroundings::{self, Room};
use crate::shallow::columns::STRIP;
use crate::shallow::pipes::cliffs;
use crate::shallow::pipes::side::Side;
use crate::shallow::solver::pressurised::edges::PipeIndex;
use crate::shallow::solver::pressurised::network::State;
use crate::shallow::solver::viscous_flux::{Step, min};

/// Friction of a pipe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PipeFriction {
    /// Friction at the ground and at a ceiling, relative to that below a free surface.
    pub ground: f64,
    /// Lateral friction, as a fraction of the pipe's flux.
    pub lateral: f64,
    /// Flux added by the liquid beside the pipe (units per step).
    pub dragged: f64,
}

impl PipeFriction {
    /// Friction at the ground only.
    const NONE: Self = Self { ground: 1.0, lateral: 0.0, dragged: 0.0 };
}

/// Friction factor below a ceiling: 12 nu / H^2 instead of 3 nu / H^2.
const CEILING: f64 = 4.0;

impl LateralFriction {
    /// Lateral friction of a pipe of full columns between i and j, which may be the outside; `full` says which of them are full.
    pub fn of_pipe(&self, state: &State, at: PipeIndex, [i, j]: [usize; 2], full: [bool; 2]) -> PipeFriction {
        let State { step, columns, .. } = *state;
        if step.lateral == 0.0 {
            return PipeFriction::NONE;
        }
        let ends = if j < columns.len() { 2 } else { 1 };
        let of = |is_full: bool| if is_full { CEILING } else { 1.0 };
        let ground = if ends == 2 { 0.5 * (of(full[0]) + of(full[1])) } else { of(full[0]) };
        let (axis, sides) = match at {
            PipeIndex::East(_) => (0, [Side::North, Side::South]),
            PipeIndex::South(_) => (1, [Side::West, Side::East]),
            PipeIndex::Link(_) => return PipeFriction { ground, ..PipeFriction::NONE },
        };
        let rooms = rooms(state, [i, j]);
        let mean = mean(rooms);
        let rise = (columns.bases()[i] - columns.bases()[j]) as f32 / step.cell;
        let lateral = f64::from(step.lateral) * f64::from(1.0 + min(rise * rise, 3.0));
        let of_end = |end: usize| {
            let column = [i, j][end];
            let beyond = sides.map(|side| {
                let is_linked = self.linked[column / STRIP][side as usize] >> (column % STRIP) & 1 == 1;
                (
                    cliffs::index_beyond(columns, column, side).map_or(ABSENT, |other| room(state, other)),
                    is_linked,
                )
            });
            if full[end] {
                both_sides::<true>(step, rooms[end], beyond)
            } else {
                both_sides::<false>(step, rooms[end], beyond)
            }
        };
        let [one, other] = [0, 1].map(of_end);
        let [before, behind, walls] = [0, 1, 2].map(|which| 0.5 * (one[which] + other[which]));
        let resistance = f64::from((before + behind) + walls);
        let dragged = [0, 1].map(|side| {
            let others = [i, j].map(|column| cliffs::index_beyond(columns, column, sides[side]));
            let [Some(first), Some(second)] = others else { return 0.0 };
            let depth = self::mean(self::rooms(state, [first, second]));
            let contact = [before, behind][side];
            f64::from(min(contact / depth.max(1.0), 1.0) * state.flux[axis][first])
        });
        let dragged = dragged[0] + dragged[1];
        PipeFriction {
            ground,
            lateral: lateral * resistance / f64::from(mean.max(1.0)),
            dragged: lateral * f64::from(step.step_ratio) * dragged,
        }
    }
}

/// Stands in for an absent column.
const ABSENT: Room = Room { base: 0, ceiling: 0, depth: 0 };

fn room(state: &State, i: usize) -> Room {
    let columns = state.columns;
    Room { base: columns.bases()[i], ceiling: columns.ceilings()[i], depth: state.depth[i] }
}

/// The columns of a pipe, cut at the top of the opening between both.
fn rooms(state: &State, ends: [usize; 2]) -> [Room; 2] {
    let rooms = ends.map(|i| room(state, i));
    let top = rooms[0].ceiling.min(rooms[1].ceiling);
    rooms.map(|room| Room { depth: room.depth.min(top - room.base).max(0), ..room })
}

fn mean(rooms: [Room; 2]) -> f32 {
    0.5 * (rooms[0].depth as f32 + rooms[1].depth as f32)
}

/// Both sides of a column, given the columns there and whether links lead over them: contact over the first and the second, and walls
/// (units).
fn both_sides<const FULL: bool>(step: &Step, own: Room, beyond: [(Room, bool); 2]) -> [f32; 3] {
    if own.depth <= 0 {
        return [0.0; 3];
    }
    let (high, inverse) = (own.depth as f32, 1.0 / own.depth as f32);
    let [one, two] = beyond
        .map(|(beyond, is_linked)| surroundings::side::<FULL, true>(step, own, inverse, beyond, is_linked));
    [one[0], two[0], surroundings::walls::<FULL>(step, high, inverse, [one[1], two[1]])]
}
