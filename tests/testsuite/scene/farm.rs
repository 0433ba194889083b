//! Farms: a shot in parts, by many processes, is the shot of one.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::common::character::output;
use crate::program::{CUBE, Folder, command, fails, works};

/// A cube that slides through snow, with grains, and files to render.
fn folder(frames: u32) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\ncell = 0.05\n\
         [grains]\n[output]\nfog = [\"base\", \"grains\"]\nmesh = [\"usd\"]\nobjects = [\"usd\"]\n\
         [[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, {{ frame = {frames}, at = [0, 0.1, 0.9] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

/// Names, tasks that come before, and commands.
fn jobs(folder: &Path, out: &str) -> Vec<[String; 3]> {
    let program = env!("CARGO_BIN_EXE_frazil");
    let text = works(folder, &format!("jobs shot.toml -o {out} --chunk 3 --program {program}"));
    text.lines()
        .map(|line| line.splitn(3, ' ').map(String::from).collect::<Vec<_>>().try_into().unwrap())
        .collect()
}

fn shell(folder: &Path, text: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-c", text]);
    shell
}

/// The files of a folder, without what differs from run to run: times in reports.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    output(folder).into_iter().filter(|(name, _)| !name.contains("report/")).collect()
}

#[test]
fn chunks_by_many_processes_are_the_shot_of_one() {
    let folder = &folder(8);
    works(folder, "snow shot.toml -o one -q");
    let jobs = jobs(folder, "farm");
    let names: Vec<&str> = jobs.iter().map(|[name, ..]| &name[..]).collect();
    assert_eq!(
        names,
        [
            "prepare", "base", "grains", "volumes", "volumes", "volumes", "objects", "objects", "objects",
            "finish"
        ]
    );
    let after = |name: &str| &jobs.iter().find(|[own, ..]| own == name).unwrap()[1];
    assert_eq!(
        ["prepare", "base", "grains", "volumes", "objects", "finish"].map(|name| &after(name)[..]),
        ["-", "prepare", "base", "grains", "grains", "volumes,objects"]
    );
    let run = |[_, _, text]: &[String; 3]| assert!(shell(folder, text).status().unwrap().success(), "{text}");
    jobs[..3].iter().for_each(run);
    // What is left to do is said, and nothing is written.
    let finish = &jobs[9][2];
    let said = shell(folder, finish).output().unwrap();
    let words = String::from_utf8_lossy(&said.stderr).into_owned();
    assert_eq!(said.status.code(), Some(1), "{words}");
    assert!(words.contains("8 of stage volumes, 8 of stage objects"), "{words}");
    // All chunks at once, each twice, some killed.
    let mut children: Vec<_> = jobs[3..9]
        .iter()
        .chain(&jobs[3..9])
        .map(|[_, _, text]| shell(folder, &format!("exec {text}")).spawn().unwrap())
        .collect();
    std::thread::sleep(Duration::from_millis(50));
    children.iter_mut().step_by(3).for_each(|child| child.kill().unwrap());
    children.iter_mut().for_each(|child| _ = child.wait().unwrap());
    jobs[3..].iter().for_each(run);
    let [one, farm] = ["one", "farm"].map(|name| files(&folder.join(name)));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&farm));
    for ((name, a), (_, b)) in one.iter().zip(&farm).filter(|((name, _), _)| !name.ends_with("files.json")) {
        assert!(a == b, "{name}");
    }
    assert!(works(folder, "check farm").contains("all of them"));
}

