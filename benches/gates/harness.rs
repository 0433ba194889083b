//! One line a number: `gate <name> <value> <unit> must <bound> aim <bound> <aim|ok|short>`. Bounds are in `list.rs`.

use std::time::Instant;

mod calibration;
mod list;

pub use list::GATES;

/// Prints gates and remembers whether one fell short.
pub struct Harness {
    gates: &'static [Gate],
    /// Which of the gates were measured, or said to be skipped.
    done: Vec<bool>,
    /// Prefixes of the names that are wanted; all without any.
    only: Vec<String>,
    short: bool,
}

/// What is promised of a number.
pub struct Gate {
    pub name: &'static str,
    pub unit: &'static str,
    /// What the value must keep.
    pub must: Bound,
    /// What it aims at.
    pub aim: Bound,
    /// What the machine's speed changes in it.
    pub speed: Speed,
}

/// What a faster machine makes of a number.
#[derive(Clone, Copy, PartialEq)]
pub enum Speed {
    /// Nothing, or it is a ratio already, or it matters as seconds of a clock, as a cancel does.
    Any,
    /// It is shorter: printed as the time on the machine of the bounds.
    Time,
    /// It is higher: printed as the rate on the machine of the bounds.
    Rate,
}

/// A bound such as `<=0.1` or `>=1`.
#[derive(Clone, Copy)]
pub enum Bound {
    /// At most.
    Most(f64),
    /// At least.
    Least(f64),
    /// None.
    Open,
}

impl Bound {
    /// Whether a value keeps it.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Most(bound) => value <= bound,
            Self::Least(bound) => value >= bound,
            Self::Open => true,
        }
    }

    fn text(self) -> String {
        match self {
            Self::Most(bound) => format!("<={bound}"),
            Self::Least(bound) => format!(">={bound}"),
            Self::Open => "-".into(),
        }
    }
}

impl Harness {
    /// Takes the names (prefixes, comma-separated) to run from the arguments; all without any. Ends the program with 2 when no
    /// gate is named so.
    pub fn from_arguments() -> Self {
        // `cargo bench` adds this one.
        let names = std::env::args().skip(1).filter(|argument| argument != "--bench");
        let names = names.flat_map(|text| text.split(',').map(str::to_string).collect::<Vec<_>>());
        Self::of(GATES, names.filter(|name| !name.is_empty()).collect()).unwrap_or_else(|error| {
            eprintln!("{error}");
            std::process::exit(2);
        })
    }

    /// Runs the gates whose names begin with one of these; all without any.
    ///
    /// # Errors
    /// Names that no gate's name begins with.
    pub fn of(gates: &'static [Gate], only: Vec<String>) -> Result<Self, String> {
        let is_unknown = |only: &&String| !gates.iter().any(|gate| gate.name.starts_with(only.as_str()));
        let unknown: Vec<&str> = only.iter().filter(is_unknown).map(String::as_str).collect();
        if !unknown.is_empty() {
            return Err(format!("no gate is named {}", unknown.join(", ")));
        }
        Ok(Self { done: vec![false; gates.len()], gates, only, short: false })
    }

    /// Whether the gate of this name is wanted, or, where there is none, any whose name begins so.
    ///
    /// # Panics
    /// When there is no such gate.
    pub fn wants(&self, name: &str) -> bool {
        if let Some(gate) = self.gates.iter().find(|gate| gate.name == name) {
            return self.is_asked(gate);
        }
        let mut named = self.gates.iter().filter(|gate| gate.name.starts_with(name)).peekable();
        assert!(named.peek().is_some(), "list.rs has no gate {name}");
        named.any(|gate| self.is_asked(gate))
    }

    fn is_asked(&self, gate: &Gate) -> bool {
        // A whole name is that gate alone: "mist_step" is not "mist_step_points".
        let is_whole = |only: &String| self.gates.iter().any(|gate| gate.name == *only);
        let is_meant = |only: &String| {
            if is_whole(only) { gate.name == *only } else { gate.name.starts_with(only.as_str()) }
        };
        self.only.is_empty() || self.only.iter().any(is_meant)
    }

