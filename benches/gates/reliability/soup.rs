//! Triangle soup whose corners are off by up to 4 neighbouring 32-bit numbers, through every door of the program: it is the solid that it
//! was made of, and nothing is warned of.
//!
//! Volumes that a level set or a sum shows are compared with a formula (of round bodies, with the sum over their triangles in 64 bits);
//! what a shot does with a body, with what it does with the same body whose triangles share exact corners.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use frazil::geometry::{DVec3, TriMesh};
use frazil::io::mesh;
use frazil::vdb::file;
use serde_json::Value;

use crate::common::bodies::Dice;
use crate::common::soups::{Solid, solids, volume_inside};
use crate::process::frazil;

/// Distances from the origin, and sizes at which rounding there is below a thousandth (m).
const AT: [(f64, f64); 4] = [(0.0, 1.0), (100.0, 1.0), (1.0e4, 4.0), (9.99e4, 40.0)];
/// Cells across a body.
const CELLS: f64 = 40.0;
/// Cells of a shot across it, and half the edge of its area (sizes): no face lies between two cells, where rounding decides of which it is.
const SHOT_CELLS: f64 = 20.3;
const HALF_AREA: f64 = 0.787;
/// Errors of a volume that count (share).
const OFF: f64 = 0.01;

pub fn measure() -> [(f64, String); 2] {
    let (start, mut dice) = (Instant::now(), Dice(47));
    let folder = tempfile::tempdir().expect("a folder");
    let bodies = solids(&mut dice);
    let mut tally = Tally::default();
    for (at, size) in AT {
        for (number, solid) in bodies.iter().enumerate() {
            let position = if number == 0 { DVec3::new(at, 0.0, 0.0) } else { dice.direction() * at };
            let steps = 1 + number % 4;
            let soup = solid.soup(size, position, steps, &mut dice);
            let name = format!("{} of {size} m at {at} m, {steps} steps", solid.name);
            let format = ["ply", "stl", "obj"][number % 3];
            Case { folder: folder.path(), name, solid, soup, size, position, format }.run(&mut tally);
        }
    }
    let note = format!("{} runs, {:.0} s", tally.runs, start.elapsed().as_secs_f64());
    [(tally.silent as f64, note), (tally.warned as f64, "warnings, errors and reports of faults".into())]
}

#[derive(Default)]
struct Tally {
    runs: usize,
    silent: usize,
    warned: usize,
}

struct Case<'a> {
    folder: &'a Path,
    name: String,
    solid: &'a Solid,
    soup: TriMesh,
    size: f64,
    position: DVec3,
    format: &'static str,
}

/// What a run has said.
struct Said {
    worked: bool,
    out: String,
    warnings: String,
}

