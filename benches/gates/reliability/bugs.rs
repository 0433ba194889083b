//! Gate of the small inputs in `bugs/` of the outside data: each failed once, and its README says what must come out.

use std::path::{Path, PathBuf};

use crate::harness::Harness;
use crate::process;
use crate::scenes::wanted_data;

/// Volumes are right within this part.
const CLOSE: f64 = 0.02;
/// Folders of bugs, and particles in them.
const INSIDE_OUT: &str = "02-inside-out-part-vanishes";
const ROWS: &str = "13-ids-are-row-numbers";
const PLY: &str = "p.%04d.ply";

/// The count of cases whose result is not right.
pub fn run(h: &mut Harness) {
    let name = "reliability.bugs";
    let Some(data) = wanted_data(h, &[name], "bugs") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let cases = Bugs { data, folder: folder.path().into() }.cases();
    let wrong: Vec<&str> = cases.iter().filter(|(_, right)| !right).map(|(name, _)| *name).collect();
    h.gate(name, wrong.len() as f64, &format!("of {} cases {}", cases.len(), wrong.join(", ")));
}

struct Bugs {
    data: PathBuf,
    /// For outputs.
    folder: PathBuf,
}

/// What a run of the program said.
struct Said {
    code: i32,
    out: String,
    err: String,
}

impl Said {
    fn is_done(&self) -> bool {
        self.code == 0
    }

    /// Whether it warned, or refused in a sentence, with these words.
    fn objects(&self, words: &str) -> bool {
        let sentences = self.err.lines().chain(self.out.lines());
        self.code < 3
            && sentences
                .filter(|line| line.contains("warn") || self.code == 2)
                .any(|line| line.contains(words))
    }

    /// The number behind each mention of a name in its report.
    fn numbers(&self, name: &str) -> Vec<f64> {
        let lines = self.out.lines().filter_map(|line| line.trim_start().strip_prefix(name));
        lines.filter_map(|rest| rest.trim().parse().ok()).collect()
    }
}

impl Bugs {
    /// Each case, and whether its result is right.
    fn cases(&self) -> Vec<(&'static str, bool)> {
        vec![
            ("01 several solids", self.volume("01-stl-several-solids/two.stl", 3.0)),
            ("01 empty first solid", self.is_read("01-stl-several-solids/empty_first.stl")),
            ("02 from-mesh", self.makes_a_volume("02-inside-out-part-vanishes/boots.obj", 0.024)),
            ("02 sweep", self.sweeps_alike()),
            ("02 snow", self.snow_is_removed("boots") && self.snow_is_removed("boots_right")),
            ("02 shallow object", self.liquid_around(INSIDE_OUT, "block_inside_out", 84_000.0)),
            ("02 shallow terrain", self.liquid_on(INSIDE_OUT, "slab_block_inside_out", 84_000.0)),
            ("04 from-mesh", self.makes_a_volume("04-double-sided/box2.obj", 0.027)),
            ("04 shallow object", self.liquid_around("04-double-sided", "block2", 84_000.0)),
            ("04 shallow terrain", self.liquid_on("04-double-sided", "slab2", 100_000.0)),
            ("04 static object", self.statics_are_alike()),
            ("05 extensions", self.extensions()),
            ("07 channel without node", self.is_read("07-gltf-channel-without-node/pointer.glb")),
            ("08 instances", self.has_triangles("08-gltf-instances/three_stones.glb", 36.0)),
            ("09 clips of one name", self.clips_are_told_apart()),
            ("11 far terrain", self.info("11-utm-terrain/hills_utm.obj", "").objects("apart")),
            ("13 ids are rows", self.follows(ROWS, "rows/p.%04d.bgeo", "ball.ply").objects("row numbers")),
            ("13 stable ids", self.is_silent(ROWS, "stable/p.%04d.bgeo", "ball.ply")),
            ("14 from-particles", self.every_frame_is_surfaced()),
            ("14 surface", self.every_frame_is_followed()),
            ("15 continued lines", self.volume("15-obj-line-continuation/lf.obj", 1.0)),
            ("15 continued lines, CRLF", self.volume("15-obj-line-continuation/crlf.obj", 1.0)),
            ("15 continued vertex", self.volume("15-obj-line-continuation/v_line.obj", 1.0)),
            ("16 CR .obj", self.is_read("16-cr-headers/cr.obj")),
            ("16 CR .ply", self.volume("16-cr-headers/cr_ascii.ply", 1.0)),
            ("16 CR .ply header", self.is_read("16-cr-headers/cr_header.ply")),
            ("17 grids of one name", self.same_names_are_measured()),
            ("18 distances in voxels", self.offset_is_right("voxels") && self.union_is_right("voxels")),
            ("18 thin band", self.offset_is_right("thin") && self.union_is_right("thin")),
            ("19 velocities", self.velocities_are_usds()),
            ("20 text .stl", self.text_is_read()),
            ("21 mixed winding", self.mixed_winding()),
            ("ids are rows", self.follows("surface-ids_are_rows", PLY, "m.ply").objects("row numbers")),
            ("velocity unit", self.follows("surface-velocity_unit", PLY, "m.ply").objects("another unit")),
            ("inside-out words", self.inside_out_is_named()),
        ]
    }

