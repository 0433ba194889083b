//! Work on many items in parallel, which a cancel ends.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;

/// What `of` makes of pieces of `size` items, given the index of their first, in their order.
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
