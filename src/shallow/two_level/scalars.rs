//! Scalars of liquid in cells of two sizes. Amounts are counted as in fine columns: one in a coarse column counts four times.

use super::{Detail, FINE_PER_COARSE};
use crate::error::Result;
use crate::shallow::scalars::{Scalar, ScalarBalance};

impl Detail {
    /// Sets what the liquid carries, as [`Shallow::set_scalars`](crate::shallow::Shallow::set_scalars).
    ///
    /// # Errors
    /// As there.
    pub fn set_scalars(&mut self, scalars: &[Scalar]) -> Result<()> {
        self.fine.set_scalars(scalars)?;
        self.coarse.set_scalars(scalars)?;
        self.remainders.set_scalars(scalars.len());
        Ok(())
    }

    /// What the liquid carries.
    pub fn scalars(&self) -> &[Scalar] {
        self.fine.scalars()
    }

    /// Sets the concentration of each scalar in what is poured from now on, as [`Shallow::set_poured`](crate::shallow::Shallow::set_poured).
    ///
    /// # Errors
    /// As there.
    pub fn set_poured(&mut self, concentrations: &[f64]) -> Result<()> {
        self.fine.set_poured(concentrations)?;
        self.coarse.set_poured(concentrations)
    }

    /// Sets the concentration of each scalar in what enters through a flow point, as
    /// [`Shallow::set_sourced`](crate::shallow::Shallow::set_sourced).
    ///
    /// # Errors
    /// As there.
    pub fn set_sourced(&mut self, point: usize, concentrations: &[f64]) -> Result<()> {
        self.fine.set_sourced(point, concentrations)?;
        self.coarse.set_sourced(point, concentrations)
    }

    /// Where all of a scalar is; amounts in remainders of less than a coarse unit count as held.
    ///
    /// # Errors
    /// `Argument`: there is no such scalar.
    pub fn scalar_balance(&self, scalar: usize) -> Result<ScalarBalance> {
        let mut all = self.fine.scalar_sums(scalar)?;
        all.add(&self.coarse.scalar_sums(scalar)?, i128::from(FINE_PER_COARSE));
        all.held += self.remainders.amount(scalar);
        Ok(all.balance(self.fine.amount_unit(scalar)))
    }
}
