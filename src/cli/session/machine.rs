//! The machine's memory and disks.

use std::str::FromStr;

use frazil::context::machine_memory;

/// An amount of memory: bytes, or a share of the machine's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// A count of bytes.
    Bytes(u64),
    /// A share of the machine's memory, 0..=1.
    Share(f64),
}

impl Amount {
    /// In bytes; unlimited if the machine does not report its memory.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Share(share) => machine_memory().map_or(u64::MAX, |bytes| (bytes as f64 * share) as u64),
        }
    }
}

impl FromStr for Amount {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || "write a size such as 8G, 512M or 50%".to_string();
        let split = text.find(|letter: char| letter.is_alphabetic() || letter == '%').unwrap_or(text.len());
        let number: f64 = text[..split].trim().parse().map_err(|_| wrong())?;
        let unit = text[split..].to_uppercase();
        let base = if unit.contains('I') { 1024.0f64 } else { 1000.0 };
        let power = match unit.trim_end_matches('B').trim_end_matches('I') {
            "%" if (0.0..=100.0).contains(&number) => return Ok(Self::Share(number / 100.0)),
            "" => 0,
            "K" => 1,
            "M" => 2,
            "G" => 3,
            "T" => 4,
            _ => return Err(wrong()),
        };
        let bytes = number * base.powi(power);
        if (0.0..1.0e19).contains(&bytes) { Ok(Self::Bytes(bytes as u64)) } else { Err(wrong()) }
    }
}

/// Bytes that this user may still write on a folder's disk.
pub fn free_space(folder: &std::path::Path) -> Option<u64> {
    let file_system = rustix::fs::statvfs(folder).ok()?;
    Some(file_system.f_bavail * file_system.f_frsize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_of_memory_have_units() {
        assert_eq!("8G".parse(), Ok(Amount::Bytes(8_000_000_000)));
        assert_eq!("1.5 MB".parse(), Ok(Amount::Bytes(1_500_000)));
        assert_eq!("1.5 MiB".parse(), Ok(Amount::Bytes(3 << 19)));
        assert_eq!("100".parse(), Ok(Amount::Bytes(100)));
        assert_eq!("50%".parse(), Ok(Amount::Share(0.5)));
        for wrong in ["", "G", "-1G", "150%", "8 parsecs", "nan"] {
            assert!(wrong.parse::<Amount>().is_err(), "{wrong}");
        }
    }
}
