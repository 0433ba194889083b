//! A scene's text with settings and files written into it; everything else in it, comments too, stays as it is.

use toml::de::DeValue;
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::declaration::Key;
use super::overrides::Override;

/// The text of a scene file, to be changed.
pub struct EditedText {
    document: DocumentMut,
    /// Whether its lines end as on Windows; `document` does not keep that.
    has_carriage_returns: bool,
}

impl EditedText {
    /// Parses TOML; `None` if the text is not TOML.
    pub fn parse(text: &str) -> Option<Self> {
        let document = text.parse().ok()?;
        Some(Self { document, has_carriage_returns: text.contains("\r\n") })
    }

    /// The text.
    pub fn text(&self) -> String {
        let text = self.document.to_string();
        if self.has_carriage_returns { text.replace("\r\n", "\n").replace('\n', "\r\n") } else { text }
    }

    /// Replaces the value that a setting overrides, or adds it after the last key of its table; `None` if it cannot be applied.
    pub fn set(&mut self, setting: &Override) -> Option<()> {
        // As when a setting is applied: a value that is not TOML is a text.
        let is_toml = DeValue::parse(&setting.value).is_ok();
        let value = setting.value.parse::<Value>().ok().filter(|_| is_toml);
        set(
            self.document.as_table_mut(),
            &setting.key,
            value.unwrap_or_else(|| setting.value.as_str().into()),
        )
    }

    /// The text that is a key's value, if there is one; `index` is that of its table in an array of tables.
    pub fn text_of(&mut self, key: &Key, index: Option<usize>) -> Option<&str> {
        self.value_mut(key, index)?.as_str()
    }

    /// Replaces the value of a key by a text, if it has a value.
    pub fn replace(&mut self, key: &Key, index: Option<usize>, text: String) {
        if let Some(value) = self.value_mut(key, index) {
            replace(value, text.into());
        }
    }

    fn value_mut(&mut self, key: &Key, index: Option<usize>) -> Option<&mut Value> {
        let mut table: &mut dyn TableLike = self.document.as_table_mut();
        for part in key.table.split('.') {
            let item = table.get_mut(part)?;
            table = match index {
                Some(index) => element_mut(item, index)?,
                None => item.as_table_like_mut()?,
            };
        }
        table.get_mut(key.name)?.as_value_mut()
    }
}

/// Sets a value by the parts of its key; tables that are missing are added.
fn set(table: &mut dyn TableLike, key: &[String], value: Value) -> Option<()> {
    let (name, rest) = key.split_first()?;
    if rest.is_empty() {
        match table.get_mut(name) {
            Some(Item::Value(old)) => replace(old, value),
            Some(other) => {
                // A table becomes a value, whose key has other spaces.
                *other = Item::Value(without_space(value));
                table.key_mut(name)?.fmt();
            }
            None => {
                trim_last(table);
                table.insert(name, Item::Value(without_space(value)));
            }
        }
        return Some(());
    }
    if !table.contains_key(name) {
        trim_last(table);
        table.insert(name, Item::Table(Table::new()));
    }
    let item = table.get_mut(name)?;
    if let Some(table) = item.as_table_like_mut() {
        return set(table, rest, value);
    }
    let (number, rest) = rest.split_first()?;
    set(element_mut(item, number.parse::<usize>().ok()?.checked_sub(1)?)?, rest, value)
}

/// An element of an array of tables, counted from 0.
fn element_mut(item: &mut Item, index: usize) -> Option<&mut dyn TableLike> {
    match item {
        Item::ArrayOfTables(tables) => Some(tables.get_mut(index)?),
        Item::Value(Value::Array(items)) => Some(items.get_mut(index)?.as_inline_table_mut()?),
        _ => None,
    }
}

/// Replaces a value, and keeps the comment behind it.
fn replace(old: &mut Value, value: Value) {
    let decor = old.decor().clone();
    *old = value;
    *old.decor_mut() = decor;
}

/// Removes the spaces behind the last value of a table, which in an inline table stand before its brace.
fn trim_last(table: &mut dyn TableLike) {
    let Some((_, Item::Value(last))) = table.iter_mut().last() else { return };
    let suffix = last.decor().suffix().and_then(|suffix| suffix.as_str());
    if suffix.is_some_and(|suffix| suffix.trim().is_empty()) {
        last.decor_mut().set_suffix("");
    }
}

/// A value with the spaces that TOML usually has.
fn without_space(mut value: Value) -> Value {
    value.decor_mut().clear();
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A text with settings.
    fn edited(text: &str, settings: &[&str]) -> String {
        let mut edited = EditedText::parse(text).unwrap();
        settings.iter().for_each(|setting| edited.set(&setting.parse().unwrap()).unwrap());
        edited.text()
    }

    #[test]
    fn comments_and_order_stay() {
        let text = "# A shot.\n\n[shot]\n# Few.\nframes = \"1-2\" # first, last\n\n# Behind.\n[[object]]\nfile = 'a.obj'\n# End.\n";
        assert_eq!(edited(text, &[]), text);
        let settings = ["shot.frames=3-4", "shot.fps = 25", "object.1.file=b.obj", "object.1.scale=0.1"];
        let wanted = "# A shot.\n\n[shot]\n# Few.\nframes = \"3-4\" # first, last\nfps = 25\n\n# Behind.\n[[object]]\n\
                      file = \"b.obj\"\nscale = 0.1\n# End.\n";
        assert_eq!(edited(text, &settings), wanted);
        let of_windows = |text: &str| text.replace('\n', "\r\n");
        assert_eq!(edited(&of_windows(text), &settings), of_windows(wanted));
    }

    #[test]
    fn settings_go_into_tables_of_every_form() {
        let inline = "snow = { cell = 0.1, noise = { seed = 1 } }\nobject = [{ file = \"a.obj\" }]\n";
        assert_eq!(
            edited(
                inline,
                &["snow.noise.seed=2", "snow.noise.size=3", "object.1.file=b.obj", "snow.a.b=[1, 2]"]
            ),
            "snow = { cell = 0.1, noise = { seed = 2, size = 3 }, a = { b = [1, 2] } }\nobject = [{ file = \"b.obj\" }]\n"
        );
        assert_eq!(
            edited("[snow]\nnoise.seed = 1\n", &["snow.noise.size=2"]),
            "[snow]\nnoise.seed = 1\nnoise.size = 2\n"
        );
        assert_eq!(edited("[snow]\n", &["snow.noise.seed=2"]), "[snow]\n\n[snow.noise]\nseed = 2\n");
        assert_eq!(
            edited("[snow.noise]\nseed = 2\n", &["snow.noise={ size = 2 }"]),
            "[snow]\nnoise = { size = 2 }\n"
        );
        let mut none = EditedText::parse("[[object]]\n").unwrap();
        for setting in ["object.2.file=a.obj", "object.file=a.obj", "object.0.file=a.obj"] {
            assert_eq!(none.set(&setting.parse().unwrap()), None, "{setting}");
        }
    }
}
