//! What was measured against theory, as numbers: `target/plots/NAME.json`, which `tools/plots` draws.

use std::path::Path;

use serde::Serialize;

/// A plot.
#[derive(Serialize)]
pub struct Plot {
    title: String,
    /// What each axis shows, with its unit.
    axes: [String; 2],
    /// Axes of equal ratios, not of equal steps.
    is_log: bool,
    series: Vec<Series>,
}

/// Points, or a line through them, with their name in the legend.
#[derive(Serialize)]
struct Series {
    name: String,
    is_line: bool,
    points: Vec<[f64; 2]>,
}

impl Plot {
    /// Axes of equal steps without curves: what they show, with their units.
    pub fn linear(title: &str, x: &str, y: &str) -> Self {
        Self { title: title.into(), axes: [x.into(), y.into()], is_log: false, series: Vec::new() }
    }

    /// Axes of equal ratios, for numbers over 0.
    pub fn log(title: &str, x: &str, y: &str) -> Self {
        Self { is_log: true, ..Self::linear(title, x, y) }
    }

    /// Adds a line: theory.
    pub fn line(self, name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        self.with(name, true, points)
    }

    /// Adds points: what was measured.
    pub fn points(self, name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        self.with(name, false, points)
    }

    fn with(mut self, name: &str, is_line: bool, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        self.series.push(Series { name: name.into(), is_line, points: points.into_iter().collect() });
        self
    }

    /// Writes the numbers.
    ///
    /// # Panics
    /// When the file cannot be written.
    pub fn write(&self, name: &str) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/plots");
        std::fs::create_dir_all(&folder).expect("the folder of the plots");
        let text = serde_json::to_vec(self).expect("JSON");
        std::fs::write(folder.join(format!("{name}.json")), text).expect("a plot");
    }
}
