//! Files of grains: complete, or only the changes of a frame (`grains_mode = "delta"`).
//!
//! Points are sorted by identity before they are written, so that a file rebuilt from changes equals the one that `"full"`
//! writes. A file of changes contains the grains that are new, changed or trapped, and lists the identities that are gone.
//! Attributes set at birth are 0 there unless the grain is new. A grain that is not in the file is not trapped.

use std::ops::RangeInclusive;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::points::{Column, Points, Values};
use crate::io::files::hash::Hasher;
use crate::scene::Scene;
use crate::scene::run::FrameFiles;
use crate::scene::vdb_metadata::metadata;
use crate::vdb::changes::{CHANGES_SINCE_KEY, since};
use crate::vdb::file::WriteOptions;
use crate::vdb::{MetaValue, points};

/// Interval (frames) of complete files.
pub(in crate::scene::snow) const WHOLE_EVERY: i32 = 24;
/// Metadata of a file of changes: the identities that are gone since then.
pub(super) const GONE: &str = "frazil:gone";
/// Metadata of a file of changes: [`hash_of`] the previous frame's grains.
pub(super) const BEFORE_HASH: &str = "frazil:changes_of";
/// Identities are less than this.
const ID_END: i64 = 1 << 32;

/// Points sorted by identity.
pub(in crate::scene::snow) fn ordered(mut points: Points) -> Points {
    let ids = ids(&points);
    if !ids.is_sorted() {
        let mut order: Vec<u32> = (0..ids.len() as u32).collect();
        order.sort_unstable_by_key(|point| ids[*point as usize]);
        points.reorder(&order);
    }
    let none_trapped =
        |values: &Values| matches!(values, Values::Bool(column) if !column.stored().contains(&true));
    if points.attribute(TRAPPED).is_some_and(none_trapped) {
        points.set(TRAPPED, NONE_TRAPPED);
    }
    points
}

/// Points whose attributes are each uniform either in every frame or in none, as the clips of a USD stage require.
pub(in crate::scene::snow) fn for_clips(mut points: Points) -> Points {
    if points.attribute(TRAPPED) == Some(&NONE_TRAPPED) {
        points.set(TRAPPED, Values::Bool(Column::Each(vec![false; points.count()])));
    }
    points
}

/// The attribute of trapped grains, and its value if there are none.
const TRAPPED: &str = "trapped";
const NONE_TRAPPED: Values = Values::Bool(Column::Uniform(false));

fn ids(points: &Points) -> Vec<i64> {
    ids_of(points.count(), points.attribute("id"))
}

/// The identities of `count` grains from the values of their attribute `id`; none if it has others.
pub(super) fn ids_of(count: usize, values: Option<&Values>) -> Vec<i64> {
    match values {
        Some(Values::Long(column)) => (0..count).map(|grain| column.get(grain)).collect(),
        _ => Vec::new(),
    }
}

/// Writes the .vdb file of a frame: all points, or the changes since `before`; both in the order of [`ordered`].
pub(in crate::scene::snow) fn write(
    ctx: &Context,
    scene: &Scene,
    files: &mut FrameFiles,
    points: &Points,
    before: Option<&Points>,
) -> Result<()> {
    let mut metadata = metadata(scene, files.frame, files.made_from);
    let bytes = |points: &Points, metadata| {
        points::to_bytes(ctx, NAME, points, &WriteOptions { metadata, ..WriteOptions::default() })
    };
    let bytes = match before {
        None => bytes(points, metadata)?,
        Some(before) => {
            let (changed, gone) = changes(before, points);
            metadata.push((CHANGES_SINCE_KEY.into(), MetaValue::Int(i64::from(files.frame) - 1)));
            metadata.push((BEFORE_HASH.into(), MetaValue::Text(hash_of(before))));
            metadata.push((GONE.into(), MetaValue::Text(runs_to_text(&runs(&gone)))));
            bytes(&changed, metadata)?
        }
    };
    files.save(NAME, "vdb", &bytes)
}

/// Name of the grid, of the folder and of the files in it.
pub(super) const NAME: &str = "grains";

