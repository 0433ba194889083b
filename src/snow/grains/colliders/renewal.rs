//! Touches of a sub-step take over the impulses of the last one.

use rayon::prelude::*;

use super::touch::Touch;
use crate::snow::grains::solver::blocks::Block;
use crate::snow::grains::solver::rows::dot;

/// Replaces the touches of blocks with those found in this sub-step: all touches of blocks that are due, and those with
/// meshes in every block. New touches take over the impulses of the old ones.
pub fn renew(blocks: &mut [Block], mut fresh: Vec<Vec<Touch>>) {
    let is_renewed = |block: &Block, fresh: &[Touch]| {
        block.is_due || !fresh.is_empty() || block.touches.iter().any(Touch::is_of_mesh)
    };
    let renewed = blocks.par_iter_mut().zip(&mut fresh).filter(|(block, fresh)| is_renewed(block, fresh));
    // Touches that a block lost: their grains may have moved to another block.
    let mut gone: Vec<Touch> = renewed
        .flat_map_iter(|(block, fresh)| {
            fresh.sort_unstable_by_key(Touch::key);
            let (mut gone, mut next) = (Vec::new(), 0);
            block.touches.retain(|old| {
                let is_kept = !block.is_due && !old.is_of_mesh();
                if !is_kept {
                    while fresh.get(next).is_some_and(|touch| touch.key() < old.key()) {
                        next += 1;
                    }
                    match fresh.get_mut(next).filter(|touch| touch.key() == old.key()) {
                        Some(touch) => touch.take_over(old),
                        None => gone.push(*old),
                    }
                }
                is_kept
            });
            gone
        })
        .collect();
    gone.par_sort_unstable_by_key(Touch::key);
    blocks.par_iter_mut().zip(fresh).filter(|(_, fresh)| !fresh.is_empty()).for_each(|(block, mut fresh)| {
        for touch in &mut fresh {
            if let Ok(at) = gone.binary_search_by_key(&touch.key(), Touch::key) {
                touch.take_over(&gone[at]);
            }
        }
        if block.touches.is_empty() {
            block.touches = fresh;
        } else {
            block.touches.extend(fresh);
            block.touches.sort_unstable_by_key(Touch::key);
        }
        release_pressed(&mut block.touches);
    });
}

/// Clears the impulses of grains that are pressed from opposite sides: they would grow as long as both sides press, and throw
/// the grain when one of them leaves. The touches must be sorted.
fn release_pressed(touches: &mut [Touch]) {
    for touches in touches.chunk_by_mut(|a, b| a.grain == b.grain) {
        let is_pressed = touches.iter().enumerate().any(|(index, touch)| {
            touches[..index].iter().any(|other| dot(touch.normal, other.normal) < OPPOSITE)
        });
        if is_pressed {
            touches.iter_mut().for_each(|touch| (touch.impulse, touch.tangential) = (0.0, [0.0; 3]));
        }
    }
}

/// Two normals with a cosine below this press a grain from opposite sides.
const OPPOSITE: f32 = -0.5;
