//! Lateral friction of the pipes of full columns, one at a time. Their heads come from a separate system, which uses the last step's flow
//! beside them.

use super::Walls;
use super::beside::{self, Room};
use crate::shallow::columns::{Columns, STRIP};
use crate::shallow::pipes::cliffs;
use crate::shallow::pipes::side::Side;
use crate::shallow::solver::pressurised::edges::At;
use crate::shallow::solver::pressurised::network::State;
use crate::shallow::solver::viscous_flux::{Step, min};

/// Friction of a pipe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Friction at the ground and at a ceiling, relative to that below a free surface.
    pub ground: f64,
    /// Lateral friction, as part of the pipe's flux.
    pub held: f64,
    /// Flux added by the liquid beside the pipe (units a step).
    pub taken: f64,
}

impl Beside {
    /// Friction at the ground only.
    const NONE: Self = Self { ground: 1.0, held: 0.0, taken: 0.0 };
}

/// Friction factor below a ceiling: 12 nu / H^2 instead of 3 nu / H^2.
const CEILING: f64 = 4.0;

impl Walls {
    /// Lateral friction of a pipe of full columns between i and j, which may be the outside; `full` says which of them are full.
    pub(in crate::shallow::solver) fn beside(
        &self,
        step: &Step,
        columns: &Columns,
        state: &State,
        at: At,
        [i, j]: [usize; 2],
        full: [bool; 2],
    ) -> Beside {
        if step.lateral == 0.0 {
            return Beside::NONE;
        }
        let ends = if j < columns.len() { 2 } else { 1 };
        let of = |is_full: bool| if is_full { CEILING } else { 1.0 };
        let ground = if ends == 2 { 0.5 * (of(full[0]) + of(full[1])) } else { of(full[0]) };
        let (axis, sides) = match at {
            At::East(_) => (0, [Side::North, Side::South]),
            At::South(_) => (1, [Side::West, Side::East]),
            At::Link(_) => return Beside { ground, ..Beside::NONE },
        };
        let rooms = rooms(columns, state, [i, j]);
        let mean = mean(rooms);
        let rise = (columns.bases()[i] - columns.bases()[j]) as f32 / step.cell;
        let lateral = f64::from(step.lateral) * f64::from(1.0 + min(rise * rise, 3.0));
        let of_end = |end: usize| {
            let column = [i, j][end];
            let beyond = sides.map(|side| {
                let is_linked = self.linked[column / STRIP][side as usize] >> (column % STRIP) & 1 == 1;
                (
                    cliffs::beside(columns, column, side).map_or(ABSENT, |other| room(columns, state, other)),
                    is_linked,
                )
            });
            if full[end] {
                over::<true>(step, rooms[end], beyond)
            } else {
                over::<false>(step, rooms[end], beyond)
            }
        };
        let [one, other] = [0, 1].map(of_end);
        let [before, behind, walls] = [0, 1, 2].map(|which| 0.5 * (one[which] + other[which]));
        let held = f64::from((before + behind) + walls);
        let taken = [0, 1].map(|side| {
            let others = [i, j].map(|column| cliffs::beside(columns, column, sides[side]));
            let [Some(first), Some(second)] = others else { return 0.0 };
            let depth = self::mean(self::rooms(columns, state, [first, second]));
            let contact = [before, behind][side];
            f64::from(min(contact / depth.max(1.0), 1.0) * state.flux[axis][first])
        });
        let taken = taken[0] + taken[1];
        Beside {
            ground,
            held: lateral * held / f64::from(mean.max(1.0)),
            taken: lateral * f64::from(step.again) * taken,
        }
    }
}

/// Stands in for an absent column.
const ABSENT: Room = Room { base: 0, ceiling: 0, depth: 0 };

fn room(columns: &Columns, state: &State, i: usize) -> Room {
    Room { base: columns.bases()[i], ceiling: columns.ceilings()[i], depth: state.depth[i] }
}

/// The columns of a pipe, cut at the top of the opening between both.
fn rooms(columns: &Columns, state: &State, ends: [usize; 2]) -> [Room; 2] {
    let rooms = ends.map(|i| room(columns, state, i));
    let top = rooms[0].ceiling.min(rooms[1].ceiling);
    rooms.map(|room| Room { depth: room.depth.min(top - room.base).max(0), ..room })
}

fn mean(rooms: [Room; 2]) -> f32 {
    0.5 * (rooms[0].depth as f32 + rooms[1].depth as f32)
}

/// Both sides of a column, given the columns there and whether links lead over them: contact over the first and the second, and walls
/// (units).
fn over<const FULL: bool>(step: &Step, own: Room, beyond: [(Room, bool); 2]) -> [f32; 3] {
    if own.depth <= 0 {
        return [0.0; 3];
    }
    let (high, inverse) = (own.depth as f32, 1.0 / own.depth as f32);
    let [one, two] =
        beyond.map(|(beyond, is_linked)| beside::side::<FULL, true>(step, own, inverse, beyond, is_linked));
    [one[0], two[0], beside::walls::<FULL>(step, high, inverse, [one[1], two[1]])]
}
