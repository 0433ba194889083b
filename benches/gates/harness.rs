//! One line a number: `gate <name> <value> <unit> must <bound> aim <bound> <aim|ok|short>`.

use std::time::Instant;

/// Prints gates and remembers whether one fell short.
pub struct Harness {
    only: Vec<String>,
    /// Which of them named a gate.
    found: Vec<bool>,
    short: bool,
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
    fn holds(self, value: f64) -> bool {
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
    /// Takes the names (prefixes, comma-separated) to run from the arguments; all without any.
    pub fn from_arguments() -> Self {
        let names = std::env::args().skip(1).filter(|argument| !argument.starts_with('-'));
        let only = names.flat_map(|text| text.split(',').map(str::to_string).collect::<Vec<_>>()).collect();
        Self::of(only)
    }

    /// Runs the gates whose names begin with one of these; all without any.
    pub fn of(only: Vec<String>) -> Self {
        Self { found: vec![false; only.len()], only, short: false }
    }

    /// Names that were asked for and that no gate has.
    pub fn unknown(&self) -> Vec<&str> {
        let asked = self.only.iter().zip(&self.found);
        asked.filter(|(_, found)| !**found).map(|(only, _)| only.as_str()).collect()
    }

    /// Whether any gate whose name begins so is wanted.
    pub fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| name.starts_with(only) || only.starts_with(name))
    }

    /// Notes that a gate was there.
    fn note(&mut self, name: &str) {
        let found = self.only.iter().zip(&mut self.found);
        found.filter(|(only, _)| name.starts_with(only.as_str())).for_each(|(_, found)| *found = true);
    }

    /// Prints that a gate, or all gates whose names begin so, cannot be measured here.
    pub fn skipped(&mut self, name: &str, reason: &str) {
        // What was asked for may be one of those gates.
        let found = self.only.iter().zip(&mut self.found);
        found.filter(|(only, _)| only.starts_with(name)).for_each(|(_, found)| *found = true);
        self.note(name);
        println!("gate {name} skipped # {reason}");
    }

    /// Prints a gate.
    pub fn gate(&mut self, name: &str, value: f64, unit: &str, must: Bound, aim: Bound, note: &str) {
        self.note(name);
        let state = match (must.holds(value), aim.holds(value)) {
            (true, true) => "aim",
            (true, false) => "ok",
            _ => "short",
        };
        self.short |= state == "short";
        let note = if note.is_empty() { String::new() } else { format!(" # {note}") };
        println!("gate {name} {value:.6} {unit} must {} aim {} {state}{note}", must.text(), aim.text());
    }

    /// Prints a yes or no.
    pub fn holds(&mut self, name: &str, yes: bool, note: &str) {
        self.gate(name, f64::from(u8::from(yes)), "bool", Bound::Least(1.0), Bound::Open, note);
    }

    /// Ends the program: 1 when a gate fell short, 2 when a name was asked for that no gate has.
    pub fn finish(self) -> ! {
        let unknown = self.unknown();
        if !unknown.is_empty() {
            eprintln!("no gate is named {}", unknown.join(", "));
            std::process::exit(2);
        }
        std::process::exit(i32::from(self.short))
    }
}

/// Ticks of other processes and of all, since boot: for `# noisy`.
fn ticks() -> Option<(f64, f64)> {
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let all: Vec<f64> =
        stat.lines().next()?.split_whitespace().skip(1).filter_map(|n| n.parse().ok()).collect();
    let own = std::fs::read_to_string("/proc/self/stat").ok()?;
    let own: Vec<f64> = own.rsplit(')').next()?.split_whitespace().filter_map(|n| n.parse().ok()).collect();
    let busy: f64 = all.iter().take(3).sum();
    // After the name's parenthesis and the state letter: utime and stime are numbers 11 and 12, the children's follow.
    let own: f64 = own.get(10..14)?.iter().sum();
    Some((busy - own, Instant::now().elapsed().as_secs_f64()))
}

/// Times what `work` does, and says what else the machine did meanwhile.
pub fn timed(mut work: impl FnMut()) -> (f64, String) {
    let before = ticks();
    let start = Instant::now();
    work();
    let seconds = start.elapsed().as_secs_f64();
    let others = match (before, ticks()) {
        (Some((before, _)), Some((after, _))) => (after - before) / 100.0 / seconds,
        _ => 0.0,
    };
    (seconds, if others > 0.3 { " noisy".into() } else { String::new() })
}

/// The middle of some numbers.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}
