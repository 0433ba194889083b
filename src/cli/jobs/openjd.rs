//! A job template of Open Job Description (jobtemplate-2023-09): a step for each task, and a task of the step for each chunk.

use serde_json::{Value, json};

use super::Task;

/// The template, in JSON, which is also YAML.
pub(super) fn template(name: &str, tasks: &[Task]) -> String {
    let steps: Vec<Value> = tasks.iter().map(step).collect();
    // A name has up to 64 characters that can be printed.
    let name: String = name.chars().filter(|letter| !letter.is_control()).take(64).collect();
    let name = if name.is_empty() { "shot".to_string() } else { name };
    let template =
        json!({ "specificationVersion": "jobtemplate-2023-09", "name": escaped(&name), "steps": steps });
    format!("{template:#}\n")
}

fn step(task: &Task) -> Value {
    let mut arguments: Vec<String> = task.command[1..].iter().map(|word| escaped(word)).collect();
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
    step["script"] =
        json!({ "actions": { "onRun": { "command": escaped(&task.command[0]), "args": arguments } } });
    step
}

/// A text in which nothing is taken for an expression.
fn escaped(text: &str) -> String {
    text.replace("{{", "{ {")
}
