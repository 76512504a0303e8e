//! A TOML file with some values changed: comments and the order of its lines stay.

use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// A piece of text, and what takes its place.
type Replacement = (Range<usize>, String);

/// The text of a file whose content is to be `table`. Where single values do not lead there (one is left out, say),
/// the table alone is written, without comments.
pub(crate) fn rewritten(text: &str, table: &Table) -> String {
    let says_it = |new: &String| new.parse::<Table>().is_ok_and(|read| read == *table);
    with_values(text, table).filter(says_it).unwrap_or_else(|| table.to_string())
}

fn with_values(text: &str, table: &Table) -> Option<String> {
    let old = DeTable::parse(text).ok()?;
    let mut replacements: Vec<Replacement> = Vec::new();
    compare(text, old.get_ref(), table, &mut replacements);
    replacements.sort_by_key(|(range, _)| range.start);
    let mut new = text.to_owned();
    for (range, value) in replacements.into_iter().rev() {
        new.replace_range(range, &value);
    }
    new += &further_tables(old.get_ref(), table);
    Some(new)
}

/// Tables that lists of tables have behind those of before, `[[name]]` each.
fn further_tables(old: &DeTable<'_>, new: &Table) -> String {
    let further = |(key, value): (&String, &Value)| {
        let before = old.iter().find(|(own, _)| own.get_ref() == key)?.1.get_ref().as_array()?.len();
        let tables = value.as_array()?.iter().skip(before).filter_map(Value::as_table);
        Some(tables.map(|table| format!("\n[[{key}]]\n{table}")).collect::<String>())
    };
    new.iter().filter_map(further).collect()
}

fn compare(text: &str, old: &DeTable<'_>, new: &Table, replacements: &mut Vec<Replacement>) {
    for (key, value) in new {
        match old.iter().find(|(own, _)| own.get_ref() == key) {
            Some((_, own)) => compare_values(text, own, value, replacements),
            None => replacements.extend(added(text, old, key, value)),
        }
    }
}

fn compare_values(text: &str, old: &Spanned<DeValue<'_>>, new: &Value, replacements: &mut Vec<Replacement>) {
    match (old.get_ref(), new) {
        (DeValue::Table(old), Value::Table(new)) => compare(text, old, new, replacements),
        (DeValue::Array(old), Value::Array(new)) if old.len() <= new.len() => {
            old.iter().zip(new).for_each(|(old, new)| compare_values(text, old, new, replacements));
        }
        _ => {
            let is_same =
                |written: &str| format!("value = {written}").parse::<Table>().is_ok_and(|own| own["value"] == *new);
            if !text.get(old.span()).is_some_and(is_same) {
                replacements.push((old.span(), new.to_string()));
            }
        }
    }
}

/// A new entry behind the last one of a table: on a line of its own, or within the braces of an inline table.
fn added(text: &str, table: &DeTable<'_>, key: &str, value: &Value) -> Option<Replacement> {
    let is_entry = |own: &&Spanned<DeValue<'_>>| !matches!(own.get_ref(), DeValue::Table(_) | DeValue::Array(_));
    let end = table.values().filter(is_entry).map(|own| own.span().end).max()?;
    let rest = text.get(end..)?.lines().next().unwrap_or_default();
    let ends_line = rest.trim().is_empty() || rest.trim().starts_with('#');
    Some(match ends_line {
        true => (end + rest.len()..end + rest.len(), format!("\n{key} = {value}")),
        false => (end..end, format!(", {key} = {value}")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# A block.\nname = \"b\" # of tests\n\n[[camera]] # the first\nid = \"one\"\nf = 35 # mm?\n\
                        width_px = 4000\n\n# Nothing changes here.\n[[camera]]\nid = \"two\"\nf = \
                        4e3\n\n[sigma]\ntie_px = 0.5\n";

    fn after(text: &str, change: impl Fn(&mut Table)) -> String {
        let mut table: Table = text.parse().expect("TOML");
        change(&mut table);
        let new = rewritten(text, &table);
        assert_eq!(new.parse::<Table>().expect("TOML"), table, "{new}");
        new
    }

    fn camera(table: &mut Table, k: usize) -> &mut Table {
        table["camera"][k].as_table_mut().expect("a camera")
    }

    #[test]
    fn values_change_and_all_else_stays() {
        assert_eq!(after(TEXT, |_| {}), TEXT);
        let f = |table: &mut Table| drop(camera(table, 0).insert("f".into(), Value::Float(3500.0)));
        assert_eq!(after(TEXT, f), TEXT.replace("f = 35 #", "f = 3500.0 #"));
        let tie = |table: &mut Table| table["sigma"]["tie_px"] = Value::Float(5.0);
        assert_eq!(after(TEXT, tie), TEXT.replace("tie_px = 0.5", "tie_px = 5.0"));
    }

    #[test]
    fn a_new_entry_stands_behind_the_others() {
        let height = |table: &mut Table| drop(camera(table, 0).insert("height_px".into(), Value::Integer(3000)));
        assert_eq!(after(TEXT, height), TEXT.replace("width_px = 4000\n", "width_px = 4000\nheight_px = 3000\n"));
        let inline = "camera = [{ id = \"one\", f = 35 }] # one\n";
        let found = after(inline, height);
        assert_eq!(found, "camera = [{ id = \"one\", f = 35, height_px = 3000 }] # one\n");
    }

    #[test]
    fn what_values_cannot_say_is_written_without_comments() {
        let found = after(TEXT, |table| drop(camera(table, 1).remove("f")));
        assert!(!found.contains('#'), "{found}");
    }
}
