//! The greatest of some numbers, and where it is.

/// What is not a number is greater than any.
#[derive(Default)]
pub struct Worst {
    /// None: no number was seen.
    most: Option<f64>,
    at: String,
}

impl Worst {
    /// Sees a number, and where it is.
    pub fn see(&mut self, value: f64, at: impl FnOnce() -> String) {
        if self.most.is_none_or(|most| value > most || value.is_nan() && !most.is_nan()) {
            (self.most, self.at) = (Some(value), at());
        }
    }

    /// The greatest; NaN, which keeps no bound, where none was seen: nothing was measured then.
    pub fn value(&self) -> f64 {
        self.most.unwrap_or(f64::NAN)
    }

    /// Where it is.
    pub fn note(&self) -> String {
        match self.most {
            None => "nothing was measured".into(),
            Some(0.0) => "nowhere any".into(),
            Some(_) => format!("the worst: {}", self.at),
        }
    }
}
