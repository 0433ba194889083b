//! Blender and usd-core open a shot; each is skipped where it is not installed.

use crate::common::skip::skipped;
use std::fs;
use std::process::Command;

use crate::common::clients;
use crate::common::shapes;
use crate::program::Folder;

/// Grains, and all that is made of them and the snow.
const VOLUMES: &str = "[grains]\ncompression = 0.5\n[output]\ngrains = [\"vdb\", \"usd\"]\nfog = [\"base\", \"grains\"]\n\
                       snow = true\nmesh = [\"usd\"]";

/// All three parts, as the script for Blender wants them.
const PARTS: &str =
    "[grains]\ncompression = 0.5\n[mist]\n[output]\ngrains = [\"vdb\", \"ply\"]\nmesh = [\"ply\"]";

/// A shot of a box that crosses the snow, frames 3 to 8; with tables in place of `[output]`.
fn shot(tables: &str) -> Folder {
    let folder = Folder::empty();
    let mesh = shapes::cuboid([0.4; 3]);
    // Seams at every edge.
    let corners = (0..3 * mesh.triangles.len() as u32).map(|corner| corner % 4).collect();
    let positions = vec![[0.0, 0.0], [0.75, 0.0], [0.5, 1.0], [0.25, -2.0]];
    let uvs = frazil::geometry::Uvs { coordinates: positions, corners: Some(corners), missing: 0 };
    let carried = frazil::io::mesh::Carried { uvs: Some(&uvs), ..Default::default() };
    frazil::io::mesh::write_carried(&folder.join("box.obj"), &mesh, &carried).unwrap();
    let scene = "[shot]\nframes = \"3-8\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.02\n\
                 [output]\nobjects = [\"usd\"]\n[[object]]\nfile = \"box.obj\"\n\
                 keys = [{ frame = 3, at = [0, 0.4, -0.5] }, { frame = 8, at = [0, 0.25, 0.6], turn_deg = [0, 20, 0] }]\n";
    fs::write(folder.join("shot.toml"), scene.replace("[output]", tables)).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_frazil"))
        .current_dir(folder.path())
        .args(["snow", "shot.toml", "-o", "out", "-q"])
        .status();
    assert!(run.unwrap().success());
    folder
}

#[test]
fn blender_imports_the_sequence_as_one_volume_and_renders_it() {
    let Some(blender) = clients::blender() else { return skipped("no blender") };
    let folder = shot("[output]");
    clients::blender_opens(&blender, &folder.join("out"), 3, 8).unwrap();
}

#[test]
fn blender_renders_base_grains_and_mist_with_the_script_for_users() {
    let Some(blender) = clients::blender() else { return skipped("no blender") };
    let folder = shot(PARTS);
    let picture = folder.join("frame.png");
    let said = clients::blender_renders(&blender, &folder.join("out"), 8, &picture).unwrap();
    assert!(said.ends_with("with base, grains, mist"), "{said}");
    assert!(fs::metadata(&picture).unwrap().len() > 5000);
}

#[test]
fn usd_core_composes_the_stage_with_velocities_and_files() {
    let Some(python) = clients::usd_python() else { return skipped("no usd-core") };
    let folder = shot("[output]");
    let said = clients::usd_composes(&python, &folder.join("out"), 3, 8).unwrap();
    assert!(said.contains("3 with UVs"), "{said}");
}

#[test]
fn validators_find_no_error_in_a_shot_with_all_its_parts() {
    let Some(python) = clients::validators() else { return skipped("no usd-validation-nvidia") };
    let mist =
        VOLUMES.replace("[output]", "[mist]\n[output]").replace("\"base\", \"grains\"", "\"base\", \"mist\"");
    let folder = shot(&mist);
    let said = clients::usd_is_whole(&python, &folder.join("out")).unwrap();
    // Of six frames: base, removed, grains, mist, two densities of fog, snow, mesh and the box.
    assert!(said.starts_with("54 parts"), "{said}");
}

#[test]
fn usd_core_composes_grains_and_volumes_with_materials() {
    let Some(python) = clients::usd_python() else { return skipped("no usd-core") };
    let folder = shot(VOLUMES);
    let said = clients::usd_composes(&python, &folder.join("out"), 3, 8).unwrap();
    assert!(said.contains(" grains") && !said.contains(" 0 grains"), "{said}");
    assert!(said.contains("5 volumes") && said.contains("a mesh of snow"), "{said}");
}
