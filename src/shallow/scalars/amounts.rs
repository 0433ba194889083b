//! The amounts of a liquid's scalars, and their balance.

use std::ops::Range;

use super::shares::{LEVELS, Levels, MAX_SCALARS, integer, level, share};
use super::{Law, Scalar};
use crate::shallow::columns::per_column::{Array, PerColumn};

/// Interval between decays, as a share of the half-life (each step, if that is longer). In shorter intervals thin films would lose less
/// than half a unit of amount, which rounds to 0.
const DECAY_INTERVAL: f64 = 1.0 / 1024.0;

/// Initial capacity for columns of a flooded network and those beside them.
const PARTIES: usize = 2048;

/// The origin or destination of an amount.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::shallow) enum Account {
    /// Poured in, less what negative pours removed.
    Poured,
    /// Added by sources.
    Sourced,
    /// Removed by drains.
    Drained,
    /// Removed by absorbers.
    Absorbed,
    /// Left the domain.
    Lost,
    /// Entered over the border.
    Gained,
    /// Added by the law.
    Grown,
    /// Rounding remainders in columns that ran dry.
    Dried,
}

/// Count of accounts of a scalar.
pub(in crate::shallow) const ACCOUNTS: usize = Account::Dried as usize + 1;

impl Account {
    /// Factor from the change of a column to its account: drains and absorbers count what they remove as positive.
    fn sign(self) -> i128 {
        if matches!(self, Self::Drained | Self::Absorbed) { -1 } else { 1 }
    }
}

/// Changes of a scalar in a step, on some rows (amounts, by account).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::shallow) struct Changes {
    pub lost: i128,
    pub gained: i128,
    pub grown: i128,
    pub dried: i128,
}

/// The effect of a law in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::shallow) struct LawEffect {
    /// Levels that each unit gains.
    pub grows: f64,
    /// Share of the amount that is lost.
    pub loses: f64,
}

impl LawEffect {
    /// Applies it to the amount of this many units, as `apply_law` in `solver/transfers/scalars.rs` does to a column; returns the growth.
    pub fn change(&self, units: i64, amount: &mut i64) -> i128 {
        let (units, before) = (i128::from(units), i128::from(*amount));
        let kept = before - (*amount as f64 * self.loses).round_ties_even() as i128;
        let older = kept + units * self.grows as i128;
        let max = units * LEVELS as i128;
        let now = if self.grows > 0.0 { older.min(max) } else { older };
        *amount = now.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64;
        i128::from(*amount) - before
    }
}

/// The scalars of a liquid.
#[derive(Debug, Clone)]
pub(in crate::shallow) struct Amounts {
    pub scalars: Vec<Scalar>,
    /// For each scalar, by column index, padded by a strip; empty for scalars that do not exist. 0 where there is no liquid.
    pub amounts: [PerColumn<f64>; MAX_SCALARS],
    /// By scalar and account.
    pub sums: [[i128; ACCOUNTS]; MAX_SCALARS],
    /// Pending effect of each law, still too small to be applied: levels of growth, or seconds of decay.
    pub due: [f64; MAX_SCALARS],
    /// The effects of the laws in this step.
    law_effects: [LawEffect; MAX_SCALARS],
    /// Concentrations of poured liquid.
    pub poured: Levels,
    /// Levels of the parties of a flooded network; kept to avoid repeated allocation.
    pub party_levels: Vec<f64>,
}

impl Amounts {
    /// No scalars.
    pub fn none() -> Self {
        Self::new(Vec::new(), 0)
    }

    /// Amounts of 0, for this many indices.
    pub fn new(scalars: Vec<Scalar>, len: usize) -> Self {
        // Alignment offsets of arrays that a step does not use at the same time.
        let positions = [Array::Under, Array::Ceiling, Array::Head, Array::Light];
        let count = scalars.len();
        Self {
            amounts: std::array::from_fn(|at| {
                PerColumn::new(positions[at], if at < count { len } else { 0 }, 0.0)
            }),
            scalars,
            sums: [[0; ACCOUNTS]; MAX_SCALARS],
            due: [0.0; MAX_SCALARS],
            law_effects: [LawEffect::default(); MAX_SCALARS],
            poured: [0; MAX_SCALARS],
            party_levels: Vec::with_capacity(if count > 0 { PARTIES } else { 0 }),
        }
    }

