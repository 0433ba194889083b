//! What a mesh file holds that frazil does not keep: told by `convert`, in words.

use std::path::Path;

/// A file is looked through for words no farther than this (bytes): what it declares stands before its numbers, or
/// among the first of them.
const FAR: usize = 64 << 20;

/// What of a file's content other files do not get: "texture coordinates and materials".
pub fn dropped(path: &Path) -> Option<String> {
    let bytes = std::fs::read(path).ok()?;
    let bytes = &bytes[..bytes.len().min(FAR)];
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let found = match extension.as_str() {
        "obj" => of_obj(bytes),
        "ply" => of_ply(bytes),
        "glb" | "gltf" => of_gltf(bytes),
        _ => [false; 4],
    };
    let names = ["texture coordinates", "normals", "colours", "materials"];
    let names: Vec<&str> =
        names.into_iter().zip(found).filter(|(_, found)| *found).map(|(name, _)| name).collect();
    let (last, rest) = names.split_last()?;
    Some(if rest.is_empty() { last.to_string() } else { format!("{} and {last}", rest.join(", ")) })
}

fn of_obj(bytes: &[u8]) -> [bool; 4] {
    let mut found = [false; 4];
    for line in bytes.split(|&byte| byte == b'\n') {
        match line.trim_ascii_start().split(u8::is_ascii_whitespace).next() {
            Some(b"vt") => found[0] = true,
            Some(b"vn") => found[1] = true,
            Some(b"usemtl") => found[3] = true,
            _ => {}
        }
    }
    found
}

fn of_ply(bytes: &[u8]) -> [bool; 4] {
    let header = bytes.split(|&byte| byte == b'\n').take_while(|line| line.trim_ascii() != b"end_header");
    let mut found = [false; 4];
    for name in header
        .filter(|line| line.starts_with(b"property"))
        .filter_map(|line| line.trim_ascii().rsplit(u8::is_ascii_whitespace).next())
    {
        match name {
            b"s" | b"t" | b"u" | b"v" | b"texcoord" => found[0] = true,
            b"nx" => found[1] = true,
            b"red" | b"r" => found[2] = true,
            _ => {}
        }
    }
    found
}

fn of_gltf(bytes: &[u8]) -> [bool; 4] {
    // The JSON of a .glb is its first part, before any numbers.
    let told = |word: &[u8]| bytes.windows(word.len()).any(|window| window == word);
    [told(b"\"TEXCOORD_"), told(b"\"NORMAL\""), told(b"\"COLOR_"), told(b"\"materials\"")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let told = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            dropped(&path)
        };
        assert_eq!(told("a.obj", "v 0 0 0\nf 1 1 1\n# vt\n"), None);
        assert_eq!(told("b.obj", "v 0 0 0\nvt 0 0\n").as_deref(), Some("texture coordinates"));
        let all = told("c.obj", "vt 0 0\nvn 0 0 1\nusemtl skin\n");
        assert_eq!(all.as_deref(), Some("texture coordinates, normals and materials"));
        let ply = "ply\nproperty float x\nproperty uchar red\nend_header\nproperty float nx\n";
        assert_eq!(told("d.ply", ply).as_deref(), Some("colours"));
        assert_eq!(told("e.gltf", "{\"materials\":[]}").as_deref(), Some("materials"));
    }
}