    fn path(&self, name: &str) -> String {
        self.data.join(name).display().to_string()
    }

    /// The files of a bug with an ending.
    fn files(&self, bug: &str, ending: &str) -> Vec<String> {
        let files = std::fs::read_dir(self.data.join(bug)).expect("a folder").filter_map(Result::ok);
        let names = files.map(|entry| format!("{bug}/{}", entry.file_name().to_string_lossy()));
        names.filter(|name| name.ends_with(ending)).collect()
    }

    fn output(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    fn frazil(&self, arguments: &[&str]) -> Said {
        let output = process::frazil(arguments).output().expect("frazil");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Said {
            code: output.status.code().unwrap_or(255),
            out: text(&output.stdout),
            err: text(&output.stderr),
        }
    }

    fn info(&self, name: &str, option: &str) -> Said {
        let path = self.path(name);
        let all = ["info", &path, option];
        self.frazil(&all[..if option.is_empty() { 2 } else { 3 }])
    }

    fn is_read(&self, name: &str) -> bool {
        let said = self.info(name, "");
        said.is_done() && said.numbers("triangles").iter().any(|count| *count > 0.0)
    }

    fn has_triangles(&self, name: &str, count: f64) -> bool {
        self.info(name, "").numbers("triangles") == [count]
    }

    fn volume(&self, name: &str, expected: f64) -> bool {
        is_close(&self.info(name, "--measure").numbers("volume_m3"), expected)
    }

    /// The volume of a level set that a command makes.
    fn volume_of(&self, arguments: &[&str]) -> (Said, Vec<f64>) {
        let out = self.output("made.vdb");
        let said = self.frazil(&[arguments, &["-o", &out]].concat());
        let measured = self.frazil(&["info", &out, "--measure"]).numbers("volume_m3");
        (said, measured)
    }

    fn makes_a_volume(&self, name: &str, expected: f64) -> bool {
        is_close(&self.volume_of(&["vdb", "from-mesh", &self.path(name), "--cell", "0.02"]).1, expected)
    }

    fn swept(&self, name: &str) -> (Said, Vec<f64>) {
        self.volume_of(&["vdb", "sweep", &self.path(name), "--move", "0,0,0.2", "--cell", "0.02"])
    }

    fn sweeps_alike(&self) -> bool {
        let [made, right] = ["boots", "boots_right"]
            .map(|name| self.swept(&format!("02-inside-out-part-vanishes/{name}.obj")).1);
        right.first().is_some_and(|right| is_close(&made, *right))
    }

    /// A run of a scene of the data with other settings; the folder that it wrote.
    fn shot(&self, command: &str, scene: &Path, settings: &[String]) -> PathBuf {
        let out = self.folder.join("shot");
        let _ = std::fs::remove_dir_all(&out);
        let (scene, out_text) = (scene.display().to_string(), out.display().to_string());
        let sets: Vec<&str> = settings.iter().flat_map(|set| ["--set", set]).collect();
        self.frazil(&[&[command, &scene, "-o", &out_text, "-q"], &sets[..]].concat());
        out
    }

    fn snow_is_removed(&self, object: &str) -> bool {
        let bug = self.data.join(INSIDE_OUT);
        let file = format!("object.1.file={}", bug.join(format!("{object}.obj")).display());
        let out = self.shot("snow", &bug.join("snow.toml"), &[file]);
        let removed = |frame: u32| report(&out.join(format!("report/base.{frame:04}.json")), "removed_m3");
        is_close(&[(1..=3).filter_map(removed).sum()], 0.016)
    }

    /// Liquid of a scene with a terrain and, perhaps, an object.
    fn liquid(&self, folder: &str, terrain: &str, object: Option<&str>) -> Option<f64> {
        let mesh = |name: &str| self.path(&format!("{folder}/{name}.obj"));
        let mut text = format!(
            "[shot]\nframes = \"1-2\"\n[shallow]\nterrain = '{}'\ncell = 0.02\nborder = \"closed\"\nfill = 0.1\nbottom = -0.3\n\
             top = 0.5\n",
            mesh(terrain)
        );
        if let Some(object) = object {
            text += &format!("[[object]]\nfile = '{}'\n", mesh(object));
        }
        let scene = self.folder.join("shallow.toml");
        std::fs::write(&scene, text).expect("a scene");
        report(&self.shot("shallow", &scene, &[]).join("report/liquid.0001.json"), "inside_ml")
    }

    fn liquid_around(&self, folder: &str, object: &str, expected: f64) -> bool {
        self.liquid(folder, "slab", Some(object)).is_some_and(|held| is_close(&[held], expected))
    }

    fn liquid_on(&self, folder: &str, terrain: &str, expected: f64) -> bool {
        self.liquid(folder, terrain, None).is_some_and(|held| is_close(&[held], expected))
    }

    fn statics_are_alike(&self) -> bool {
        let volume = |object: &str| {
            let text = format!(
                "[shot]\nframes = \"1-1\"\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 0.6, 0.6]\ndepth = 0.3\ncell = 0.02\n\
                 [[object]]\nfile = '{}'\nrole = \"static\"\n",
                self.path(&format!("04-double-sided/{object}.obj"))
            );
            let scene = self.folder.join("static.toml");
            std::fs::write(&scene, text).expect("a scene");
            let base = self.shot("snow", &scene, &[]).join("base/base.0001.vdb");
            self.frazil(&["info", &base.display().to_string(), "--measure"]).numbers("volume_m3")
        };
        let (right, doubled) = (volume("block"), volume("block2"));
        right.first().is_some_and(|right| is_close(&doubled[..doubled.len().min(1)], *right))
    }

    fn extensions(&self) -> bool {
        let bug = "05-gltf-required-extensions";
        self.files(bug, ".glb").iter().all(|name| {
            let said = self.info(name, "");
            if name.contains("/acme") {
                said.code == 2 && said.err.contains("needs the glTF extension ACME_custom")
            } else {
                said.is_done()
            }
        })
    }

    fn clips_are_told_apart(&self) -> bool {
        let bug = self.path("09-gltf-clips-same-name/two_go.glb");
        let listed = self.frazil(&["info", &bug]);
        let posed = ["convert", &bug, &self.output("go.%04d.obj"), "--frames", "1-1", "--clip"];
        let choose = |clip: &str| self.frazil(&[&posed[..], &[clip]].concat());
        let are_listed = listed.out.contains("go #1") && listed.out.contains("go #2");
        are_listed && choose("go").objects("2 clips") && choose("go #2").is_done()
    }

    fn follows(&self, bug: &str, particles: &str, mesh: &str) -> Said {
        let out = self.folder.join("followed");
        let _ = std::fs::remove_dir_all(&out);
        let [particles, mesh] = [particles, mesh].map(|name| self.path(&format!("{bug}/{name}")));
        self.frazil(&["surface", "-p", &particles, "-m", &mesh, "-o", &out.display().to_string()])
    }

    fn is_silent(&self, bug: &str, particles: &str, mesh: &str) -> bool {
        let said = self.follows(bug, particles, mesh);
        said.is_done() && !said.err.contains("row numbers")
    }

    fn every_frame_is_surfaced(&self) -> bool {
        ["gone", "later"].iter().all(|kind| {
            let out = self.folder.join(format!("surfaced-{kind}"));
            let _ = std::fs::remove_dir_all(&out);
            std::fs::create_dir_all(&out).expect("a folder");
            let particles = self.path(&format!("14-empty-frames/{kind}/p.%04d.bgeo"));
            let meshes = out.join("m.%04d.ply").display().to_string();
            let by = ["--frames", "1-20", "--spacing", "0.1"];
            let arguments = [&["vdb", "from-particles", &particles, "--mesh", &meshes], &by[..]].concat();
            self.frazil(&arguments).is_done() && count(&out) == 20
        })
    }

    fn every_frame_is_followed(&self) -> bool {
        // Where the liquid comes later, the mesh has nothing to follow in its first frame: that may be refused, in words.
        let is_whole = |said: &Said| said.is_done() && count(&self.folder.join("followed/surface")) == 20;
        let follows =
            |kind: &str| self.follows("14-empty-frames", &format!("{kind}/p.%04d.bgeo"), "ball.ply");
        let gone = is_whole(&follows("gone"));
        let later = follows("later");
        gone && (is_whole(&later) || later.code == 2)
    }

    fn same_names_are_measured(&self) -> bool {
        let ball = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let volumes = self.info("17-info-same-name-grids/same.vdb", "--measure").numbers("volume_m3");
        volumes.len() == 2 && is_close(&volumes[..1], ball(0.5)) && (volumes[1] / ball(0.2) - 1.0).abs() < 0.1
    }

    fn offset_is_right(&self, name: &str) -> bool {
        let grid = self.path(&format!("18-levelset-values-not-metres/{name}.vdb"));
        let (said, volume) = self.volume_of(&["vdb", "offset", &grid, "--by", "0.1"]);
        said.code == 2 || is_close_within(&volume, 4.0 / 3.0 * std::f64::consts::PI * 0.6f64.powi(3), 0.03)
    }

    fn union_is_right(&self, name: &str) -> bool {
        let grid = |name: &str| self.path(&format!("18-levelset-values-not-metres/{name}.vdb"));
        let (said, volume) = self.volume_of(&["vdb", "union", &grid("metres"), &grid(name)]);
        said.code == 2 || is_close(&volume, 0.52)
    }

    fn velocities_are_usds(&self) -> bool {
        let out = self.output("velocity.usda");
        let said = self.frazil(&["convert", &self.path("19-points-velocity-usd/velocity.bgeo"), &out]);
        let text = std::fs::read_to_string(&out).unwrap_or_default();
        said.is_done() && text.contains("vector3f[] velocities")
    }

    /// Each is read, with as many triangles as the others.
    fn text_is_read(&self) -> bool {
        let bug = "20-stl-text-variants";
        let names = self.files(bug, ".stl");
        let counts: Vec<_> = names.iter().map(|name| self.info(name, "").numbers("triangles")).collect();
        counts.iter().all(|count| count.len() == 1 && *count == counts[0])
    }

    fn mixed_winding(&self) -> bool {
        let mesh = self.path("21-mixed-winding/mixed.obj");
        let (said, volume) = self.volume_of(&["vdb", "from-mesh", &mesh, "--cell", "0.02"]);
        let [mixed, ball] = ["mixed", "ball"].map(|name| self.swept(&format!("21-mixed-winding/{name}.obj")));
        (is_close(&volume, 0.506) || said.objects("mixed.obj"))
            && (ball.1.first().is_some_and(|ball| is_close(&mixed.1, *ball)) || mixed.0.objects("mixed.obj"))
    }

    fn inside_out_is_named(&self) -> bool {
        let said = self.follows("surface-inside_out_words", PLY, "in.ply");
        !said.err.contains("as its indices connect it")
    }
}

fn is_close(values: &[f64], expected: f64) -> bool {
    is_close_within(values, expected, CLOSE)
}

fn is_close_within(values: &[f64], expected: f64, part: f64) -> bool {
    values.len() == 1 && (values[0] / expected - 1.0).abs() < part
}

/// A number of a report.
fn report(path: &Path, key: &str) -> Option<f64> {
    let value: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    find(&value, key)
}

/// The first number of this name, at any depth.
fn find(value: &serde_json::Value, key: &str) -> Option<f64> {
    let fields = value.as_object()?;
    fields
        .get(key)
        .and_then(serde_json::Value::as_f64)
        .or_else(|| fields.values().find_map(|value| find(value, key)))
}

fn count(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}
