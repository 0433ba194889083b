//! The help of a system's command lists its stages.

use std::fs;
use std::path::Path;

use crate::common::liquids::{ball, write_cache};
use crate::program::{CUBE, Folder, works};

/// The stages that a scene has: the tasks of a farm but the first and the last.
fn stages(folder: &Path, scene: &str) -> Vec<String> {
    let tasks = works(folder, &format!("jobs {scene} -o cache --chunk 1000 -q"));
    let names = tasks.lines().filter_map(|line| line.split(' ').next());
    names.filter(|name| !["prepare", "finish"].contains(name)).map(String::from).collect()
}

/// The stages that a help text lists.
fn listed(folder: &Path, command: &str) -> Vec<String> {
    let help = works(folder, &format!("{command} --help"));
    let lines =
        help.lines().skip_while(|line| *line != "Stages:").skip(1).take_while(|line| !line.is_empty());
    lines.filter_map(|line| line.split_whitespace().next()).map(String::from).collect()
}

#[test]
fn help_lists_the_stages_of_its_system() {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    write_cache(&folder, "spot", &ball(4.0, 8, 0.0), 2);
    let scenes = [
        (
            "snow",
            "[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.1\n[grains]\n[mist]\n\
             [output]\nfog = [\"base\"]\nobjects = [\"ply\"]\n[[object]]\nfile = \"cube.obj\"\n",
        ),
        ("surface", "[surface]\nparticles = \"spot.%04d.bgeo\"\n"),
        (
            "shallow",
            "[shallow]\nterrain = \"cube.obj\"\ncell = 0.02\n[[pour]]\nat = [0, 1, 0]\nradius = 0.1\nvolume_ml = 100\n",
        ),
    ];
    for (system, scene) in scenes {
        fs::write(folder.join("shot.toml"), format!("[shot]\nframes = \"1-2\"\n{scene}")).unwrap();
        let stages = stages(&folder, "shot.toml");
        assert!(stages.len() == if system == "snow" { 5 } else { 1 }, "{stages:?}");
        assert_eq!(listed(&folder, system), stages, "frazil {system} --help");
    }
    let help = works(&folder, "snow --help");
    assert!(help.contains("(base, grains, mist, volumes, objects)"), "--stage: {help}");
}
