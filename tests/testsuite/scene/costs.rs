//! What a run says before it begins: which frames it computes, and what they cost in comparison with each other.

use std::fs;

use frazil::context::{Context, Pool};
use frazil::scene::run::{FrameCosts, Run, ToMake};
use frazil::scene::{FrameChoice, Inputs, Override, Scene, snow, surface};

use crate::common::liquids::{ball, write_cache};
use crate::program::{CUBE, Folder};

/// A cube that waits above the snow until frame 4, dives into it until frame 8, and stays there.
const SCENE: &str = "[shot]\nframes = \"1-12\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.0]\ndepth = 0.2\n\
                     cell = 0.02\n[grains]\n[mist]\n[output]\nmesh = [\"usd\"]\n[[object]]\nfile = \"cube.obj\"\n\
                     keys = [{ frame = 4, at = [0, 0.3, 0] }, { frame = 8, at = [0, 0.1, 0.4] }]\n";

fn context() -> Context {
    Context::new(Pool::new(2).unwrap())
}

/// What the frames of stages of the shot are expected to cost.
fn costs(folder: &Folder, stages: &[&'static str], settings: &[&str]) -> FrameCosts {
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let settings: Vec<Override> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let scene = Scene::parse(SCENE, &folder.join("shot.toml"), &settings).unwrap();
    let inputs = Inputs::load(&scene).unwrap();
    let to_make: Vec<ToMake> = stages
        .iter()
        .map(|stage| ToMake { stage, frames: (1..=12).map(|frame| frame..=frame).collect() })
        .collect();
    snow::costs(&context(), &scene, &inputs, &folder.join("out"), &to_make).unwrap()
}

#[test]
fn frames_cost_what_there_is_to_do_in_them() {
    let folder = &Folder::empty();
    let stages = ["base", "grains", "mist", "volumes"];
    let all = costs(folder, &stages, &[]);
    let cost = |costs: &FrameCosts, stage: &str, frame: i32| costs.sum(stage, frame..=frame);
    // Where the object moves through the snow.
    assert!(cost(&all, "base", 7) > 1.05 * cost(&all, "base", 2));
    // Grains gather; mist begins with them, and is gone only long afterwards.
    assert!(cost(&all, "grains", 7) > cost(&all, "grains", 2));
    assert!(cost(&all, "mist", 7) > 10.0 * cost(&all, "mist", 2) && cost(&all, "mist", 12) > 0.5);
    // Finer snow, grains and mist.
    let finer = costs(folder, &stages, &["snow.cell=0.01", "grains.radius=0.004", "mist.cell=0.01"]);
    for stage in ["base", "grains", "mist", "volumes"] {
        assert!(cost(&finer, stage, 10) > 1.3 * cost(&all, stage, 10), "{stage}");
    }
}

#[test]
fn grains_that_are_not_known_cost_something() {
    let folder = &Folder::empty();
    // The heights of a level set are not known before the base is made.
    let scene = SCENE
        .replace("depth = 0.2\n", "top = \"layer.vdb\"\n")
        .replace("area = [-0.5, -0.5, 0.5, 1.0]\n", "");
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    make_layer(folder);
    let scene = Scene::parse(&scene, &folder.join("shot.toml"), &[]).unwrap();
    let inputs = Inputs::load(&scene).unwrap();
    let to_make = [ToMake { stage: "grains", frames: vec![1..=1] }];
    let costs = snow::costs(&context(), &scene, &inputs, &folder.join("out"), &to_make).unwrap();
    assert!((0.1..1.0).contains(&costs.sum("grains", 12..=12)));
}

/// A level set of the snow: the base of the shot's first frame.
fn make_layer(folder: &Folder) {
    let scene = Scene::parse(SCENE, &folder.join("shot.toml"), &[]).unwrap();
    let inputs = Inputs::load(&scene).unwrap();
    let pipeline = snow::pipeline(&scene, &inputs);
    let (ctx, stages) = (context(), ["base".to_string()]);
    let first: FrameChoice = "1".parse().unwrap();
    let run = Run::prepare(&ctx, &pipeline, &folder.join("layer"), &stages, &first, None).unwrap();
    run.make(&ctx, |_| ()).unwrap();
    fs::copy(folder.join("layer/base/base.0001.vdb"), folder.join("layer.vdb")).unwrap();
}

#[test]
fn a_run_tells_which_frames_it_computes_for_each_that_it_writes() {
    let folder = &Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = Scene::parse(SCENE, &folder.join("shot.toml"), &[]).unwrap();
    let inputs = Inputs::load(&scene).unwrap();
    let pipeline = snow::pipeline(&scene, &inputs);
    let (ctx, stages) = (context(), ["base".to_string(), "objects".to_string()]);
    let prepare = |frames: &str| {
        Run::prepare(&ctx, &pipeline, &folder.join("out"), &stages, &frames.parse().unwrap(), None).unwrap()
    };
    let of = |stage: &'static str, frames: [std::ops::RangeInclusive<i32>; 2]| ToMake {
        stage,
        frames: frames.to_vec(),
    };
    let run = prepare("2-5x3");
    // Each frame of the base continues the one before; those of objects are alone.
    assert_eq!(run.to_make(), [of("base", [1..=2, 3..=5]), of("objects", [2..=2, 5..=5])]);
    run.make(&ctx, |done| assert!(done.pace.ahead <= 1)).unwrap();
    let run = prepare("5-8x3");
    let base = ToMake { stage: "base", frames: vec![6..=8] };
    assert_eq!(run.to_make(), [base, ToMake { stage: "objects", frames: vec![8..=8] }]);
}

#[test]
fn a_mesh_on_a_liquid_costs_what_is_computed_ahead_at_once() {
    let folder = &Folder::empty();
    write_cache(folder, "ball", &ball(3.0, 6, 0.2), 8);
    let costs = |frames: &str, from: i32| {
        let text = format!(
            "[shot]\nframes = \"{frames}\"\n[surface]\nparticles = \"ball.%04d.bgeo\"\nmesh = \"ball.ply\"\nspacing = 0.01\nahead = 2\n"
        );
        let scene = Scene::parse(&text, &folder.join("shot.toml"), &[]).unwrap();
        let inputs = surface::Inputs::load(&context(), &scene).unwrap();
        let to_make = [ToMake { stage: "surface", frames: vec![from..=from] }];
        let costs = surface::costs(&scene, scene.surface().unwrap(), &inputs, &to_make);
        scene
            .shot()
            .frames
            .iter()
            .map(|frame| costs.sum("surface", frame..=frame).floor())
            .collect::<Vec<_>>()
    };
    // With the three frames after the one that is written.
    assert_eq!(costs("1-8", 1), [4.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(costs("1-8", 4)[2..5], [1.0, 4.0, 1.0]);
    // Particles after the shot are read.
    assert_eq!(costs("1-6", 1), [4.0, 1.0, 1.0, 1.0, 1.0, 0.0]);
}
