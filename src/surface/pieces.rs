//! Parallel, cancellable map over chunks of a slice.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;

/// Calls `of` with chunks of `size` items, and the index of each chunk's first item; returns the results in the order of the chunks.
///
/// # Errors
/// Cancel.
pub fn in_pieces<T: Sync, R: Clone + Send>(
    ctx: &Context,
    items: &[T],
    size: usize,
    of: impl Fn(usize, &[T]) -> Vec<R> + Sync,
) -> Result<Vec<R>> {
    let one = |(piece, items): (usize, &[T])| {
        ctx.check()?;
        Ok(of(piece * size, items))
    };
    Ok(items.par_chunks(size).enumerate().map(one).collect::<Result<Vec<Vec<R>>>>()?.concat())
}