    /// Count of scalars.
    pub fn count(&self) -> usize {
        self.scalars.len()
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.amounts.iter().map(PerColumn::bytes).sum()
    }

    /// Changes the count of indices of a part of the columns; their amounts are then unspecified.
    pub fn resize_part(&mut self, part: Range<usize>, len: usize) {
        for amounts in self.amounts.iter_mut().filter(|amounts| !amounts.is_empty()) {
            amounts.resize_part(part.clone(), len, 0.0);
        }
    }

    /// Whether any scalar changes even without motion.
    pub fn has_laws(&self) -> bool {
        self.scalars.iter().any(|scalar| scalar.law != Law::Dye)
    }

    /// The effects of the laws in this step, by scalar.
    pub fn law_effects(&self) -> [LawEffect; MAX_SCALARS] {
        self.law_effects
    }

    /// Begins a step of `dt` (s).
    pub fn begin_step(&mut self, dt: f64) {
        for ((scalar, effect), due) in self.scalars.iter().zip(&mut self.law_effects).zip(&mut self.due) {
            *effect = LawEffect::default();
            match scalar.law {
                Law::Dye => {}
                Law::Ages => {
                    *due += dt * (LEVELS / scalar.range);
                    effect.grows = due.floor();
                    *due -= effect.grows;
                }
                Law::Decays(half) => {
                    *due += dt;
                    if *due >= half * DECAY_INTERVAL {
                        effect.loses = -libm::expm1(-*due / half * std::f64::consts::LN_2);
                        *due = 0.0;
                    }
                }
            }
        }
    }

    /// Adds the changes of a step to the accounts.
    pub fn add_changes(&mut self, changes: &[Changes; MAX_SCALARS]) {
        for (sums, changes) in self.sums.iter_mut().zip(changes) {
            sums[Account::Lost as usize] += changes.lost;
            sums[Account::Gained as usize] += changes.gained;
            sums[Account::Grown as usize] += changes.grown;
            sums[Account::Dried as usize] += changes.dried;
        }
    }

    /// Adds the amounts of liquid that is added to a column (negative: removed), and accounts for them. The column had `before` units;
    /// added liquid has these concentrations.
    pub fn add(&mut self, index: usize, before: i64, added: i64, levels: &Levels, account: Account) {
        for (at, level_in) in levels.iter().enumerate().take(self.count()) {
            let amount = &mut self.amounts[at][index];
            let change = if added > 0 {
                f64::from(*level_in) * added as f64
            } else if before + added == 0 {
                -*amount
            } else {
                -share(level(*amount, before as i32), -added as f64)
            };
            *amount += change;
            self.sums[at][account as usize] += account.sign() * i128::from(integer(change));
        }
    }

    /// Adds amounts to a column, without an account.
    pub fn add_amounts(&mut self, index: usize, amounts: &[i64; MAX_SCALARS]) {
        for (at, amount) in amounts.iter().enumerate().take(self.count()) {
            self.amounts[at][index] += *amount as f64;
        }
    }

    /// Accounts for growth by a law in liquid outside of columns.
    pub fn grow(&mut self, scalar: usize, grown: i128) {
        self.sums[scalar][Account::Grown as usize] += grown;
    }

    /// Adds amounts to an account.
    pub fn add_to_account(&mut self, account: Account, amounts: &[i64; MAX_SCALARS]) {
        for (sums, amount) in self.sums.iter_mut().zip(amounts) {
            sums[account as usize] += i128::from(*amount);
        }
    }

    /// The sum of a scalar over all columns.
    pub fn inside(&self, scalar: usize) -> i128 {
        let strips = self.amounts[scalar].chunks(1 << 10);
        strips.map(|amounts| i128::from(amounts.iter().map(|&amount| integer(amount)).sum::<i64>())).sum()
    }

    /// The concentration of a column, in the scalar's own unit; 0 where it is dry.
    #[inline(always)]
    pub fn concentration(&self, scalar: usize, index: usize, depth: i32) -> f32 {
        (level(self.amounts[scalar][index], depth) * (self.scalars[scalar].range / LEVELS)) as f32
    }
}