/// A hash of the identities and positions of grains in the order of [`ordered`].
pub(super) fn hash_of(points: &Points) -> String {
    let mut hash = Hasher::default();
    for id in ids(points) {
        hash.add(&id.to_le_bytes());
    }
    for (cell, offset) in points.cells.iter().zip(&points.offsets) {
        cell.iter().for_each(|at| _ = hash.add(&at.to_le_bytes()));
        offset.iter().for_each(|at| _ = hash.add(&at.to_bits().to_le_bytes()));
    }
    hash.finish()
}

/// The points to store in a file of changes, and the identities that are gone.
fn changes(before: &Points, after: &Points) -> (Points, Vec<i64>) {
    let (old, new) = (ids(before), ids(after));
    let (mut picked, mut old_indices, mut gone) = (Vec::new(), Vec::new(), Vec::new());
    let mut at = 0;
    for (point, id) in new.iter().enumerate() {
        while at < old.len() && old[at] < *id {
            gone.push(old[at]);
            at += 1;
        }
        let old_index = (at < old.len() && old[at] == *id).then_some(at);
        at += usize::from(old_index.is_some());
        if old_index.is_none_or(|old_index| !is_same(before, old_index, after, point)) {
            picked.push(point as u32);
            old_indices.push(old_index);
        }
    }
    gone.extend(&old[at..]);
    let mut changed = after.clone();
    changed.reorder(&picked);
    set_birth_attributes(&mut changed, None, &old_indices);
    (changed, gone)
}

/// Sets the attributes of birth of the points that have an index in `old_indices`, as they existed in the previous frame: to their values
/// in `before` or, without it, to 0, which compresses well.
fn set_birth_attributes(points: &mut Points, before: Option<&Points>, old_indices: &[Option<usize>]) {
    fn values_at_birth<T: Copy + Default>(
        current: &Column<T>,
        before: Option<&Column<T>>,
        old_indices: &[Option<usize>],
    ) -> Column<T> {
        let old = |old_index: usize| before.map_or(T::default(), |before| before.get(old_index));
        Column::Each(
            old_indices
                .iter()
                .enumerate()
                .map(|(point, old_index)| old_index.map_or_else(|| current.get(point), old))
                .collect(),
        )
    }
    for name in ["source_frame", "rest"] {
        let values = match (points.attribute(name), before.and_then(|before| before.attribute(name))) {
            (Some(Values::Int(current)), Some(Values::Int(before))) => {
                Values::Int(values_at_birth(current, Some(before), old_indices))
            }
            (Some(Values::Int(current)), _) => Values::Int(values_at_birth(current, None, old_indices)),
            (Some(Values::Vector(current)), Some(Values::Vector(before))) => {
                Values::Vector(values_at_birth(current, Some(before), old_indices))
            }
            (Some(Values::Vector(current)), _) => Values::Vector(values_at_birth(current, None, old_indices)),
            _ => continue,
        };
        points.set(name, values);
    }
}

/// Whether a point is bitwise the same as before and not trapped.
fn is_same(before: &Points, old_index: usize, after: &Points, point: usize) -> bool {
    let bits = |vector: [f32; 3]| vector.map(f32::to_bits);
    before.cells[old_index] == after.cells[point]
        && bits(before.offsets[old_index]) == bits(after.offsets[point])
        && after.attributes.iter().all(|attribute| {
            match (before.attribute(&attribute.name), &attribute.values) {
                (_, Values::Bool(now)) if attribute.name == TRAPPED => !now.get(point),
                (Some(Values::Float(then)), Values::Float(now)) => {
                    then.get(old_index).to_bits() == now.get(point).to_bits()
                }
                (Some(Values::Vector(then)), Values::Vector(now)) => {
                    bits(then.get(old_index)) == bits(now.get(point))
                }
                (Some(Values::Int(then)), Values::Int(now)) => then.get(old_index) == now.get(point),
                (Some(Values::Long(then)), Values::Long(now)) => then.get(old_index) == now.get(point),
                (Some(Values::Bool(then)), Values::Bool(now)) => then.get(old_index) == now.get(point),
                _ => false,
            }
        })
}

