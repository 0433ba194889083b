//! What a user chooses.

use super::free_fall::Falls;
use super::material::Liquid;
use super::pipes::Border;
use super::solver::viscosity_by_scalar::Thickening;
use crate::error::{Error, Result};

/// Parameters of the flow.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// What flows; blood.
    pub liquid: Liquid,
    /// Gravity (m/s2), which may turn, but points down; (0, -9.81, 0).
    pub gravity: [f64; 3],
    /// omega: the share of a flux that is kept in a second, 0 to 1; 0.5 (thesis 4.1.1). At 1 nothing is lost but by viscosity.
    pub kept: f64,
    /// How a frame is divided into steps.
    pub pace: Pace,
    /// What lies beyond the border of the domain; a wall. Chosen once.
    pub border: Border,
    /// The section A of a pipe in Eq. 4.1.
    pub section: Section,
    /// Where viscosity holds the liquid back. Chosen once.
    pub friction: Friction,
    /// How viscosity depends on what the liquid carries; none: it does not. The scalar has to be there when a frame begins.
    pub thickening: Option<Thickening>,
    /// How liquid falls freely over edges; none: it is below at once. Chosen once.
    pub falls: Option<Falls>,
    /// Where the liquid is slower than this (m/s), and its surface so level that in 1/60 s it would not get faster from rest, it comes to rest; 0 to 0.01.
    /// 1e-6 does well: a micrometre a second on a slope of 6e-6. Pools at rest sleep, and cost nothing; while liquid moves, the test takes a third of a step
    /// more. 0: never; nor beside walls ([`Friction::Walls`]), where what flows drags along
    /// what is beside it.
    pub rest: f64,
}

/// How a frame is divided into steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// As many as stability needs.
    Exact,
    /// Of at most this length (s): where liquid is too deep for that, its waves slow down; films on slopes that would move more than a third of their
    /// depth from cell to cell in a step are held back to that ([`Report::slowed`](super::Report)). 0.003 in the thesis (Table 4.1).
    Realtime(f64),
}

/// The section of a pipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Section {
    /// dx H: what is wet.
    #[default]
    Wetted,
    /// dx^2, as the thesis has it: for comparison.
    Whole,
}

/// Where viscosity holds the liquid back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Friction {
    /// At the ground, as in the thesis: right where the liquid is far wider than deep.
    #[default]
    Ground,
    /// Also at walls and ceilings, and between liquids that flow beside each other: ducts and channels of any width carry what they do in theory, to
    /// a few percent (Galerkin's method with the profile of a film). Films thinner than a sixteenth of a cell cost nothing more; nor does it act
    /// without viscosity, or with [`Section::Whole`]. A closed border is a wall, too. It takes 86 bytes a column.
    Walls,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            liquid: Liquid::BLOOD,
            gravity: [0.0, -9.81, 0.0],
            kept: 0.5,
            pace: Pace::Realtime(0.003),
            border: Border::default(),
            section: Section::default(),
            friction: Friction::default(),
            thickening: None,
            falls: None,
            rest: 0.0,
        }
    }
}

impl Params {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        self.liquid.validate()?;
        let [x, y, z] = self.gravity;
        if !(x.is_finite() && z.is_finite() && (-1e3..=-1e-3).contains(&y)) {
            return Err(Error::argument(format!(
                "gravity = ({x}, {y}, {z}) m/s2 does not point down, by 0.001 to 1000"
            )));
        }
        if x.abs().max(z.abs()) > -y {
            return Err(Error::argument(format!(
                "gravity = ({x}, {y}, {z}) m/s2 leans by more than 45 degrees"
            )));
        }
        if !(0.0..=1.0).contains(&self.kept) {
            return Err(Error::argument(format!("kept = {} is not within 0 to 1", self.kept)));
        }
        if !(0.0..=0.01).contains(&self.rest) {
            return Err(Error::argument(format!("rest = {} m/s is not within 0 to 0.01", self.rest)));
        }
        if let Some(falls) = &self.falls {
            falls.validate()?;
        }
        if let Some(thickening) = &self.thickening {
            thickening.validate()?;
            if self.liquid.viscosity == 0.0 {
                return Err(Error::argument("a liquid without viscosity does not thicken"));
            }
        }
        match self.pace {
            Pace::Realtime(longest) if !(1e-6..=1.0).contains(&longest) => {
                Err(Error::argument(format!("a longest step of {longest} s is not within 0.000001 to 1")))
            }
            _ => Ok(()),
        }
    }
}
