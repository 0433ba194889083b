//! Plots of what was measured against theory, as PNG files in `target/plots`.

use std::path::Path;

use frazil::render::{Picture, Size};

use crate::plots::font;

/// Size of a picture (pixels).
const SIZE: [usize; 2] = [640, 480];
/// The frame that curves are drawn in: left, top, right, bottom (pixels).
const FRAME: [f64; 4] = [72.0, 52.0, 622.0, 424.0];
/// Pixels of a unit of the letters: in the title, and elsewhere.
const TITLE: f64 = 1.6;
const TEXT: f64 = 1.3;
/// Height of a line of the legend (pixels).
const LINE: f64 = 18.0;
const BLACK: [f32; 3] = [0.13, 0.13, 0.15];
const GREY: [f32; 3] = [0.87, 0.88, 0.9];
const WHITE: [f32; 3] = [1.0, 1.0, 1.0];
/// Colours of the points, one series after another, and of the lines.
const POINTS: [[f32; 3]; 5] =
    [[0.0, 0.36, 0.70], [0.84, 0.33, 0.0], [0.0, 0.55, 0.38], [0.62, 0.25, 0.60], [0.60, 0.50, 0.0]];
const LINES: [[f32; 3]; 3] = [BLACK, [0.5, 0.5, 0.55], [0.72, 0.5, 0.4]];

/// An axis: what it shows, with its unit.
pub struct Axis {
    name: String,
    is_log: bool,
}

impl Axis {
    /// An axis of equal steps.
    pub fn linear(name: &str) -> Self {
        Self { name: name.into(), is_log: false }
    }

    /// An axis of equal ratios, for numbers over 0.
    pub fn log(name: &str) -> Self {
        Self { name: name.into(), is_log: true }
    }

    /// Where a number lies along the axis.
    fn position(&self, value: f64) -> f64 {
        if self.is_log { value.log10() } else { value }
    }

    /// The numbers that are marked between two positions, and their texts.
    fn ticks(&self, [low, high]: [f64; 2]) -> Vec<(f64, String)> {
        if !self.is_log {
            let step = nice((high - low) / 6.0);
            let digits = (-step.log10().floor()).max(0.0) as usize;
            let first = (low / step - 1e-9).ceil() as i64;
            let last = (high / step + 1e-9).floor() as i64;
            return (first..=last)
                .map(|n| (n as f64 * step, format!("{:.digits$}", n as f64 * step)))
                .collect();
        }
        let mut ticks = Vec::new();
        let multiples: &[f64] = if high - low < 2.2 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        for decade in low.floor() as i32..=high.ceil() as i32 {
            for multiple in multiples {
                let position = f64::from(decade) + multiple.log10();
                if position >= low - 1e-9 && position <= high + 1e-9 {
                    let value = multiple * 10f64.powi(decade);
                    let is_plain = (-2..=3).contains(&decade);
                    let text = match *multiple {
                        _ if is_plain => format!("{:.*}", decade.min(0).unsigned_abs() as usize, value),
                        1.0 => format!("10^{decade}"),
                        multiple => format!("{multiple:.0} 10^{decade}"),
                    };
                    ticks.push((position, text));
                }
            }
        }
        ticks
    }
}

/// 1, 2 or 5 times a power of ten, at least a number.
fn nice(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|n| n * power).find(|n| *n >= least).unwrap_or(10.0 * power)
}

/// Points or a line, with their name in the legend.
struct Series {
    name: String,
    is_line: bool,
    colour: [f32; 3],
    points: Vec<[f64; 2]>,
}

/// A plot.
pub struct Plot {
    title: String,
    axes: [Axis; 2],
    series: Vec<Series>,
}

