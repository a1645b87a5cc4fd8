//! Sets a value in a TOML text or removes one, and keeps every comment.
//!
//! `toml_edit` stores a comment with the entry next to it, so removing an entry would remove its comment. Therefore
//! an entry to be removed is only marked, and the text between the marks is cut out afterwards. A comment inside a
//! replaced value moves to the line above.

use crate::fault::{Fault, Result};
use serde_json::Value as Json;
use toml_edit::{Decor, DocumentMut, InlineTable, Item, Table, Value};

/// A text that is being edited.
pub(super) struct Document<'a> {
    before: &'a str,
    pub root: DocumentMut,
    mark: char,
}

impl<'a> Document<'a> {
    /// # Errors
    /// The text is not valid TOML.
    pub fn parse(text: &'a str) -> Result<Document<'a>> {
        let root = text.parse().map_err(|e: toml_edit::TomlError| {
            Fault::input(format!("is not TOML: {}", e.to_string().trim_end())).next("correct the text")
        })?;
        let mark = ('\u{e000}'..).find(|c| !text.contains(*c)).expect("a text has fewer characters than there are");
        Ok(Document { before: text, root, mark })
    }

    /// Sets the entry at a path of names; `None` removes it, and also a table that has no other entry.
    ///
    /// # Errors
    /// The path leads through something that is not a table.
    pub fn put(&mut self, path: &[&str], value: Option<&Json>) -> Result<()> {
        put(self.root.as_table_mut(), path, value, self.mark).map(|_| ())
    }

    /// Removes an entry from a list.
    ///
    /// # Errors
    /// There is no such entry.
    pub fn take_out_of(&mut self, list: &str, index: usize) -> Result<()> {
        let (mut key, item) = self.root.get_key_value_mut(list).ok_or_else(|| no_table(list))?;
        match item {
            Item::ArrayOfTables(list) if index < list.len() => {
                list.get_mut(index).into_iter().for_each(|table| cut_table(table, self.mark));
            }
            Item::Value(Value::Array(list)) if index < list.len() => {
                before(key.leaf_decor_mut(), self.mark);
                list.remove(index);
            }
            _ => return Err(no_table(list)),
        }
        Ok(())
    }

    /// The changed text, with all comments of the original.
    pub fn text(self) -> String {
        let Document { before, root, mark } = self;
        let made = root.to_string();
        let (from, to) = (made.find(mark), made.rfind(mark));
        let cut: String =
            from.zip(to).map_or(made.clone(), |(i, j)| made[..i].to_owned() + &made[j + mark.len_utf8()..]);
        let lost = lost(before, &cut);
        let above = from.map_or(cut.len(), |i| cut[..i].rfind('\n').map_or(0, |n| n + 1));
        let (head, tail) = cut.split_at(above);
        let said: String = lost.iter().map(|c| format!("{c}\n")).collect();
        if from == to {
            return format!("{head}{said}{tail}");
        }
        // The line from which something was cut keeps its remaining comment, or is removed.
        let line = tail.split('\n').next().unwrap_or_default();
        let left = if line.trim().is_empty() { &tail[(line.len() + 1).min(tail.len())..] } else { tail.trim_start() };
        let doubled = said.is_empty() && (head.is_empty() || head.ends_with("\n\n")) && line.trim().is_empty();
        match left.strip_prefix('\n').filter(|_| doubled) {
            Some(rest) => format!("{head}{rest}"),
            None if doubled && left.is_empty() => head.strip_suffix('\n').unwrap_or(head).to_owned(),
            None => format!("{head}{said}{left}"),
        }
    }
}

/// Every comment of a text, in order.
pub(super) fn comments(text: &str) -> Vec<&str> {
    let tokens = toml_parser::Source::new(text).lex();
    let said = tokens.filter(|t| t.kind() == toml_parser::lexer::TokenKind::Comment);
    said.map(|t| text[t.span().start()..t.span().end()].trim_end()).collect()
}

/// Comments of a text that another text lacks.
fn lost<'t>(before: &'t str, after: &str) -> Vec<&'t str> {
    let mut there = comments(after);
    let gone = |c: &&str| there.iter().position(|t| t == c).map(|i| there.swap_remove(i)).is_none();
    comments(before).into_iter().filter(gone).collect()
}

/// Sets or removes an entry; returns whether it was removed.
fn put(table: &mut Table, path: &[&str], value: Option<&Json>, mark: char) -> Result<bool> {
    let [name, rest @ ..] = path else { return Ok(false) };
    if !table.contains_key(name) {
        let Some(value) = value else { return Ok(false) };
        if rest.is_empty() {
            table.insert(name, Item::Value(plain(value)?));
            return Ok(false);
        }
        let mut below = Table::new();
        // The line [name] is written only if the table has values itself.
        below.set_implicit(true);
        below.set_dotted(table.is_dotted());
        table.insert(name, Item::Table(below));
    }
    let (mut key, item) = table.get_key_value_mut(name).expect("it is there or was made");
    match (item, value) {
        (Item::Table(below), _) if !rest.is_empty() => {
            let gone = put(below, rest, value, mark)? && below.len() <= 1;
            if gone && !below.is_dotted() {
                cut_table(below, mark);
            }
            return Ok(gone);
        }
        (Item::Table(below), Some(Json::Object(values))) => put_all(below, values, mark)?,
        (Item::Table(below), None) => cut_table(below, mark),
        (Item::ArrayOfTables(list), None) if rest.is_empty() => {
            // One entry represents all of them.
            while list.len() > 1 {
                list.remove(list.len() - 1);
            }
            list.iter_mut().for_each(|t| cut_table(t, mark));
        }
        (Item::Value(old), _) => {
            before(key.leaf_decor_mut(), mark);
            return put_value(old, path, value, mark);
        }
        (other, Some(value)) if rest.is_empty() => {
            before(key.leaf_decor_mut(), mark);
            *other = Item::Value(plain(value)?);
        }
        _ => return Err(no_table(name)),
    }
    Ok(value.is_none())
}

