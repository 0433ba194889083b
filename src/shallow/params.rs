//! Parameters of the simulation.

use super::free_fall::Falls;
use super::material::Liquid;
use super::pipes::Border;
use crate::error::{Error, Result};
use crate::numeric::checks::{check_within, ensure};

/// Parameters of the flow.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// The liquid. Default: blood.
    pub liquid: Liquid,
    /// Gravity (m/s2); its direction may change but must point down. Default: (0, -9.81, 0).
    pub gravity: [f64; 3],
    /// omega: the share of a flux that is kept in a second, 0 to 1. Default: 0.5 (thesis 4.1.1). At 1 only viscosity dissipates.
    pub kept: f64,
    /// How a frame is divided into steps.
    pub pace: TimeStepping,
    /// What lies beyond the border of the domain. Default: a wall. Fixed at creation.
    pub border: Border,
    /// The cross-section A of a pipe in Eq. 4.1.
    pub section: Section,
    /// Where viscous drag acts. Fixed at creation.
    pub friction: Friction,
    /// How viscosity depends on a scalar; None: it does not. The scalar must exist when a frame begins.
    pub thickening: Option<Thickening>,
    /// How liquid falls freely over edges; None: it arrives below at once. Fixed at creation.
    pub falls: Option<Falls>,
    /// Speed (m/s), 0 to 0.01, below which liquid comes to rest where its surface is also so level that, starting from rest, it would not
    /// exceed this speed within 1/60 s. 1e-6 works well: a micrometre a second, and a slope of 6e-6. Pools at rest sleep and cost nothing;
    /// while liquid moves, the test makes a step a third slower. With 0, liquid never comes to rest. It has no effect with wall friction
    /// ([`Friction::Walls`]), where flowing liquid drags along what is beside it.
    pub rest: f64,
}

/// How a frame is divided into steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeStepping {
    /// As many steps as stability needs.
    Exact,
    /// Steps of at most this length (s): where liquid is too deep for them, its waves slow down. Films on slopes that would move more than
    /// a third of their depth from cell to cell in a step are limited to a third ([`Report::slowed`](super::Report)). 0.003 in the thesis
    /// (Table 4.1).
    Realtime(f64),
}

/// The cross-section of a pipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Section {
    /// dx H: the wetted section.
    #[default]
    Wetted,
    /// dx^2, as in the thesis: for comparison.
    Whole,
}

/// Where viscous drag acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Friction {
    /// At the ground, as in the thesis: accurate where the liquid is far wider than deep.
    #[default]
    Ground,
    /// Also at walls and ceilings, and between liquids that flow side by side: the discharge of ducts and channels of any width agrees with
    /// theory to a few percent (Galerkin's method with the profile of a film). Films thinner than a sixteenth of a cell take no more time.
    /// It has no effect without viscosity, or with [`Section::Whole`]. A closed border is a wall, too. Takes 86 more bytes a column.
    Walls,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            liquid: Liquid::BLOOD,
            gravity: [0.0, -9.81, 0.0],
            kept: 0.5,
            pace: TimeStepping::Realtime(0.003),
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
        ensure(
            x.is_finite() && z.is_finite() && (-1e3..=-1e-3).contains(&y),
            format_args!("gravity = ({x}, {y}, {z}) m/s2 does not point down by 0.001 to 1000"),
        )?;
        ensure(
            x.abs().max(z.abs()) <= -y,
            format_args!("gravity = ({x}, {y}, {z}) m/s2 leans by more than 45 degrees"),
        )?;
        check_within("kept", self.kept, "", 0.0..=1.0)?;
        check_within("rest", self.rest, " m/s", 0.0..=0.01)?;
        if let Some(falls) = &self.falls {
            falls.validate()?;
        }
        if let Some(thickening) = &self.thickening {
            thickening.validate()?;
            ensure(self.liquid.viscosity != 0.0, "a liquid without viscosity does not thicken")?;
        }
        match self.pace {
            TimeStepping::Realtime(longest) if !(1e-6..=1.0).contains(&longest) => {
                Err(Error::argument(format!("a longest step of {longest} s is not within 0.000001 to 1")))
            }
            _ => Ok(()),
        }
    }
}

/// How viscosity depends on a scalar: it is the liquid's own up to the concentration `from`, `times` as high from `to` on, and linear in
/// between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thickening {
    /// Index of the scalar: an age for blood that clots; a dye for mixtures.
    pub scalar: usize,
    /// Concentration up to which viscosity is the liquid's own, in the scalar's own unit.
    pub from: f64,
    /// Concentration from which on viscosity is `times` the liquid's own; it may be below `from`.
    pub to: f64,
    /// Factor of the viscosity from `to` on: 1e-6 to 1e9.
    pub times: f64,
}

impl Thickening {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        let Self { from, to, times, .. } = *self;
        ensure(
            from.is_finite() && to.is_finite() && from != to,
            format_args!("thickening.from = {from} and thickening.to = {to} are not finite and different"),
        )?;
        if !(1e-6..=1e9).contains(&times) {
            return Err(Error::argument(format!("thickening.times = {times} is not within 1e-6 to 1e9")));
        }
        Ok(())
    }
}