impl Plot {
    /// Axes without curves.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), axes: [x, y], series: Vec::new() }
    }

    /// Adds a line: theory.
    pub fn line(mut self, name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let before = self.series.iter().filter(|series| series.is_line).count();
        self.add(name, true, LINES[before % LINES.len()], points);
        self
    }

    /// Adds points: what was measured.
    pub fn points(mut self, name: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let before = self.series.iter().filter(|series| !series.is_line).count();
        self.add(name, false, POINTS[before % POINTS.len()], points);
        self
    }

    fn add(
        &mut self,
        name: &str,
        is_line: bool,
        colour: [f32; 3],
        points: impl IntoIterator<Item = [f64; 2]>,
    ) {
        let position = |[x, y]: [f64; 2]| [self.axes[0].position(x), self.axes[1].position(y)];
        let points = points.into_iter().map(position).filter(|at| at.iter().all(|x| x.is_finite())).collect();
        self.series.push(Series { name: name.into(), is_line, colour, points });
    }

    /// Writes `target/plots/<name>.png`.
    ///
    /// # Panics
    /// When the file cannot be written.
    pub fn write(&self, name: &str) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/plots");
        std::fs::create_dir_all(&folder).expect("the folder of the plots");
        self.draw().write(&folder.join(format!("{name}.png"))).expect("a plot");
    }

    fn draw(&self) -> Picture {
        let mut ranges = [0, 1].map(|axis| self.range(axis));
        let [left, top, right, bottom] = FRAME;
        let (mut legend, covered) = self.legend(ranges);
        if covered > 0 {
            // Room above the curves.
            let [low, high] = &mut ranges[1];
            *high += (*high - *low) * legend[3] / (bottom - top - legend[3]);
            (legend, _) = self.legend(ranges);
        }
        let along = |axis: usize, at: f64| along(ranges, axis, at);
        let mut canvas = Canvas::new();
        for (x, text) in self.axes[0].ticks(ranges[0]) {
            let x = along(0, x);
            canvas.stroke([[x, top], [x, bottom]], 1.0, GREY);
            canvas.text(&text, [x, bottom + 18.0], 0.5, TEXT);
        }
        for (y, text) in self.axes[1].ticks(ranges[1]) {
            let y = along(1, y);
            canvas.stroke([[left, y], [right, y]], 1.0, GREY);
            canvas.text(&text, [left - 8.0, y + 4.0], 1.0, TEXT);
        }
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        (0..4).for_each(|i| canvas.stroke([corners[i], corners[(i + 1) % 4]], 1.2, BLACK));
        canvas.text(&self.title, [0.5 * (left + right), 20.0], 0.5, TITLE);
        canvas.text(&self.axes[1].name, [8.0, top - 10.0], 0.0, TEXT);
        canvas.text(&self.axes[0].name, [0.5 * (left + right), bottom + 42.0], 0.5, TEXT);
        for series in &self.series {
            let points: Vec<[f64; 2]> =
                series.points.iter().map(|at| [along(0, at[0]), along(1, at[1])]).collect();
            if series.is_line {
                points.windows(2).for_each(|ends| canvas.stroke([ends[0], ends[1]], 1.6, series.colour));
            } else {
                points.iter().for_each(|&at| canvas.dot(at, series.colour));
            }
        }
        self.name_curves(&mut canvas, legend);
        canvas.finish()
    }

    /// Least and greatest position along an axis, with some room at both ends.
    fn range(&self, axis: usize) -> [f64; 2] {
        let positions = self.series.iter().flat_map(|series| &series.points).map(|at| at[axis]);
        let (low, high) = positions.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
        let room = (0.05 * (high - low)).max(1e-12 + 1e-6 * high.abs());
        [low - room, high + room]
    }

    /// The corner for the legend with the fewest points of curves - left, top, width, height (pixels) - and their count.
    fn legend(&self, ranges: [[f64; 2]; 2]) -> ([f64; 4], usize) {
        let [left, top, right, bottom] = FRAME;
        let width = |series: &Series| TEXT * font::strokes(&series.name).1;
        let width = self.series.iter().map(width).fold(0.0, f64::max) + 54.0;
        let height = LINE * self.series.len() as f64 + 10.0;
        let margin = 8.0;
        let covered = |[x, y]: [f64; 2]| {
            let near = |at: &&[f64; 2]| {
                let [px, py] = [along(ranges, 0, at[0]), along(ranges, 1, at[1])];
                (x - 6.0..x + width + 6.0).contains(&px) && (y - 6.0..y + height + 6.0).contains(&py)
            };
            self.series.iter().flat_map(|series| &series.points).filter(near).count()
        };
        let [west, east] = [left + margin, right - margin - width];
        let [north, south] = [top + margin, bottom - margin - height];
        let corners = [[west, north], [east, north], [west, south], [east, south]];
        let best = corners.into_iter().min_by_key(|corner| covered(*corner)).unwrap_or(corners[0]);
        ([best[0], best[1], width, height], covered(best))
    }

    /// Draws the legend.
    fn name_curves(&self, canvas: &mut Canvas, [x, y, width, height]: [f64; 4]) {
        canvas.fill([x, y, x + width, y + height], WHITE);
        for (i, series) in self.series.iter().enumerate() {
            let middle = y + 5.0 + LINE * (i as f64 + 0.5);
            if series.is_line {
                canvas.stroke([[x + 8.0, middle], [x + 32.0, middle]], 1.6, series.colour);
            } else {
                canvas.dot([x + 20.0, middle], series.colour);
            }
            canvas.text(&series.name, [x + 42.0, middle + 4.0], 0.0, TEXT);
        }
    }
}

