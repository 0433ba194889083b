//! Every example in the README and in `--help` runs as it stands.

use assert_cmd::Command;
use std::fs;
use std::path::Path;

const CUBE: &str = "v -.2 0 -.2\nv .2 0 -.2\nv .2 .4 -.2\nv -.2 .4 -.2\nv -.2 0 .2\nv .2 0 .2\nv .2 .4 .2\nv -.2 .4 .2\n\
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
const README: &str = include_str!("../README.md");

/// Runs a line `frazil ...` in a folder and gives what it says on stdout.
#[track_caller]
fn works(folder: &Path, line: &str) -> String {
    let line = line.split(" #").next().unwrap();
    // A shell would put the output into the file behind `>`.
    let (line, file) = line.split_once(" > ").map_or((line, None), |(line, file)| (line, Some(file.trim())));
    let arguments = line.split_whitespace().skip(1);
    let output = Command::cargo_bin("frazil").unwrap().current_dir(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    if let Some(file) = file {
        fs::write(folder.join(file), &output.stdout).unwrap();
    }
    String::from_utf8(output.stdout).unwrap()
}

/// The first block of a kind in the README: "toml", "sh" after the heading "Commands".
fn block(kind: &str) -> &'static str {
    let commands = README.split("## Commands").nth(1).unwrap();
    commands.split(&format!("```{kind}\n")).nth(1).unwrap().split("```").next().unwrap()
}

#[test]
fn the_readme_runs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("boot.obj"), CUBE).unwrap();
    // As in the README but for the cells: a test need not be fine.
    let scene = block("toml").replace("cell = 0.005", "cell = 0.02");
    assert!(scene.contains("cell = 0.02"));
    fs::write(folder.path().join("shot.toml"), scene).unwrap();
    let lines: Vec<&str> = block("sh").lines().filter(|line| line.starts_with("frazil ")).collect();
    assert!(lines.len() >= 4, "{lines:?}");
    lines.iter().for_each(|line| {
        works(folder.path(), line);
    });
}

/// The commands that a help text lists, each with the command before it.
fn commands_of(folder: &Path, command: &str) -> Vec<String> {
    let help = works(folder, &format!("{command} --help"));
    let listed =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    names.map(|name| format!("{command} {name}")).collect()
}

#[test]
fn every_command_has_help_with_an_example_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["boot", "box", "bunny", "before", "after", "body.0001", "body.0002"] {
        fs::write(folder.join(format!("{name}.obj")), CUBE).unwrap();
    }
    let scene = "[shot]\nframes = \"1-48\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
                 cell = 0.05\n[[object]]\nfile = \"boot.obj\"\nkeys = [{ frame = 1 }, { frame = 48, at = [0, 0, 1] }]\n";
    fs::write(folder.join("walker.toml"), scene).unwrap();
    works(folder, "frazil snow walker.toml -o cache -q");
    for (name, by) in [("left", "0.1,0,0"), ("snow", "0,0.1,0")] {
        works(folder, &format!("frazil vdb sweep box.obj --move {by} --cell 0.02 -o {name}.vdb -q"));
    }
    works(folder, "frazil vdb from-mesh box.obj --cell 0.02 -o boot.vdb");
    works(folder, "frazil vdb from-mesh box.obj --cell 0.02 -o right.vdb");
    let mut commands = vec!["frazil".to_string()];
    commands.extend(commands_of(folder, "frazil"));
    for group in ["frazil vdb", "frazil mesh"] {
        commands.extend(commands_of(folder, group));
    }
    assert!(commands.len() >= 1 + 8 + 10 + 1, "{commands:?}");
    for command in commands {
        let help = works(folder, &format!("{command} --help"));
        let examples: Vec<&str> = help.lines().filter_map(|line| line.strip_prefix("  frazil ")).collect();
        assert!(!examples.is_empty(), "{command} has no example: {help}");
        for example in examples.iter().flat_map(|line| line.split(" && ")) {
            // Fine cells take long and prove nothing more.
            let line = format!("frazil {}", example.strip_prefix("frazil ").unwrap_or(example));
            works(folder, &line.replace("--cell 0.00", "--cell 0.0"));
        }
    }
}