#[test]
fn chunks_and_runs_keep_out_of_each_others_way() {
    let folder = &folder(400);
    let chunk = |stage: &str, frames: &str| {
        format!("snow shot.toml -o out --chunk --stage {stage} --frames {frames}")
    };
    fails(folder, &chunk("objects", "1-3"), 2, &["out", "--prepare"]);
    fails(folder, "snow shot.toml -o out --finish", 2, &["out", "--prepare"]);
    assert!(!folder.join("out").exists());
    works(folder, "snow shot.toml -o out -q --prepare --frames 1-300");
    fails(folder, &chunk("base", "1-3"), 2, &["stage base", "chunks"]);
    fails(folder, &chunk("objects", "300-301"), 2, &["frame 301", "--prepare"]);
    fails(folder, "snow shot.toml -o out --chunk --frames 1-3", 2, &["--stage"]);
    fails(folder, &format!("{} --set snow.depth=0.2", chunk("volumes", "1-3")), 2, &["volumes"]);
    // A chunk whose base is not there yet.
    fails(folder, &chunk("volumes", "1-3"), 2, &["base"]);
    let mut run = command(folder, "snow shot.toml -o out -q --stage base --frames 1-300").spawn().unwrap();
    while !folder.join("out/state/base.0001.json").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    fails(folder, &chunk("objects", "1-3"), 75, &["another run"]);
    run.kill().unwrap();
    run.wait().unwrap();
    // Chunks beside a chunk, but no run. This process holds the lock as a chunk at work does.
    let lock = fs::File::options().append(true).open(folder.join("out/state/run.lock")).unwrap();
    lock.lock_shared().unwrap();
    works(folder, &format!("{} -q", chunk("objects", "1-3")));
    fails(folder, "snow shot.toml -o out -q --stage objects --frames 1-5", 75, &["another run"]);
    lock.unlock().unwrap();
    works(folder, "snow shot.toml -o out -q --stage objects --frames 1-5");
}

#[test]
fn templates_name_every_task() {
    let folder = &folder(8);
    let script = works(folder, "jobs shot.toml -o out --for slurm --chunk 3");
    for words in [
        "job_grains=$(sbatch --parsable --requeue",
        "--dependency=afterok:${job_base}",
        "--array=0-2",
        "set -- 1-3 4-6 7-8; shift \"$SLURM_ARRAY_TASK_ID\"",
        "--dependency=afterok:${job_volumes}:${job_objects}",
    ] {
        assert!(script.contains(words), "no {words} in {script}");
    }
    assert!(shell(folder, &format!("sbatch() {{ echo 7; }}\n{script}")).status().unwrap().success());
    // A job queues itself again if it was busy, or was killed up to three times.
    let script = works(folder, "jobs shot.toml -o out --for slurm --program made");
    let slurm = "made() { return \"$CODE\"; }\nscontrol() { echo \"$*\" >&2; }\n\
         sbatch() { for word; do :; done; (eval \"${word#--wrap=}\") >&2 || :; echo 7; }\n";
    for (code, restarts, wanted) in [("75", "9", 6), ("137", "2", 6), ("137", "3", 0), ("1", "0", 0)] {
        let said = shell(folder, &format!("{slurm}{script}"))
            .envs([("CODE", code), ("SLURM_RESTART_COUNT", restarts)])
            .envs([("SLURM_JOB_ID", "5"), ("SLURM_ARRAY_TASK_ID", "0")])
            .output()
            .unwrap();
        assert!(said.status.success());
        let words = String::from_utf8_lossy(&said.stderr).into_owned();
        assert_eq!(words.matches("requeue 5").count(), wanted, "{code} {restarts}: {words}");
    }
    let template = works(folder, "jobs shot.toml -o out --for openjd --chunk 3");
    let template: serde_json::Value = serde_json::from_str(&template).unwrap();
    let volumes =
        template["steps"].as_array().unwrap().iter().find(|step| step["name"] == "volumes").unwrap();
    assert_eq!(
        volumes["parameterSpace"]["taskParameterDefinitions"][1]["range"],
        serde_json::json!([3, 6, 8])
    );
    assert_eq!(volumes["dependencies"][0]["dependsOn"], "grains");
    fails(folder, "jobs shot.toml -o a{{b --for openjd", 2, &["a{{b", "expression"]);
    fails(&self::folder(1025), "jobs shot.toml -o out --for openjd --chunk 1", 2, &["1025", "--chunk"]);
}
