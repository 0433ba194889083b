//! Saves the stains of a mesh as bytes and restores them.
//!
//! | part | bytes |
//! |---|---|
//! | magic, with the version | 8 |
//! | hash of the mesh's triangles | 16 |
//! | volume of a unit, time | 8 each |
//! | count of vertices, count of vertices that absorb | 8 each |
//! | stains | 4 each |
//! | times at which vertices were last wet | 8 each |
//! | units absorbed by each, if the ground absorbs | 8 each |
//! | hash of everything above | 16 |

use xxhash_rust::xxh3::xxh3_128;

use super::Stains;
use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;

const MAGIC: [u8; 8] = *b"frzstn\0\x01";
const CHECKSUM: usize = 16;

impl Stains {
    /// Count of the bytes of [`Stains::save`].
    pub fn save_size(&self) -> usize {
        56 + 12 * self.len() + 8 * self.held.len() + CHECKSUM
    }

    /// The stains as bytes, without the parameters of staining.
    pub fn save(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(self.save_size());
        out.extend(MAGIC);
        out.extend(self.mesh);
        out.extend(self.unit.to_le_bytes());
        out.extend(self.time.to_le_bytes());
        out.extend((self.len() as u64).to_le_bytes());
        out.extend((self.held.len() as u64).to_le_bytes());
        out.extend(self.stain.iter().flat_map(|stain| stain.to_le_bytes()));
        out.extend(self.last_wet.iter().flat_map(|since| since.to_le_bytes()));
        out.extend(self.held.iter().flat_map(|held| held.to_le_bytes()));
        let checksum = xxh3_128(&out).to_le_bytes();
        out.extend(checksum);
        out
    }

    /// Restores saved stains: with the liquid's state of the same time, results continue with the same bytes.
    ///
    /// # Errors
    /// `Bytes`, and nothing changes: not stains, truncated or damaged; another terrain: other triangles, another count of vertices, or a
    /// liquid with other cells; ground that absorbs where this does not, or vice versa.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        require(bytes.starts_with(&MAGIC), "are not of this format")?;
        let (body, checksum) = bytes.split_at(bytes.len().saturating_sub(CHECKSUM));
        require(xxh3_128(body).to_le_bytes() == *checksum, "are cut short or damaged")?;
        let mut from = Reader::new(&body[MAGIC.len()..]);
        let (mesh, unit): ([u8; 16], _) = (from.take()?, f64::from_le_bytes(from.take()?));
        let time = f64::from_le_bytes(from.take()?);
        let [count, holding] = [u64::from_le_bytes(from.take()?), u64::from_le_bytes(from.take()?)];
        let own = (self.mesh, self.unit.to_bits(), self.len() as u64);
        require((mesh, unit.to_bits(), count) == own, "are of another terrain")?;
        require(holding == self.held.len() as u64, "are of ground that absorbs in another way")?;
        require(from.rest().len() as u64 == 12 * count + 8 * holding, "are cut short or damaged")?;
        let stain = from.bytes(4 * self.len())?.as_chunks().0.iter().map(|stain| f32::from_le_bytes(*stain));
        let since = from.bytes(8 * self.len())?.as_chunks().0.iter().map(|since| f64::from_le_bytes(*since));
        let held = from.rest().as_chunks().0.iter().map(|held| i64::from_le_bytes(*held));
        let is_good = time.is_finite()
            && stain.clone().all(|stain| (0.0..=1.0).contains(&stain))
            && since.clone().all(|since| since <= time)
            && held.clone().zip(&self.capacity).all(|(held, capacity)| (0..=*capacity).contains(&held));
        require(is_good, "are cut short or damaged")?;
        self.stain.iter_mut().zip(stain).for_each(|(to, stain)| *to = stain);
        self.last_wet.iter_mut().zip(since).for_each(|(to, since)| *to = since);
        self.held.iter_mut().zip(held).for_each(|(to, held)| *to = held);
        self.time = time;
        Ok(())
    }
}

/// Checks that something holds of saved stains; `wrong` says what is wrong otherwise.
fn require(holds: bool, wrong: &str) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Bytes(format!("saved stains {wrong}"))) }
}