/// Applies a frame's changes to the points of the frame before.
///
/// # Errors
/// Changes that belong to other points.
pub(super) fn apply_changes(mut points: Points, mut changed: Points, gone: &[Run]) -> Result<Points> {
    let (old, new) = (ids(&points), ids(&changed));
    let old_indices: Vec<Option<usize>> = new.iter().map(|id| old.binary_search(id).ok()).collect();
    set_birth_attributes(&mut changed, Some(&points), &old_indices);
    let mut stays = vec![true; old.len()];
    for run in gone {
        let ends = [run.start(), run.end()].map(|id| old.binary_search(id));
        // Identities are unique, so a run spans this many points only if each of its identities exists.
        match ends {
            [Ok(low), Ok(high)] if (high - low) as i64 == run.end() - run.start() => {
                stays[low..=high].fill(false);
            }
            _ => {
                let run = runs_to_text(std::slice::from_ref(run));
                return Err(Error::argument(format!("names grains as gone ({run}) that did not exist")));
            }
        }
    }
    for old_index in old_indices.iter().flatten() {
        if !std::mem::take(&mut stays[*old_index]) {
            return Err(Error::argument(format!("names grain {} as gone, but holds it", old[*old_index])));
        }
    }
    let kept: Vec<u32> = (0..old.len() as u32).filter(|point| stays[*point as usize]).collect();
    points.reorder(&kept);
    if points.count() > 0 {
        points.set(TRAPPED, NONE_TRAPPED);
    }
    points.append(changed).map_err(|_| Error::argument("holds grains with other attributes or voxels"))?;
    Ok(ordered(points))
}

/// Consecutive identities.
pub(super) type Run = RangeInclusive<i64>;

/// What a file of changes says of the previous frame's grains: the identities that are gone, and the [`hash_of`] all grains if present.
/// `None` if the file is complete.
pub(super) fn previous_record(
    frame: i32,
    metadata: &[(String, MetaValue)],
) -> Result<Option<(Vec<Run>, Option<String>)>> {
    match since(metadata) {
        None => return Ok(None),
        Some(since) if since == frame - 1 => {}
        Some(since) => return Err(Error::argument(format!("holds what changed since frame {since}"))),
    }
    let text = |wanted: &str| {
        metadata.iter().find_map(|(key, value)| match value {
            MetaValue::Text(text) if key == wanted => Some(text),
            _ => None,
        })
    };
    let runs = text(GONE).and_then(|text| runs_from_text(text));
    runs.map(|runs| Some((runs, text(BEFORE_HASH).cloned())))
        .ok_or_else(|| Error::argument(format!("has no list of the grains that are gone ({GONE})")))
}

/// Ascending numbers as runs.
fn runs(numbers: &[i64]) -> Vec<Run> {
    numbers.chunk_by(|a, b| *b == a + 1).map(|run| run[0]..=run[run.len() - 1]).collect()
}

/// Runs as a string: `3-7,12`.
fn runs_to_text(runs: &[Run]) -> String {
    let run = |run: &Run| match (run.start(), run.end()) {
        (low, high) if low == high => low.to_string(),
        (low, high) => format!("{low}-{high}"),
    };
    runs.iter().map(run).collect::<Vec<_>>().join(",")
}

