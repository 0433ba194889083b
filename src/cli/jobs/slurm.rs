//! A script that submits a shot to Slurm: a job for each task, and an array for its chunks.

use super::{Task, quoted};
use crate::cli::session::exit::BUSY;

/// The script. A job that is killed or loses its node is queued again, and resumes.
pub(super) fn script(name: &str, tasks: &[Task]) -> String {
    let mut out = format!(
        "#!/bin/sh\n# Submits the shot {} to Slurm: sh FILE. Options for all jobs: SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT ...\nset -eu\n",
        name.replace(['\n', '\r'], " ")
    );
    for task in tasks {
        let after: Vec<String> = task.after.iter().map(|name| format!("${{{}}}", variable(name))).collect();
        let after = match after.is_empty() {
            true => String::new(),
            false => format!(" --dependency=afterok:{}", after.join(":")),
        };
        let command = task.command.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
        let (array, command) = match task.chunks.is_empty() {
            true => (String::new(), retried(&command)),
            false => {
                let chunks: Vec<String> =
                    task.chunks.iter().map(|[first, last]| format!("{first}-{last}")).collect();
                let retried = retried(&format!("{command} \"$1\""));
                let command =
                    format!("set -- {}; shift \"$SLURM_ARRAY_TASK_ID\"; {retried}", chunks.join(" "));
                (format!(" --array=0-{}", task.chunks.len() - 1), command)
            }
        };
        out += &format!(
            "{}=$(sbatch --parsable --requeue --kill-on-invalid-dep=yes --job-name={}{after}{array} --wrap={})\n",
            variable(&task.name),
            quoted(&format!("{name}-{}", task.name)),
            quoted(&command)
        );
    }
    let last = tasks.last().map_or(String::new(), |task| variable(&task.name));
    out + &format!("echo \"${last}\"\n")
}

/// A command that starts again for as long as another run keeps it from its folder.
fn retried(command: &str) -> String {
    format!("until {command}; do code=$?; [ $code -eq {BUSY} ] || exit $code; done")
}

/// The shell's variable with the number of a job.
fn variable(task: &str) -> String {
    format!("job_{}", task.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_"))
}
