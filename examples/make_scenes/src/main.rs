//! Writes the demonstration scenes and their meshes, all made by code: `make_scenes DIR`.

#[path = "../../../tests/common"]
#[allow(dead_code)]
mod common {
    pub mod boot;
    pub mod hero;
    pub mod jelly;
    pub mod liquids;
    pub mod shapes;
    pub mod sleigh;
    pub mod walk;
}
mod drip;
mod spills;
mod stages;

use std::fmt::Write;
use std::path::Path;

use common::boot::{left_boot, right_boot};
use common::hero;
use common::jelly::Jelly;
use common::shapes::{cuboid, sphere};
use common::sleigh::sleigh;
use common::walk::{Step, walk};
use frazil::geometry::points::Points;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::files::atomic;
use frazil::io::mesh;
use frazil::io::particles::ply;

fn main() -> frazil::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/demo".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| frazil::Error::io(folder, "create the folder", error))?;
    mesh::write(&folder.join("boot_left.obj"), &left_boot())?;
    mesh::write(&folder.join("boot_right.obj"), &right_boot())?;
    mesh::write(&folder.join("box.obj"), &cuboid([0.2; 3]))?;
    mesh::write(&folder.join("cube.obj"), &cuboid([0.4; 3]))?;
    mesh::write(&folder.join("ball.obj"), &sphere(0.18, 32))?;
    mesh::write(&folder.join("sleigh.obj"), &sleigh())?;
    mesh::write(&folder.join("drifts.obj"), &drifts())?;
    atomic::write_bytes(&folder.join("column.ply"), &ply::to_bytes(&column()?)?)?;
    atomic::write_bytes(&folder.join("hero.glb"), &hero::glb())?;
    // Some 15,000 particles under 144,000 triangles.
    Jelly::new(0.0125, 190).write(folder)?;
    // Some 6,000 particles under 50,000 triangles.
    drip::write(folder)?;
    spills::write(folder)?;
    stages::write(folder)?;
    for (name, text) in [
        ("hero", hero()),
        ("walker", walker()),
        ("box", sliding_box()),
        ("cube", turning_cube()),
        ("ball", rolling_ball()),
        ("plough", plough()),
    ] {
        atomic::write_bytes(&folder.join(format!("{name}.toml")), text.as_bytes())?;
    }
    Ok(())
}

/// The surface of snow that the wind has shaped, 3.2 x 6 m around the origin, some 0.27 m above the ground.
fn drifts() -> TriMesh {
    const EDGE: f32 = 0.03;
    let [across, along] = [107u32, 201];
    let height = |x: f32, z: f32| {
        let bend = x + 0.35 * (0.9 * z).sin() + 0.12 * (2.3 * z + x).sin();
        let ripples = 0.6 + 0.4 * (1.3 * x - 0.8 * z).sin();
        0.27 + 0.035 * (2.1 * bend + 0.8 * z).sin() + 0.008 * ripples * (13.0 * bend + 4.0 * z).sin()
    };
    let position = |index: u32| {
        let [x, z] = [(index % across, across), (index / across, along)]
            .map(|(at, count)| EDGE * (at as f32 - 0.5 * (count - 1) as f32));
        Vec3::new(x, height(x, z), z)
    };
    let square = |index: u32| {
        let [a, b, c, d] = [index, index + across, index + across + 1, index + 1];
        [[a, b, c], [a, c, d]]
    };
    let is_square = |index: &u32| index % across + 1 < across && index / across + 1 < along;
    let triangles = (0..across * along).filter(is_square).flat_map(square).collect();
    TriMesh { positions: (0..across * along).map(position).collect(), triangles }
}

/// A block of loose grains of a diameter of 6 mm, 0.18 x 0.18 x 0.18 m, that stands at a height of 0.1 m; they do not touch.
fn column() -> frazil::Result<Points> {
    const APART: f64 = 0.0062;
    let mut state = 1u64;
    // Numbers that look random and are always the same (Knuth's MMIX).
    let mut off = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 40) as f64 / (1u64 << 24) as f64 - 0.5) * 0.02 * APART
    };
    let mut positions = Vec::new();
    for layer in 0..40 {
        for (x, z) in (0..29).flat_map(|x| (0..29).map(move |z| (x, z))) {
            // Each layer lies in the hollows of the one below.
            let shift = 0.5 * f64::from(layer % 2) - 14.25;
            let at = [f64::from(x) + shift, f64::from(layer) * 0.5f64.sqrt() + 0.5, f64::from(z) + shift];
            let [x, y, z] = at.map(|at| at * APART + off());
            positions.push(DVec3::new(x, y + 0.1, z));
        }
    }
    Points::at(APART, &positions)
}