/// Reverses [`runs_to_text`]. Runs are not expanded: a short string may stand for four billion numbers.
fn runs_from_text(text: &str) -> Option<Vec<Run>> {
    let mut out: Vec<Run> = Vec::new();
    for run in text.split(',').filter(|run| !run.is_empty()) {
        let (low, high) = run.split_once('-').unwrap_or((run, run));
        let (low, high) = (low.parse::<i64>().ok()?, high.parse::<i64>().ok()?);
        if !(0..ID_END).contains(&low)
            || !(low..ID_END).contains(&high)
            || out.last().is_some_and(|last| low <= *last.end())
        {
            return None;
        }
        out.push(low..=high);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;

    /// Points with these identities, heights and trapped flags.
    fn points(all: &[(i64, f32, bool)]) -> Points {
        let positions: Vec<DVec3> = all.iter().map(|(_, y, _)| DVec3::new(0.0, f64::from(*y), 0.0)).collect();
        let mut out = Points::at(0.5, &positions).unwrap();
        // A file may contain -0.0, which is a different value of a position.
        for (offset, (_, y, _)) in out.offsets.iter_mut().zip(all).filter(|(_, (_, y, _))| *y == 0.0) {
            offset[1] = *y;
        }
        out.set("id", Values::Long(Column::Each(all.iter().map(|(id, _, _)| *id).collect())));
        out.set(TRAPPED, Values::Bool(Column::Each(all.iter().map(|(_, _, trapped)| *trapped).collect())));
        out.set("pscale", Values::Float(Column::Uniform(0.25)));
        out.set(
            "rest",
            Values::Vector(Column::Each(all.iter().map(|(id, _, _)| [*id as f32, 0.5, 1.0]).collect())),
        );
        out.set(
            "source_frame",
            Values::Int(Column::Each(all.iter().map(|(id, _, _)| *id as i32 + 7).collect())),
        );
        ordered(out)
    }

    #[test]
    fn changes_lead_from_one_frame_to_the_next() {
        let frames = [
            points(&[]),
            points(&[(3, 0.3, false), (0, 0.0, true), (1, -0.0, false)]),
            // One moved, one was born, one is no longer trapped, one became trapped.
            points(&[(4, 1.0, false), (3, 0.5, false), (0, 0.0, false), (1, -0.0, true)]),
            points(&[(4, 1.0, false), (1, -0.0, false)]),
            points(&[(4, 1.0, false), (1, 0.0, false)]),
            points(&[]),
            points(&[(9, 0.0, false)]),
        ];
        let sizes = frames.windows(2).map(|pair| {
            let (changed, gone) = changes(&pair[0], &pair[1]);
            let sizes = (changed.count(), gone.clone());
            // Grains that existed before have no attributes of birth.
            if let Some(Values::Int(frames)) = changed.attribute("source_frame") {
                let old = ids(&pair[0]);
                for (point, id) in ids(&changed).into_iter().enumerate() {
                    assert_eq!(frames.get(point), if old.contains(&id) { 0 } else { id as i32 + 7 });
                }
            }
            let after = apply_changes(
                pair[0].clone(),
                changed,
                &runs_from_text(&runs_to_text(&runs(&gone))).unwrap(),
            )
            .unwrap();
            assert_eq!(after.cells, pair[1].cells);
            assert_eq!(after.offsets, pair[1].offsets);
            assert!(after.count() == 0 || after.attributes == pair[1].attributes, "{after:?}");
            sizes
        });
        let sizes: Vec<_> = sizes.collect();
        let none = Vec::new;
        assert_eq!(
            sizes,
            [(3, none()), (3, none()), (0, vec![0, 3]), (1, none()), (0, vec![1, 4]), (1, none())]
        );
        let before_grains = || points(&[(1, 0.0, false), (2, 0.0, false), (4, 0.0, false)]);
        for (held, gone) in
            [(&[][..], 3..=3), (&[], 2..=4), (&[], 1..=ID_END - 1), (&[(2, 1.0, false)], 1..=2)]
        {
            assert!(apply_changes(before_grains(), points(held), &[gone]).is_err());
        }
    }

    #[test]
    fn identities_are_listed_as_ranges() {
        assert_eq!(runs_to_text(&runs(&[3, 4, 5, 6, 7, 12])), "3-7,12");
        for list in [vec![], vec![0], vec![1, 2], vec![0, 2, 3, 9, 100_000]] {
            assert_eq!(runs_from_text(&runs_to_text(&runs(&list))), Some(runs(&list)));
        }
        for wrong in ["x", "3-1", "-1", "5,4", "5,5", "1-5000000000000", "1-2-3"] {
            assert_eq!(runs_from_text(wrong), None, "{wrong}");
        }
    }
}
