//! A script that submits a shot to Slurm: a job for each task, and an array for its chunks.

use super::Task;
use crate::cli::shell::quoted;

/// Runs after the command of a job. Slurm requeues a job by itself only if its node fails. A job that has failed cancels the jobs that depend
/// on it, and requeueing it afterwards does not bring them back, so a job requeues itself while it is still running. One that is killed again
/// and again probably needs more memory than it has.
const END: &str = r#"code=$?
  if [ $code -eq 75 ] || { [ $code -eq 137 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; }; then scontrol requeue "$SLURM_JOB_ID"; fi
  exit $code"#;

/// The script. A job that is killed, loses its node or finds the folder in use is requeued, and resumes.
pub(super) fn script(name: &str, tasks: &[Task]) -> String {
    let mut out = format!(
        "#!/bin/sh\n# Submits the shot {} to Slurm: sh FILE [OPTIONS]. The options are passed to sbatch for every job: --partition=NAME.\n\
         # A job gets one CPU unless they say more: --cpus-per-task=N or --exclusive.\n\
         set -eu\n# If the folder is in use (75), a job is requeued; if it is killed (137), up to three times.\nend='{END}'\n",
        name.replace(['\n', '\r'], " ")
    );
    for task in tasks {
        let after: Vec<String> = task.after.iter().map(|name| format!("${{{}}}", variable(name))).collect();
        let after = match after.is_empty() {
            true => String::new(),
            false => format!(" --dependency=afterok:{}", after.join(":")),
        };
        let words: Vec<String> = task.command.iter().map(|word| quoted(word)).collect();
        let (array, command) = match task.chunks.is_empty() {
            true => (String::new(), words.join(" ")),
            false => {
                let chunks: Vec<String> =
                    task.chunks.iter().map(|[first, last]| format!("{first}-{last}")).collect();
                let command = format!(
                    "set -- {}; shift \"$SLURM_ARRAY_TASK_ID\"; {} \"$1\"",
                    chunks.join(" "),
                    words.join(" ")
                );
                (format!(" --array=0-{}", task.chunks.len() - 1), command)
            }
        };
        out += &format!(
            "{}=$(sbatch --parsable --requeue --kill-on-invalid-dep=yes --job-name={}{after}{array} \"$@\" --wrap={}\"; $end\")\n",
            variable(&task.name),
            quoted(&format!("{name}-{}", task.name)),
            quoted(&command)
        );
    }
    let last = tasks.last().map_or(String::new(), |task| variable(&task.name));
    out + &format!("echo \"${last}\"\n")
}

/// The shell's variable with the number of a job.
fn variable(task: &str) -> String {
    format!("job_{}", task.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_"))
}