fn head(frames: &str, area: [f64; 4], cell: f64) -> String {
    format!(
        "[shot]\nframes = \"{frames}\"\n\n[snow]\nground = 0.0\narea = {area:?}\ndepth = 0.30\ncell = {cell}\n"
    )
}

fn object(text: &mut String, file: &str, keys: &[Step]) {
    let _ = writeln!(text, "\n[[object]]\nfile = \"{file}\"\nkeys = [");
    for key in keys {
        let rounded = |values: [f64; 3]| values.map(|value| (value * 1e5).round() / 1e5);
        let (at, turn) = (rounded(key.at), rounded(key.turn_deg));
        let _ = writeln!(text, "    {{ frame = {}, at = {at:?}, turn_deg = {turn:?} }},", key.frame);
    }
    text.push_str("]\n");
}

/// A skinned figure that crosses the snow at the speed of its feet: base layer, grains and mist.
fn hero() -> String {
    let mut text = head("1-72", [-0.8, -2.5, 0.8, 1.5], 0.01);
    text.push_str(
        "noise = { amplitude = 0.012, size = 0.07 }\n\n[grains]\npreset = \"packed\"\ncompression = 0.4\n",
    );
    text.push_str(
        "\n[mist]\ncell = 0.02\nfrom_speed = 1.2\nhalf_life = 0.5\nturbulence = 3.0\nturbulence_size = 0.4\n",
    );
    let last = 1.1 * 71.0 / 24.0;
    let _ = write!(
        text,
        "\n[[object]]\nfile = \"hero.glb\"\nclip = \"walk\"\nkeys = [\n    {{ frame = 1, at = [0.0, 0.12, -2.2] }},\n    \
         {{ frame = 72, at = [0.0, 0.12, {:.4}] }},\n]\n",
        last - 2.2
    );
    text
}

/// Two treaded boots, 48 frames: heel strike, roll, toe-off.
fn walker() -> String {
    let mut text = head("1-48", [-0.6, -0.2, 0.6, 3.6], 0.004);
    // Less than the default, for treads 15 mm deep to stay.
    text.push_str("noise = { amplitude = 0.005, size = 0.04 }\n");
    object(&mut text, "boot_left.obj", &walk(1.0, 48, 0.12));
    object(&mut text, "boot_right.obj", &walk(-1.0, 48, 0.12));
    text
}

fn two_keys(last: i32, from: [f64; 3], to: [f64; 3], turn_deg: [f64; 3]) -> [Step; 2] {
    [Step { frame: 1, at: from, turn_deg: [0.0; 3] }, Step { frame: last, at: to, turn_deg }]
}

/// A box that crosses 0.4 m of snow in each frame.
fn sliding_box() -> String {
    let mut text = head("1-5", [-1.1, -0.5, 1.1, 0.5], 0.005);
    object(&mut text, "box.obj", &two_keys(5, [-0.8, 0.28, -0.15], [0.8, 0.22, 0.15], [10.0, 35.0, 20.0]));
    text
}

/// A cube that turns in its position, half sunk.
fn turning_cube() -> String {
    let mut text = head("1-7", [-0.6, -0.6, 0.6, 0.6], 0.005);
    object(&mut text, "cube.obj", &two_keys(7, [0.0, 0.35, 0.0], [0.0, 0.35, 0.0], [30.0, 60.0, 90.0]));
    text
}

/// A ball that is pulled through the snow and heaps it up: with grains.
fn plough() -> String {
    let mut text = head("1-22", [-0.5, -0.45, 0.7, 0.45], 0.009);
    text.push_str(
        "noise = { amplitude = 0.004, size = 0.05 }\n\n[grains]\npreset = \"packed\"\ncompression = 0.3\n",
    );
    object(&mut text, "ball.obj", &two_keys(22, [-0.8, 0.4, 0.0], [0.35, 0.36, 0.0], [0.0; 3]));
    text
}

/// A ball that rolls through the snow.
fn rolling_ball() -> String {
    let turn = 1.8 / 0.18f64;
    let mut text = head("1-24", [-1.2, -0.5, 1.2, 0.5], 0.005);
    object(
        &mut text,
        "ball.obj",
        &two_keys(24, [-0.9, 0.26, 0.0], [0.9, 0.26, 0.0], [0.0, 0.0, -turn.to_degrees()]),
    );
    text
}
