//! Buffer views compressed by meshoptimizer (EXT_meshopt_compression).

use meshopt_rs::index::buffer::decode_index_buffer;
use meshopt_rs::index::sequence::decode_index_sequence;
use meshopt_rs::vertex::buffer::decode_vertex_buffer;
use meshopt_rs::vertex::filter;

use super::json::Compressed;

/// Maximum bytes that one byte of compressed data expands to.
const MAX_EXPANSION: usize = 256;

/// The bytes of a view.
///
/// # Errors
/// What is wrong with the data, as part of a sentence about the view.
pub(super) fn decode(view: &Compressed, data: &[u8]) -> Result<Vec<u8>, String> {
    let size = view.stride.checked_mul(view.count).filter(|size| *size / MAX_EXPANSION <= data.len());
    let size = size.ok_or("is shorter than its count requires")?;
    let mut bytes = match view.mode.as_str() {
        "ATTRIBUTES" => vertices(view, data)?,
        "TRIANGLES" if !view.count.is_multiple_of(3) => {
            return Err("has indices that do not form triangles".into());
        }
        "TRIANGLES" => {
            let mut indices = vec![0u32; view.count];
            decode_index_buffer(&mut indices, data).map_err(damaged)?;
            narrowed(&indices, view.stride)?
        }
        "INDICES" => {
            let mut indices = vec![0u32; view.count];
            decode_index_sequence(&mut indices, data).map_err(damaged)?;
            narrowed(&indices, view.stride)?
        }
        mode => return Err(format!("has the unknown mode {mode}")),
    };
    debug_assert_eq!(bytes.len(), size);
    unfilter(view, &mut bytes)?;
    Ok(bytes)
}

fn damaged(error: impl std::fmt::Debug) -> String {
    format!("is damaged ({error:?})")
}

/// The decoder infers the size of a vertex from a type.
fn vertices(view: &Compressed, data: &[u8]) -> Result<Vec<u8>, String> {
    fn of_size<const N: usize>(count: usize, data: &[u8]) -> Result<Vec<u8>, String> {
        let mut out = vec![[0u8; N]; count];
        decode_vertex_buffer(&mut out, data).map_err(damaged)?;
        Ok(out.into_flattened())
    }
    macro_rules! by_size {
        ($($size:literal)*) => {
            match view.stride {
                $($size => of_size::<$size>(view.count, data),)*
                stride => Err(format!("has elements of {stride} bytes, not a multiple of 4 up to 256")),
            }
        };
    }
    by_size!(4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116 120 124 128
        132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204 208 212 216 220 224 228 232 236
        240 244 248 252 256)
}

/// Indices as integers of 16 or 32 bits.
fn narrowed(indices: &[u32], stride: usize) -> Result<Vec<u8>, String> {
    match stride {
        2 => Ok(indices.iter().flat_map(|index| (*index as u16).to_le_bytes()).collect()),
        4 => Ok(indices.iter().flat_map(|index| index.to_le_bytes()).collect()),
        _ => Err(format!("has indices of {stride} bytes")),
    }
}

/// Undoes a filter that made the numbers easier to compress.
fn unfilter(view: &Compressed, bytes: &mut [u8]) -> Result<(), String> {
    match (view.filter.as_str(), view.stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            let mut rows: Vec<[u8; 4]> =
                bytes.chunks_exact(4).map(|row| [row[0], row[1], row[2], row[3]]).collect();
            filter::decode_filter_oct_8(&mut rows);
            bytes.copy_from_slice(rows.as_flattened());
        }
        ("OCTAHEDRAL" | "QUATERNION", 8) => {
            let half = |row: &[u8], at: usize| u16::from_le_bytes([row[2 * at], row[2 * at + 1]]);
            let row = |row: &[u8]| -> [u16; 4] { std::array::from_fn(|at| half(row, at)) };
            let mut rows: Vec<[u16; 4]> = bytes.chunks_exact(8).map(row).collect();
            match view.filter.as_str() {
                "OCTAHEDRAL" => filter::decode_filter_oct_16(&mut rows),
                _ => filter::decode_filter_quat(&mut rows),
            }
            for (out, value) in bytes.chunks_exact_mut(2).zip(rows.as_flattened()) {
                out.copy_from_slice(&value.to_le_bytes());
            }
        }
        ("EXPONENTIAL", stride) if stride % 4 == 0 => {
            let word = |row: &[u8]| u32::from_le_bytes([row[0], row[1], row[2], row[3]]);
            let mut words: Vec<u32> = bytes.chunks_exact(4).map(word).collect();
            filter::decode_filter_exp(&mut words);
            for (out, value) in bytes.chunks_exact_mut(4).zip(&words) {
                out.copy_from_slice(&value.to_le_bytes());
            }
        }
        (name, stride) => return Err(format!("has the filter {name} on elements of {stride} bytes")),
    }
    Ok(())
}
