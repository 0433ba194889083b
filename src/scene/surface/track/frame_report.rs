//! The report of a frame of a mesh that follows a liquid.

use serde_json::json;

use crate::scene::run::Report;
use crate::surface::{Change, StepReport, Tracker, UncoveredPart};

/// Maximum uncovered parts listed in a report.
const LISTED: usize = 100;

/// The report of a frame with this many particles; `is_resculpted`: whether an edited mesh replaced the tracked one.
pub(in crate::scene::surface) fn report_of(
    report: &StepReport,
    particles: usize,
    tracker: &Tracker,
    is_resculpted: bool,
) -> Report {
    let (drops, bubbles): (Vec<&UncoveredPart>, Vec<&UncoveredPart>) =
        report.uncovered_parts.iter().partition(|part| part.volume >= 0.0);
    let listed: Vec<serde_json::Value> = report
        .uncovered_parts
        .iter()
        .take(LISTED)
        .map(|part| json!({ "at_m": <[f64; 3]>::from(part.position), "volume_m3": part.volume }))
        .collect();
    let changed = |number: fn(&Change) -> usize| report.change.as_ref().map_or(0, number);
    let results = json!({
        "particles": particles,
        "born": report.born,
        "died": report.died,
        "resculpted": is_resculpted,
        "vertices": tracker.vertices().len(),
        "flagged": report.flagged(),
        "jumped": report.jumped,
        "lost": report.lost,
        "uncovered": report.uncovered,
        "changed_cells": changed(|change| change.flagged_cells),
        "rebuilt_cells": changed(|change| change.rebuilt_cells),
        "rebuilt_rung": changed(|change| change.rebuild_level),
        "matching_iterations": changed(|change| change.iterations),
        "made_triangles": changed(|change| change.made_triangles()),
        "dry_parts": changed(|change| change.dry),
        "specks": changed(|change| change.specks),
        "drops": drops.len(),
        "drops_m3": drops.iter().fold(0.0, |sum, drop| sum + drop.volume),
        "bubbles": bubbles.len(),
        "bubbles_m3": bubbles.iter().fold(0.0, |sum, bubble| sum - bubble.volume),
        "apart": listed,
        "parts": report.parts,
        "volume_m3": tracker.mesh().volume(),
        "particles_triangles": report.triangles,
    });
    let mut out = Report::new(results, report.phases.clone());
    let warnings: Vec<&String> = report.warnings().collect();
    if !warnings.is_empty() {
        out.results.insert("warnings".into(), json!(warnings));
    }
    out
}
