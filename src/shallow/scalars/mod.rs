//! Scalars that the liquid carries: dye, concentrations, age, temperature.
//!
//! A column holds an *amount* of each, an integer: its concentration times its depth (`shares.rs`). A transfer moves the same share of a
//! column's amounts as of its liquid, at the concentration at the start of the step (upwind), so that amounts are neither lost nor created:
//! [`Shallow::scalar_balance`] counts them. Concentrations stay between those of the inflows, to within about a level (2^-20 of their
//! range), and a uniform one stays uniform.

pub(super) mod amounts;
mod law;
pub(super) mod shares;

use super::columns::STRIP;
use super::columns::runs::fill_runs;
use super::system::Shallow;
use crate::error::{Error, Result};
use crate::numeric::checks::{check_each, check_room, ensure};
use crate::numeric::cpu::dispatch;
use amounts::{ACCOUNTS, Account, Amounts};
pub(super) use law::check_scalar;
pub use law::{Law, Scalar};
pub use shares::MAX_SCALARS;
use shares::{LEVELS, Levels};

/// Where all of a scalar is: concentration x volume (its own unit x m3).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ScalarBalance {
    /// In the columns.
    pub inside: f64,
    /// Poured in so far, less what negative pours removed.
    pub poured: f64,
    /// Added by sources.
    pub sourced: f64,
    /// Removed by drains.
    pub drained: f64,
    /// Removed by absorbers.
    pub absorbed: f64,
    /// Lost over the border, or into the void.
    pub lost: f64,
    /// Entered over an absorbing border.
    pub gained: f64,
    /// Waiting for room after the terrain moved.
    pub held: f64,
    /// In the air ([`Params::falls`](super::Params)).
    pub falling: f64,
    /// Added by its law; negative: removed.
    pub grown: f64,
    /// Removed from columns that ran dry: the remainders of rounding.
    pub dried: f64,
    /// Unaccounted for, as an integer amount: always 0.
    pub error: i128,
}

impl Shallow {
    /// Sets the scalars that the liquid carries, replacing previous ones. All amounts are 0 at first, and so are the concentrations of
    /// poured liquid and of sources, until [`Shallow::set_poured`] and [`Shallow::set_sourced`]. Frames allocate nothing for scalars.
    ///
    /// # Errors
    /// `Argument`: more than [`MAX_SCALARS`] scalars; one that [`Scalar::validate`] refuses; two of the same name.
    pub fn set_scalars(&mut self, scalars: &[Scalar]) -> Result<()> {
        ensure(
            scalars.len() <= MAX_SCALARS,
            format_args!("{} scalars: at most {MAX_SCALARS} are allowed", scalars.len()),
        )?;
        for (at, scalar) in scalars.iter().enumerate() {
            scalar.validate().map_err(|error| Error::argument(format!("scalar {at}: {error}")))?;
            if scalars[..at].iter().any(|other| other.name == scalar.name) {
                return Err(Error::argument(format!("two scalars have the name {:?}", scalar.name)));
            }
        }
        self.flow.set_scalars(&self.columns, Amounts::new(scalars.to_vec(), self.columns.len() + STRIP));
        self.flow_points.clear_levels();
        self.remap.held.forget_amounts();
        self.falls.forget_amounts();
        Ok(())
    }

    /// The scalars that the liquid carries.
    pub fn scalars(&self) -> &[Scalar] {
        &self.flow.amounts.scalars
    }

    /// Sets the concentration of each scalar in what [`Shallow::pour`], [`Shallow::pour_at`] and [`Shallow::fill`] pour from now on;
    /// initially 0.
    ///
    /// # Errors
    /// `Argument`: a count other than that of the scalars, or a concentration beyond its range.
    pub fn set_poured(&mut self, concentrations: &[f64]) -> Result<()> {
        self.flow.amounts.poured = self.levels(concentrations)?;
        Ok(())
    }

    /// Sets the concentration of each scalar in the liquid of a flow point that is a source; 0 after [`Shallow::set_flows`].
    ///
    /// # Errors
    /// `Argument`: no such point; a count other than that of the scalars; a concentration beyond its range.
    pub fn set_sourced(&mut self, point: usize, concentrations: &[f64]) -> Result<()> {
        let levels = self.levels(concentrations)?;
        self.flow_points.set_levels(point, levels)
    }

    fn levels(&self, concentrations: &[f64]) -> Result<Levels> {
        let scalars = self.scalars();
        check_each(concentrations.len(), "concentrations", scalars.len(), "scalars")?;
        let mut levels = [0; MAX_SCALARS];
        for ((level, scalar), concentration) in levels.iter_mut().zip(scalars).zip(concentrations) {
            *level = scalar.level(*concentration)?;
        }
        Ok(levels)
    }