/// Where a position on an axis lies in the picture (pixels).
fn along(ranges: [[f64; 2]; 2], axis: usize, at: f64) -> f64 {
    let [left, top, right, bottom] = FRAME;
    let ([low, high], [from, to]) = (ranges[axis], [[left, right], [bottom, top]][axis]);
    from + (at - low) / (high - low) * (to - from)
}

/// A picture that is drawn on.
struct Canvas {
    pixels: Vec<[f32; 3]>,
}

impl Canvas {
    fn new() -> Self {
        Self { pixels: vec![WHITE; SIZE[0] * SIZE[1]] }
    }

    /// Draws a round-ended stroke; its edge fades over a pixel.
    fn stroke(&mut self, [a, b]: [[f64; 2]; 2], width: f64, colour: [f32; 3]) {
        let reach = 0.5 * width + 1.0;
        let bounds = |axis: usize| {
            let low = (a[axis].min(b[axis]) - reach).max(0.0) as usize;
            let high = (a[axis].max(b[axis]) + reach).clamp(0.0, SIZE[axis] as f64 - 1.0) as usize;
            low..=high
        };
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = (along[0] * along[0] + along[1] * along[1]).max(1e-12);
        for y in bounds(1) {
            for x in bounds(0) {
                let off = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
                let t = ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0);
                let [dx, dy] = [off[0] - t * along[0], off[1] - t * along[1]];
                let cover = (0.5 * width + 0.5 - (dx * dx + dy * dy).sqrt()).clamp(0.0, 1.0) as f32;
                let pixel = &mut self.pixels[y * SIZE[0] + x];
                *pixel = [0, 1, 2].map(|c| pixel[c] + cover * (colour[c] - pixel[c]));
            }
        }
    }

    /// Draws a point with a light rim.
    fn dot(&mut self, at: [f64; 2], colour: [f32; 3]) {
        self.stroke([at, at], 8.5, WHITE);
        self.stroke([at, at], 6.5, colour);
    }

    /// Fills a rectangle: left, top, right, bottom.
    fn fill(&mut self, [left, top, right, bottom]: [f64; 4], colour: [f32; 3]) {
        for y in top.max(0.0) as usize..(bottom as usize).min(SIZE[1]) {
            self.pixels[y * SIZE[0]..][left.max(0.0) as usize..(right as usize).min(SIZE[0])].fill(colour);
        }
    }

    /// Writes a text whose foot is at a position, with a share of its width before it.
    fn text(&mut self, text: &str, [x, y]: [f64; 2], before: f64, size: f64) {
        let (strokes, width) = font::strokes(text);
        let position = |at: [f64; 2]| [x + size * (at[0] - before * width), y - size * (at[1] - 2.0)];
        strokes.into_iter().for_each(|ends| self.stroke(ends.map(position), 0.85 * size, BLACK));
    }

    fn finish(self) -> Picture {
        let rgb = self.pixels.into_iter().flatten().map(|c| (c * 255.0 + 0.5) as u8).collect();
        Picture { size: Size { width: SIZE[0] as u32, height: SIZE[1] as u32 }, rgb }
    }
}