    /// Prints that a gate, or all gates whose names begin so, cannot be measured here.
    ///
    /// # Panics
    /// When there is no such gate.
    pub fn skipped(&mut self, name: &str, reason: &str) {
        let named = self.gates.iter().zip(&mut self.done).filter(|(gate, _)| gate.name.starts_with(name));
        let count = named.map(|(_, done)| *done = true).count();
        assert!(count > 0, "list.rs has no gate {name}");
        println!("gate {name} skipped # {reason}");
    }

    /// Measures a gate if it is wanted: its value, or a yes or no, and a note.
    pub fn measure<V: Into<f64>, N: AsRef<str>>(&mut self, name: &str, measure: impl FnOnce() -> (V, N)) {
        if self.wants(name) {
            let (value, note) = measure();
            self.gate(name, value, note.as_ref());
        }
    }

    /// Measures gates together if any of them is wanted, and prints those that are.
    pub fn measure_all<S: AsRef<str>, N: AsRef<str>, const COUNT: usize>(
        &mut self,
        names: [S; COUNT],
        measure: impl FnOnce() -> [(f64, N); COUNT],
    ) {
        if names.iter().any(|name| self.wants(name.as_ref())) {
            for (name, (value, note)) in names.iter().zip(measure()) {
                self.measure(name.as_ref(), || (value, note));
            }
        }
    }

    /// Prints a gate: its value, or a yes or no.
    ///
    /// # Panics
    /// When there is no such gate, or it was printed before.
    pub fn gate(&mut self, name: &str, value: impl Into<f64>, note: &str) {
        let index = self.gates.iter().position(|gate| gate.name == name);
        let index = index.unwrap_or_else(|| panic!("list.rs has no gate {name}"));
        assert!(!self.done[index], "gate {name} was printed before");
        self.done[index] = true;
        let Gate { unit, must, aim, speed, .. } = self.gates[index];
        let factor = match speed {
            Speed::Any => 1.0,
            Speed::Time => 1.0 / calibration::slowness(),
            Speed::Rate => calibration::slowness(),
        };
        // A nought is not printed as -0.
        let value = value.into() * factor + 0.0;
        let state = match (must.holds(value), aim.holds(value)) {
            (true, true) => "aim",
            (true, false) => "ok",
            _ => "short",
        };
        self.short |= state == "short";
        let note = if note.is_empty() { String::new() } else { format!(" # {note}") };
        println!("gate {name} {value:.6} {unit} must {} aim {} {state}{note}", must.text(), aim.text());
    }

    /// Gates that were asked for and neither measured nor skipped.
    pub fn missing(&self) -> Vec<&'static str> {
        let gates = self.gates.iter().zip(&self.done);
        gates.filter(|(gate, done)| !**done && self.is_asked(gate)).map(|(gate, _)| gate.name).collect()
    }

    /// Ends the program: 1 when a gate fell short, 2 when one was not measured.
    pub fn finish(self) -> ! {
        let missing = self.missing();
        if !missing.is_empty() {
            eprintln!("not measured: {}", missing.join(", "));
            std::process::exit(2);
        }
        std::process::exit(i32::from(self.short))
    }
}

/// Ticks of other processes since boot: for `# noisy`.
fn ticks() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let all: Vec<f64> =
        stat.lines().next()?.split_whitespace().skip(1).filter_map(|n| n.parse().ok()).collect();
    let own = std::fs::read_to_string("/proc/self/stat").ok()?;
    let own: Vec<f64> = own.rsplit(')').next()?.split_whitespace().filter_map(|n| n.parse().ok()).collect();
    let busy: f64 = all.iter().take(3).sum();
    // After the name's parenthesis and the state letter: utime and stime are numbers 11 and 12, the children's follow.
    let own: f64 = own.get(10..14)?.iter().sum();
    Some(busy - own)
}

/// Times what `work` does, and says what else the machine did meanwhile.
pub fn timed(mut work: impl FnMut()) -> (f64, String) {
    let before = ticks();
    let start = Instant::now();
    work();
    let seconds = start.elapsed().as_secs_f64();
    let others = match (before, ticks()) {
        (Some(before), Some(after)) => (after - before) / 100.0 / seconds,
        _ => 0.0,
    };
    (seconds, if others > 0.3 { " noisy".into() } else { String::new() })
}

/// The middle of some numbers.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Mean, 95th percentile and greatest of some numbers.
pub fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, values[values.len() * 95 / 100], values[values.len() - 1]]
}