    /// The concentration of a scalar in a column; 0 where it is dry.
    ///
    /// # Panics
    /// If there is no such scalar or column.
    pub fn concentration(&self, scalar: usize, column: usize) -> f32 {
        self.flow.amounts.concentration(scalar, column, self.flow.depths()[column])
    }

    /// As [`Shallow::concentration`], for every column index.
    ///
    /// # Errors
    /// `Argument`: no such scalar, or `out` does not have one element for each index.
    pub fn concentrations(&self, scalar: usize, out: &mut [f32]) -> Result<()> {
        check_scalar(scalar, self.scalars().len())?;
        check_room(out.len(), "concentrations", self.columns.len(), "indices")?;
        fill_runs(self.flow.active(), out, |strips, out| {
            let run = strips.start * STRIP..strips.end * STRIP;
            let depth = &self.flow.depths()[run.clone()];
            find_concentrations(&self.flow.amounts, scalar, depth, run.start, out);
        });
        Ok(())
    }

    /// Where all of a scalar is.
    ///
    /// # Errors
    /// `Argument`: no such scalar.
    pub fn scalar_balance(&self, scalar: usize) -> Result<ScalarBalance> {
        Ok(self.scalar_sums(scalar)?.balance(self.amount_unit(scalar)))
    }

    /// Where all of a scalar is, in amounts.
    pub(super) fn scalar_sums(&self, scalar: usize) -> Result<Sums> {
        check_scalar(scalar, self.scalars().len())?;
        let amounts = &self.flow.amounts;
        Ok(Sums {
            inside: amounts.inside(scalar),
            held: self.remap.held.amount(scalar),
            falling: self.falls.amount(scalar),
            accounts: amounts.sums[scalar],
        })
    }

    /// The value of an amount of 1 of a scalar (its own unit x m3).
    pub(super) fn amount_unit(&self, scalar: usize) -> f64 {
        let cell = self.columns.grid.cell;
        cell * cell * self.columns.heights.unit * (self.scalars()[scalar].range / LEVELS)
    }
}

/// Where all of a scalar is, in amounts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums {
    pub inside: i128,
    pub held: i128,
    pub falling: i128,
    pub accounts: [i128; ACCOUNTS],
}

impl Sums {
    /// Adds `times` times another's sums.
    pub fn add(&mut self, other: &Self, times: i128) {
        self.inside += times * other.inside;
        self.held += times * other.held;
        self.falling += times * other.falling;
        self.accounts.iter_mut().zip(other.accounts).for_each(|(sum, other)| *sum += times * other);
    }

    /// The balance, given the value of an amount of 1.
    pub fn balance(&self, unit: f64) -> ScalarBalance {
        let Self { inside, held, falling, accounts } = *self;
        let of = |account: Account| accounts[account as usize];
        let came = of(Account::Poured) + of(Account::Sourced) + of(Account::Gained) + of(Account::Grown);
        let went = of(Account::Drained) + of(Account::Absorbed) + of(Account::Lost) + of(Account::Dried);
        let cubic = |amount: i128| amount as f64 * unit;
        ScalarBalance {
            inside: cubic(inside),
            poured: cubic(of(Account::Poured)),
            sourced: cubic(of(Account::Sourced)),
            drained: cubic(of(Account::Drained)),
            absorbed: cubic(of(Account::Absorbed)),
            lost: cubic(of(Account::Lost)),
            gained: cubic(of(Account::Gained)),
            held: cubic(held),
            falling: cubic(falling),
            grown: cubic(of(Account::Grown)),
            dried: cubic(of(Account::Dried)),
            error: came - went - inside - held - falling,
        }
    }
}

/// Concentrations of columns from index `first` on, with these depths.
pub(super) fn find_concentrations(
    amounts: &Amounts,
    scalar: usize,
    depth: &[i32],
    first: usize,
    out: &mut [f32],
) {
    dispatch!(body(amounts: &Amounts, scalar: usize, depth: &[i32], first: usize, out: &mut [f32]));

    #[inline(always)]
    fn body(amounts: &Amounts, scalar: usize, depth: &[i32], first: usize, out: &mut [f32]) {
        let scale = amounts.scalars[scalar].range / LEVELS;
        let own = &amounts.amounts[scalar][first..];
        for ((out, depth), amount) in out.iter_mut().zip(depth).zip(own) {
            *out = (shares::level(*amount, *depth) * scale) as f32;
        }
    }
}
