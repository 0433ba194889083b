//! USD syntax: lists, names.

pub(in crate::io) fn list<T>(
    items: impl ExactSizeIterator<Item = T>,
    write: impl Fn(&mut String, T),
) -> String {
    let mut out = String::with_capacity(items.len() * 32);
    out.push('[');
    for (index, item) in items.enumerate() {
        if index > 0 {
            out.push_str(", ");
        }
        write(&mut out, item);
    }
    out.push(']');
    out
}

/// A name that USD allows, made from any text: letters, digits, underscores.
pub fn prim_name(text: &str) -> String {
    let mut name: String =
        text.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
    if !name.starts_with(|letter: char| letter.is_ascii_alphabetic() || letter == '_') {
        name.insert(0, '_');
    }
    name
}
