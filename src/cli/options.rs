//! Option values that several commands share.

/// A picture size: `1280x720`.
pub fn size(text: &str) -> Result<frazil::render::Size, String> {
    let refused = || format!("\"{text}\" is no size such as 1280x720");
    let (width, height) = text.split_once('x').ok_or_else(refused)?;
    let number = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=16_384).contains(n)).ok_or_else(refused);
    Ok(frazil::render::Size { width: number(width)?, height: number(height)? })
}

/// Three numbers: `0.5,1,-2`.
pub fn triple(text: &str) -> Result<[f64; 3], String> {
    let parts: Vec<Option<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match parts.as_slice() {
        [Some(x), Some(y), Some(z)] if [x, y, z].iter().all(|value| value.is_finite()) => Ok([*x, *y, *z]),
        _ => Err(format!("\"{text}\" is not three numbers such as 0.5,1,-2")),
    }
}

/// Bytes with a unit: `800M`, `12G`.
pub fn bytes(text: &str) -> Result<u64, String> {
    let (number, shift) = match text.trim().to_uppercase() {
        text if text.ends_with('K') => (text[..text.len() - 1].to_string(), 10),
        text if text.ends_with('M') => (text[..text.len() - 1].to_string(), 20),
        text if text.ends_with('G') => (text[..text.len() - 1].to_string(), 30),
        text => (text, 0),
    };
    let value: u64 = number.parse().map_err(|_| format!("\"{text}\" is no size such as 800M or 12G"))?;
    value.checked_shl(shift).filter(|bytes| bytes >> shift == value).ok_or_else(|| format!("{text} is too large"))
}
