//! Names of frame sequences: `body.%04d.obj`, `body.####.obj`, `body.$F4.obj`.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Maximum number of digits of a frame number.
const MAX_DIGITS: usize = 32;

/// A file name with a placeholder for the frame number, in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// Finds the placeholder of the frame number in a file's name; none if the name is that of a single file, such as any existing file.
    /// Folder names are not considered.
    pub fn parse(path: &Path) -> Option<Self> {
        let text = path.file_name()?.to_str()?;
        let part = |start: usize, end: usize, digits: usize| {
            // The file system is checked last: most names have no placeholder.
            (digits <= MAX_DIGITS && !path.is_file()).then(|| Self {
                folder: path.parent().unwrap_or(Path::new("")).to_path_buf(),
                before: text[..start].into(),
                digits,
                after: text[end..].into(),
            })
        };
        let digits_at = |start: usize| text[start..].bytes().take_while(u8::is_ascii_digit).count();
        let width = |digits: &str| if digits.is_empty() { Some(1) } else { digits.parse().ok() };
        // A % that no d follows, directly or after digits, is a part of the name.
        for (start, _) in text.rmatch_indices('%') {
            let end = start + 1 + digits_at(start + 1);
            if text[end..].starts_with('d') {
                return part(start, end + 1, width(&text[start + 1..end])?);
            }
        }
        if let Some(start) = text.rfind("$F") {
            let end = start + 2 + digits_at(start + 2);
            return part(start, end, width(&text[start + 2..end])?);
        }
        let end = text.rfind('#')? + 1;
        let start = text[..end].trim_end_matches('#').len();
        part(start, end, end - start)
    }

    /// The file of a frame.
    pub fn path(&self, frame: i32) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let number = frame.unsigned_abs();
        let name = format!("{}{sign}{number:0width$}{}", self.before, self.after, width = self.digits);
        self.folder.join(name)
    }

    /// The frames whose files exist, ascending.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn frames(&self) -> Result<Vec<i32>> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let entries = std::fs::read_dir(folder).map_err(|error| Error::io(folder, "read", error))?;
        let mut out = Vec::new();
        for entry in entries {
            let name = entry.map_err(|error| Error::io(folder, "read", error))?.file_name();
            let number =
                name.to_str().and_then(|name| name.strip_prefix(&*self.before)?.strip_suffix(&*self.after));
            let frame = number.and_then(|number| number.parse::<i32>().ok());
            // "+1", or "001" where four digits are expected, is not a frame number.
            out.extend(frame.filter(|frame| self.path(*frame).file_name() == Some(&*name)));
        }
        out.sort_unstable();
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_spellings_name_the_same_file() {
        for name in ["a/b.%04d.obj", "a/b.####.obj", "a/b.$F4.obj"] {
            assert_eq!(Pattern::parse(name.as_ref()).unwrap().path(12), PathBuf::from("a/b.0012.obj"));
        }
        assert_eq!(Pattern::parse("b.%d.obj".as_ref()).unwrap().path(-3), PathBuf::from("b.-3.obj"));
        for (name, file) in
            [("100%.##.obj", "100%.07.obj"), ("50%_x.$F.obj", "50%_x.7.obj"), ("5%d 9%.obj", "57 9%.obj")]
        {
            assert_eq!(Pattern::parse(name.as_ref()).unwrap().path(7), PathBuf::from(file));
        }
        assert!(Pattern::parse("boot.obj".as_ref()).is_none());
    }

    #[test]
    fn names_of_folders_are_no_patterns() {
        for name in ["proj#3/boot.obj", "50%d x/boot.obj", "%04d/boot.obj", "$F4/boot.obj", "##/b.obj", ".."]
        {
            assert_eq!(Pattern::parse(name.as_ref()), None, "{name}");
        }
        let pattern = Pattern::parse("/proj#3/%d/b.##.obj".as_ref()).unwrap();
        assert_eq!(pattern.path(7), PathBuf::from("/proj#3/%d/b.07.obj"));
    }

    #[test]
    fn a_file_that_is_there_is_no_pattern() {
        let folder = std::env::temp_dir().join(format!("frazil-pattern-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("take#3.obj");
        assert!(Pattern::parse(&path).is_some());
        std::fs::write(&path, "").unwrap();
        assert!(Pattern::parse(&path).is_none());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn numbers_of_more_digits_than_any_frame_has_are_no_patterns() {
        let long = "#".repeat(70_000);
        for name in ["%99999d", "%65536d", "%4294967296d", "$F99999", "$F99999999999999999999", &long] {
            assert_eq!(Pattern::parse(format!("b.{name}.obj").as_ref()), None);
        }
        assert!(Pattern::parse("b.%032d.obj".as_ref()).is_some());
    }
}
