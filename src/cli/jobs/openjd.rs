//! A job template of Open Job Description (jobtemplate-2023-09): a step for each task, and a task of the step for each chunk.

use serde_json::{Value, json};

use super::Task;

/// Values that a parameter of a task may have, by the specification.
const MAX_VALUES: usize = 1024;

/// The template, in JSON, which is also YAML.
///
/// # Errors
/// A word that would be taken for an expression; too many chunks.
pub(super) fn template(name: &str, tasks: &[Task]) -> Result<String, String> {
    let steps: Vec<Value> = tasks.iter().map(step).collect::<Result<_, _>>()?;
    // A name has up to 64 characters that can be printed.
    let name: String = name.chars().filter(|letter| !letter.is_control()).take(64).collect();
    let name = if name.is_empty() { "shot".to_string() } else { name };
    let name = name.replace("{{", "{ {");
    let template = json!({ "specificationVersion": "jobtemplate-2023-09", "name": name, "steps": steps });
    Ok(format!("{template:#}\n"))
}

fn step(task: &Task) -> Result<Value, String> {
    if let Some(word) = task.command.iter().find(|word| word.contains("{{")) {
        return Err(format!("\"{word}\": OpenJD would take what follows {{{{ for an expression"));
    }
    let count = task.chunks.len();
    if count > MAX_VALUES {
        return Err(format!(
            "OpenJD allows {MAX_VALUES} chunks for a stage, not {count}: use a larger --chunk"
        ));
    }
    let (command, mut arguments) = (&task.command[0], task.command[1..].to_vec());
    let mut step = json!({ "name": task.name });
    if !task.after.is_empty() {
        step["dependencies"] = task.after.iter().map(|name| json!({ "dependsOn": name })).collect();
    }
    if !task.chunks.is_empty() {
        let ends = |end: usize| -> Vec<i32> { task.chunks.iter().map(|chunk| chunk[end]).collect() };
        step["parameterSpace"] = json!({
            "taskParameterDefinitions": [
                { "name": "First", "type": "INT", "range": ends(0) },
                { "name": "Last", "type": "INT", "range": ends(1) },
            ],
            "combination": "(First, Last)",
        });
        arguments.push("{{Task.Param.First}}-{{Task.Param.Last}}".into());
    }
    step["script"] = json!({ "actions": { "onRun": { "command": command, "args": arguments } } });
    Ok(step)
}