impl Case<'_> {
    fn run(&self, tally: &mut Tally) {
        let soup = format!("soup.{}", self.format);
        let exact = format!("exact.{}", self.format);
        let shared = TriMesh {
            positions: self
                .solid
                .positions
                .iter()
                .map(|at| (at * self.size + self.position).cast())
                .collect(),
            triangles: self.solid.triangles.clone(),
        };
        mesh::write(&self.folder.join(&soup), &self.soup).expect("a mesh");
        mesh::write(&self.folder.join(&exact), &shared).expect("a mesh");
        let volume = self.solid.volume * self.size.powi(3);
        let cell = self.size / CELLS;
        for door in ["from-mesh", "sweep", "check", "repair"] {
            let (said, found) = self.tool(door, &soup, cell);
            self.judge(door, &said, found, volume, tally);
        }
        for door in ["moving", "static", "ground", "object", "terrain", "surface"] {
            if door == "surface" && self.position.norm() > self.size {
                // Particles have 32 bits, too.
                continue;
            }
            let (_, expected) = self.shot(door, &exact);
            let (said, found) = self.shot(door, &soup);
            self.judge(door, &said, found, expected.unwrap_or(f64::NAN), tally);
        }
    }

    fn judge(&self, door: &str, said: &Said, found: Option<f64>, expected: f64, tally: &mut Tally) {
        tally.runs += 1;
        let is_right = found.is_some_and(|found| ((found - expected) / expected).abs() <= OFF);
        let is_quiet = said.worked && said.warnings.is_empty();
        if !is_right && is_quiet {
            tally.silent += 1;
            println!("# {door}, {}: {found:?}, not {expected}", self.name);
        }
        if !is_quiet {
            tally.warned += 1;
            println!("# {door}, {}: {}", self.name, said.warnings.trim());
        }
    }

    /// A tool that looks at one mesh, and the volume that it says, or writes.
    fn tool(&self, door: &str, file: &str, cell: f64) -> (Said, Option<f64>) {
        let number = |text: &str, key: &str| serde_json::from_str::<Value>(text).ok()?.pointer(key)?.as_f64();
        match door {
            "check" => {
                let said = self.frazil(&format!("mesh check {file} --json"));
                let report: Value = serde_json::from_str(&said.out).unwrap_or_default();
                let is_solid =
                    report[0]["solid"] == Value::Bool(true) && report[0]["ambiguous_vertices"] == 0;
                let volume = number(&said.out, "/0/volume_m3");
                (Said { worked: said.worked && is_solid, ..said }, volume)
            }
            "repair" => {
                let said = self.frazil(&format!("mesh repair {file} -o solid.ply --json"));
                let volume = number(&said.out, "/volume_m3");
                (said, volume)
            }
            _ => {
                let how =
                    if door == "sweep" { format!("--move {},0,0 ", self.size * 1e-4) } else { String::new() };
                let said = self.frazil(&format!("vdb {door} {file} {how}--cell {cell} -o grid.vdb"));
                let grid = file::read_named(&self.folder.join("grid.vdb"), None).ok();
                let volume = grid.as_ref().map(volume_inside);
                (said, volume)
            }
        }
    }

    /// A shot of two frames, and what is left of the snow (m3), holds as liquid (ml), or is the mesh's volume (m3).
    fn shot(&self, door: &str, file: &str) -> (Said, Option<f64>) {
        let _ = std::fs::remove_dir_all(self.folder.join("shot"));
        if door == "surface" {
            return self.surface(file);
        }
        let Self { size, position, .. } = self;
        let cell = size / SHOT_CELLS;
        let mut text = String::from("[shot]\nframes = \"1-2\"\n");
        let (low, high) = (position.add_scalar(-HALF_AREA * size), position.add_scalar(HALF_AREA * size));
        let (system, report) = if ["object", "terrain"].contains(&door) {
            let ground = TriMesh::cuboid(
                [low.x as f32, (low.y - 0.5 * size) as f32, low.z as f32],
                [high.x as f32, low.y as f32, high.z as f32],
            );
            mesh::write(&self.folder.join("slab.ply"), &ground).expect("a mesh");
            // Over the whole terrain, around an object.
            let level = if door == "terrain" { 0.7 } else { 0.1 };
            let (bottom, top, fill) = (low.y - size, high.y + size, position.y + level * size);
            let terrain = if door == "terrain" { file } else { "slab.ply" };
            _ = write!(
                text,
                "[shallow]\nterrain = \"{terrain}\"\ncell = {cell}\nborder = \"closed\"\nbottom = {bottom}\ntop = {top}\nfill = {fill}\narea = \
                 [{}, {}, {}, {}]\n",
                low.x, low.z, high.x, high.z
            );
            if door == "object" {
                _ = write!(text, "[[object]]\nfile = \"{file}\"\n");
            }
            ("shallow", ("liquid", "inside_ml"))
        } else {
            let ground = if door == "ground" { format!("\"{file}\"") } else { format!("{}", low.y) };
            let depth = if door == "ground" { 0.3 * size } else { 1.7 * size };
            _ = write!(text, "[snow]\nground = {ground}\ndepth = {depth}\ncell = {cell}\n");
            if door != "ground" {
                _ = writeln!(text, "area = [{}, {}, {}, {}]", low.x, low.z, high.x, high.z);
                let role = if door == "moving" { "collide" } else { "static" };
                _ = write!(text, "[[object]]\nfile = \"{file}\"\nrole = \"{role}\"\n");
            }
            ("snow", ("base", "base_m3"))
        };
        std::fs::write(self.folder.join("shot.toml"), text).expect("a scene");
        let said = self.frazil(&format!("{system} shot.toml -o shot -q"));
        // Snow is as the objects have cut it; liquid as it was filled in, before it flows.
        let frame = if system == "snow" { 2 } else { 1 };
        let path = self.folder.join(format!("shot/report/{}.000{frame}.json", report.0));
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let found = serde_json::from_str::<Value>(&text).ok().and_then(|value| value[report.1].as_f64());
        (said, found)
    }

    /// A mesh that follows particles which rest.
    fn surface(&self, file: &str) -> (Said, Option<f64>) {
        let spacing = self.size / 12.0;
        let mut text = String::new();
        let mut count = 0;
        for at in 0..13 * 13 * 13 {
            let index = [at % 13, at / 13 % 13, at / 169].map(|index| f64::from(index) - 6.0);
            let at = self.position + DVec3::from(index) * spacing;
            _ = writeln!(text, "{} {} {} 0 0 0 {count}", at.x, at.y, at.z);
            count += 1;
        }
        let head = "property float x\nproperty float y\nproperty float z\nproperty float vx\nproperty float vy\nproperty float vz\n\
                    property int id";
        let text = format!("ply\nformat ascii 1.0\nelement vertex {count}\n{head}\nend_header\n{text}");
        for frame in 1..=2 {
            std::fs::write(self.folder.join(format!("drops.000{frame}.ply")), &text).expect("particles");
        }
        let set = "--set shot.frames=1-1";
        let said =
            self.frazil(&format!("surface -p drops.%04d.ply -m {file} --spacing {spacing} -o shot -q {set}"));
        let found =
            mesh::read(&self.folder.join("shot/surface/surface.0001.usdc")).ok().map(|mesh| mesh.volume());
        (said, found)
    }

    fn frazil(&self, arguments: &str) -> Said {
        let output = frazil(arguments.split_whitespace()).current_dir(self.folder).output().expect("frazil");
        let warnings = String::from_utf8_lossy(&output.stderr);
        // Snow on a rough ground is as thin as the scene asks for.
        let is_of_the_mesh = |line: &&str| line.contains("warn") || line.contains("error");
        let told: Vec<&str> = warnings.lines().filter(is_of_the_mesh).collect();
        let told = if output.status.success() { told.join("; ") } else { warnings.to_string() };
        Said {
            worked: output.status.success(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            warnings: told,
        }
    }
}
