//! Materials: the viscosity of liquids.

use crate::error::{Error, Result};
use crate::numeric::digits;

/// A liquid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Liquid {
    /// Kinematic viscosity nu (m2/s), 0 and up; for a liquid that thins under shear, the viscosity at rest.
    pub viscosity: f64,
    /// How it thins under shear; None: it does not.
    pub thinning: Option<Carreau>,
}

/// Carreau's law: a viscosity of nu_inf + (nu - nu_inf) (1 + (lambda rate)^2)^((n - 1) / 2) at the shear rate 3 u / H at the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carreau {
    /// nu_inf (m2/s): viscosity under strong shear; at most the viscosity at rest.
    pub thinnest: f64,
    /// lambda (s), above 0.
    pub time: f64,
    /// n, 0 to 1.
    pub power: f64,
}

impl Liquid {
    /// A liquid of constant viscosity (m2/s).
    pub const fn new(viscosity: f64) -> Self {
        Self { viscosity, thinning: None }
    }

    /// Water at 20 C.
    pub const WATER: Self = Self::new(1.0e-6);
    /// Blood as in the thesis (Table 4.1), which does not thin.
    pub const BLOOD: Self = Self::new(4.0e-6);
    /// Paint as in the thesis (Fig. 4.13c).
    pub const PAINT: Self = Self::new(4.0e-5);
    /// Honey at 20 C, some 10 Pa s and 1,400 kg/m3.
    pub const HONEY: Self = Self::new(7.0e-3);
    /// Blood that thins, of 1,060 kg/m3 (Cho and Kensey 1991: 56 and 3.45 mPa s, 3.313 s, 0.3568).
    pub const THINNING_BLOOD: Self = Self {
        viscosity: 5.28e-5,
        thinning: Some(Carreau { thinnest: 3.25e-6, time: 3.313, power: 0.3568 }),
    };

    /// The liquid with this name: water, blood, paint or honey.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "water" => Self::WATER,
            "blood" => Self::BLOOD,
            "paint" => Self::PAINT,
            "honey" => Self::HONEY,
            _ => return None,
        })
    }

    /// Viscosity (m2/s) at a shear rate (1/s), by Carreau's law where it thins.
    pub fn viscosity_at(&self, rate: f64) -> f64 {
        let Some(law) = &self.thinning else { return self.viscosity };
        let fast = law.time * rate;
        let part = libm::pow(1.0 + fast * fast, 0.5 * (law.power - 1.0));
        law.thinnest + (self.viscosity - law.thinnest) * part
    }

    /// Viscosity under strong shear (m2/s).
    pub fn min_viscosity(&self) -> f64 {
        self.thinning.map_or(self.viscosity, |law| law.thinnest)
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        let check = |name: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let (value, low, high) = (digits::given(value), digits::bound(low), digits::bound(high));
            Err(Error::argument(format!("{name} = {value} is not within {low} to {high}")))
        };
        check("viscosity", self.viscosity, 0.0, 1e6)?;
        if let Some(law) = &self.thinning {
            check("viscosity of a liquid that thins", self.viscosity, 1e-12, 1e6)?;
            check("thinning.thinnest", law.thinnest, 0.0, self.viscosity)?;
            check("thinning.time", law.time, 1e-9, 1e9)?;
            check("thinning.power", law.power, 0.0, 1.0)?;
        }
        Ok(())
    }
}