/// Gives a table exactly these entries.
fn put_all(table: &mut Table, values: &serde_json::Map<String, Json>, mark: char) -> Result<()> {
    let others: Vec<String> =
        table.iter().map(|(name, _)| name.to_owned()).filter(|name| !values.contains_key(name)).collect();
    others.iter().for_each(|name| drop(table.remove(name)));
    values.iter().try_for_each(|(name, value)| put(table, &[name], Some(value), mark).map(|_| ()))
}

/// Changes a value or an entry within its `{ }`. A value that is removed, or becomes empty, is marked. Returns
/// whether it was removed.
fn put_value(whole: &mut Value, path: &[&str], value: Option<&Json>, mark: char) -> Result<bool> {
    match value {
        Some(value) if path.len() == 1 => replace(whole, plain(value)?),
        _ if path.len() > 1 => put_inline(whole, path, value)?,
        _ => {}
    }
    let empty = || whole.as_inline_table().is_some_and(InlineTable::is_empty);
    let gone = value.is_none() && (path.len() == 1 || empty());
    if gone {
        behind(whole.decor_mut(), mark);
    }
    Ok(gone)
}

/// The same within `{ }`; the first name of the path is that of the whole value.
fn put_inline(whole: &mut Value, path: &[&str], value: Option<&Json>) -> Result<()> {
    let [own, name, rest @ ..] = path else { return Ok(()) };
    let table = whole.as_inline_table_mut().ok_or_else(|| no_table(own))?;
    if !table.contains_key(name) && value.is_some() && !rest.is_empty() {
        table.insert(*name, Value::InlineTable(InlineTable::new()));
    }
    match (table.get_mut(name), value) {
        (None, None) => {}
        (None, Some(value)) => drop(table.insert(*name, plain(value)?)),
        (Some(old), value) if !rest.is_empty() => {
            put_inline(old, &path[1..], value)?;
            if value.is_none() && old.as_inline_table().is_some_and(InlineTable::is_empty) {
                table.remove(name);
            }
        }
        (Some(old), Some(value)) => replace(old, plain(value)?),
        (Some(_), None) => drop(table.remove(name)),
    }
    Ok(())
}

fn no_table(name: &str) -> Fault {
    Fault::usage(format!("{name} is not a table")).next("correct the name, or change the text itself")
}

/// A value as TOML writes it.
pub(super) fn plain(value: &Json) -> Result<Value> {
    let refuse = |e: String| Fault::input(format!("{value} cannot be written: {e}")).next("give another value");
    let text = toml::Value::try_from(value).map_err(|e| refuse(e.to_string()))?.to_string();
    text.parse().map_err(|e: toml_edit::TomlError| refuse(e.to_string()))
}

/// Replaces a value in place, element by element where both are lists.
fn replace(old: &mut Value, mut new: Value) {
    match (&mut *old, &mut new) {
        (Value::Array(a), Value::Array(b)) => {
            while a.len() > b.len() {
                a.remove(a.len() - 1);
            }
            for (i, value) in std::mem::take(b).into_iter().enumerate() {
                match a.get_mut(i) {
                    Some(old) => replace(old, value),
                    None => a.push(value),
                }
            }
        }
        (Value::InlineTable(a), Value::InlineTable(b)) => {
            a.retain(|name, _| b.contains_key(name));
            for (name, value) in std::mem::take(b) {
                match a.get_mut(&name) {
                    Some(old) => replace(old, value),
                    None => drop(a.insert(name, value)),
                }
            }
        }
        _ => {
            let decor = old.decor().clone();
            *old = new;
            *old.decor_mut() = decor;
        }
    }
}

/// Marks a table's line and all its content to be cut out.
fn cut_table(table: &mut Table, mark: char) {
    table.clear();
    table.set_implicit(false);
    before(table.decor_mut(), mark);
    behind(table.decor_mut(), mark);
}

/// Puts the mark before an entry, after the comments above it.
fn before(decor: &mut Decor, mark: char) {
    let former = decor.prefix().and_then(|p| p.as_str()).unwrap_or_default();
    decor.set_prefix(format!("{former}{mark}"));
}

/// Puts the mark after an entry, before the comment on its line.
fn behind(decor: &mut Decor, mark: char) {
    let former = decor.suffix().and_then(|s| s.as_str()).unwrap_or_default();
    decor.set_suffix(format!("{mark}{former}"));
}
