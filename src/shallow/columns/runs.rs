//! Runs of marked strips.

use std::ops::Range;

use super::STRIP;

/// Runs of marked strips.
pub fn runs(marks: &[bool]) -> impl Iterator<Item = Range<usize>> + Clone + '_ {
    let mut end = 0;
    std::iter::from_fn(move || {
        let first = find(marks, end, true);
        end = find(marks, first, false);
        (first < end).then_some(first..end)
    })
}

/// Replaces numbers of all columns: by those that `find` writes in each run of marked strips, by 0 elsewhere.
pub fn fill_runs<T: Copy + Default>(
    marks: &[bool],
    out: &mut [T],
    mut find: impl FnMut(Range<usize>, &mut [T]),
) {
    let mut end = 0;
    for run in runs(marks) {
        out[end * STRIP..run.start * STRIP].fill(T::default());
        end = run.end;
        find(run.clone(), &mut out[run.start * STRIP..run.end * STRIP]);
    }
    out[end * STRIP..].fill(T::default());
}

/// The first strip, from `from` on, whose mark equals `wanted`; the count of strips if there is none.
pub fn find(marks: &[bool], from: usize, wanted: bool) -> usize {
    let rest = &marks[from..];
    // Skips many at once where none matches.
    let has_none = |chunk: &&[bool]| chunk.iter().fold(true, |none, mark| none & (*mark != wanted));
    let skipped = rest.chunks(64).take_while(has_none).map(<[bool]>::len).sum::<usize>();
    from + skipped + rest[skipped..].iter().take_while(|mark| **mark != wanted).count()
}
