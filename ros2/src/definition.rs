//! In: the text of a `ros2msg` schema. Out: its types with their fields, complete and without a type in itself.

use std::collections::BTreeMap;

/// Kinds of single values, with the numbers that type_description_interfaces/msg/FieldType gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    Nested = 1,
    Int8 = 2,
    Uint8 = 3,
    Int16 = 4,
    Uint16 = 5,
    Int32 = 6,
    Uint32 = 7,
    Int64 = 8,
    Uint64 = 9,
    Float = 10,
    Double = 11,
    Bool = 15,
    Byte = 16,
    String = 17,
    Wstring = 18,
    BoundedString = 21,
    BoundedWstring = 22,
}

/// How many values a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    One,
    Fixed(u64),
    Bounded(u64),
    Any,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
    /// Most characters of a bounded text; 0 is no bound.
    pub longest: u64,
    /// package/msg/Name of a nested type; otherwise empty.
    pub nested: String,
}

/// A type and all types that it depends on, by their full names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    pub name: String,
    pub types: BTreeMap<String, Vec<Field>>,
}

/// Most types of types in each other.
const DEEPEST: usize = 32;
/// Most characters of a name.
pub const LONGEST: usize = 255;
/// Most bytes of a schema.
pub const MOST_BYTES: usize = 1 << 20;

/// Whether the text is a word of letters, digits and `_` that begins with a letter.
pub fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// package/msg/Name, also of package/Name.
fn full_name(text: &str) -> Option<String> {
    let parts: Vec<&str> = text.split('/').collect();
    match parts[..] {
        [package, name] if is_word(package) && is_word(name) => Some(format!("{package}/msg/{name}")),
        [package, folder, name] if is_word(package) && is_word(folder) && is_word(name) => Some(text.to_owned()),
        _ => None,
    }
}

impl Definition {
    /// Reads the schema of the type `name`.
    ///
    /// # Errors
    /// In words: no ROS 2 definition, a type without definition, or one that contains itself.
    pub fn read(name: &str, text: &[u8]) -> Result<Definition, String> {
        if text.len() > MOST_BYTES {
            return Err(format!("its schema has {} bytes, at most {MOST_BYTES} are read", text.len()));
        }
        let text = std::str::from_utf8(text).map_err(|_| "its schema is no UTF-8".to_owned())?;
        let root = full_name(name).filter(|full| full == name && name.len() <= LONGEST);
        let root = root.ok_or_else(|| format!("its type '{name}' is not like package/msg/Name"))?;
        let mut types = BTreeMap::new();
        for (at, part) in parts(text).enumerate() {
            let (full, body) = if at == 0 { (root.clone(), part) } else { headed(part)? };
            let fields = body.lines().map(|line| field(line, &full)).filter_map(Result::transpose);
            let fields = fields.collect::<Result<Vec<_>, _>>().map_err(|why| format!("{full}: {why}"))?;
            // A definition may stand there twice.
            let before = types.insert(full.clone(), fields.clone());
            if before.is_some_and(|before| before != fields) {
                return Err(format!("{full} has two different definitions"));
            }
        }
        let mut whole = Definition { name: root.clone(), types: BTreeMap::new() };
        whole.take(&root, &types, &mut Vec::new())?;
        Ok(whole)
    }

    /// Takes a type and all that it depends on.
    fn take(&mut self, name: &str, all: &BTreeMap<String, Vec<Field>>, above: &mut Vec<String>) -> Result<(), String> {
        if above.iter().any(|n| n == name) {
            return Err(format!("{name} contains itself"));
        }
        if above.len() == DEEPEST {
            return Err(format!("{name} is {DEEPEST} types deep, fewer are possible"));
        }
        if self.types.contains_key(name) {
            return Ok(());
        }
        let fields = all.get(name).ok_or_else(|| format!("the definition of {name} is missing"))?;
        above.push(name.to_owned());
        for field in fields.iter().filter(|f| f.kind == Kind::Nested) {
            self.take(&field.nested, all, above)?;
        }
        above.pop();
        self.types.insert(name.to_owned(), fields.clone());
        Ok(())
    }
}

/// The definitions of a schema: they are separated by lines of `=`.
fn parts(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let whole = rest.take()?;
        let mut at = 0;
        for line in whole.split_inclusive('\n') {
            let bare = line.trim();
            if bare.len() >= 3 && bare.bytes().all(|b| b == b'=') {
                rest = Some(&whole[at + line.len()..]);
                return Some(&whole[..at]);
            }
            at += line.len();
        }
        Some(whole)
    })
}

/// A definition behind its line `MSG: package/Name`.
fn headed(part: &str) -> Result<(String, &str), String> {
    let part = part.trim_start();
    let (line, body) = part.split_once('\n').unwrap_or((part, ""));
    let name = line.trim().strip_prefix("MSG:").map(str::trim).and_then(full_name);
    name.map(|name| (name, body)).ok_or_else(|| format!("'{}' is not like MSG: package/Name", short(line)))
}

/// The first characters of a line, for errors.
fn short(text: &str) -> String {
    text.trim().chars().take(60).collect()
}

/// The field of a line; none for a constant, a comment or an empty line.
fn field(line: &str, inside: &str) -> Result<Option<Field>, String> {
    let wrong = || format!("'{}' is no field", short(line));
    let bare = line.split('#').next().unwrap_or("").trim();
    if bare.is_empty() {
        return Ok(None);
    }
    let (kind, rest) = bare.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let rest = rest.trim_start();
    let name = rest.split(|c: char| c.is_whitespace() || c == '=').next().unwrap_or("");
    if !is_word(name) {
        return Err(wrong());
    }
    if rest[name.len()..].trim_start().starts_with('=') {
        return Ok(None);
    }
    let (bare, count) = counted(kind).ok_or_else(wrong)?;
    let (word, longest) = match bare.split_once("<=") {
        Some((word, most)) => (word, most.parse().ok().filter(|n| *n > 0).ok_or_else(wrong)?),
        None => (bare, 0),
    };
    let mut nested = String::new();
    let kind = match (word, longest > 0) {
        ("string", false) => Kind::String,
        ("wstring", false) => Kind::Wstring,
        ("string", true) => Kind::BoundedString,
        ("wstring", true) => Kind::BoundedWstring,
        (_, true) => return Err(wrong()),
        ("bool", _) => Kind::Bool,
        ("byte", _) => Kind::Byte,
        // `char` is an unsigned byte in ROS 2.
        ("uint8" | "char", _) => Kind::Uint8,
        ("int8", _) => Kind::Int8,
        ("int16", _) => Kind::Int16,
        ("uint16", _) => Kind::Uint16,
        ("int32", _) => Kind::Int32,
        ("uint32", _) => Kind::Uint32,
        ("int64", _) => Kind::Int64,
        ("uint64", _) => Kind::Uint64,
        ("float32", _) => Kind::Float,
        ("float64", _) => Kind::Double,
        // A name without package is one of the same package.
        (name, _) => {
            let package = inside.split('/').next().unwrap_or("");
            let full = if is_word(name) { full_name(&format!("{package}/{name}")) } else { full_name(name) };
            nested = full.ok_or_else(wrong)?;
            Kind::Nested
        }
    };
    Ok(Some(Field { name: name.to_owned(), kind, count, longest, nested }))
}

/// A type's word without its brackets.
fn counted(kind: &str) -> Option<(&str, Count)> {
    let Some(open) = kind.strip_suffix(']') else { return Some((kind, Count::One)) };
    let (bare, inner) = open.rsplit_once('[')?;
    let number = |text: &str| text.parse::<u64>().ok().filter(|n| *n > 0);
    Some((
        bare,
        match (inner, inner.strip_prefix("<=")) {
            ("", _) => Count::Any,
            (_, Some(most)) => Count::Bounded(number(most)?),
            (size, None) => Count::Fixed(number(size)?),
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "# a comment\nuint8 OK=0\nstring WORD = \"a # b\"\nHead head # its head\nchar[3] letters\n\
        string<=7[<=2] names [\"a\", \"b\"]\nother/Thing[] things\nfloat64 x 1.5\n\
        ====\nMSG: pack/Head\nint32 n\n=====\nMSG: other/Thing\nbyte b\n====\nMSG: other/Unused\nbool b\n";

    #[test]
    fn fields_are_read_and_what_is_not_used_is_not_there() {
        let all = Definition::read("pack/msg/Two", TWO.as_bytes()).unwrap();
        let names: Vec<&String> = all.types.keys().collect();
        assert_eq!(names, ["other/msg/Thing", "pack/msg/Head", "pack/msg/Two"]);
        let two = &all.types["pack/msg/Two"];
        let seen: Vec<_> = two.iter().map(|f| (f.name.as_str(), f.kind, f.count, f.longest)).collect();
        assert_eq!(
            seen,
            [
                ("head", Kind::Nested, Count::One, 0),
                ("letters", Kind::Uint8, Count::Fixed(3), 0),
                ("names", Kind::BoundedString, Count::Bounded(2), 7),
                ("things", Kind::Nested, Count::Any, 0),
                ("x", Kind::Double, Count::One, 0),
            ]
        );
        assert_eq!(two[0].nested, "pack/msg/Head");
    }

    #[test]
    fn what_is_no_definition_is_refused_in_words() {
        let of = |text: &str| Definition::read("a/msg/B", text.as_bytes()).unwrap_err();
        assert!(of("Missing m\n").contains("definition of a/msg/Missing is missing"));
        assert!(of("C c\n===\nMSG: a/C\nB b\n").contains("a/msg/B contains itself"));
        assert!(of("uint8\n").contains("'uint8' is no field"));
        assert!(of("uint8[0] x\n").contains("is no field"));
        assert!(of("int8<=3 x\n").contains("is no field"));
        assert!(of("int8 x\n===\nno name\n").contains("MSG:"));
        assert!(of("C c\n===\nMSG: a/C\nint8 x\n===\nMSG: a/C\nint8 y\n").contains("two different"));
        assert!(Definition::read("B", b"").unwrap_err().contains("package/msg/Name"));
        assert!(Definition::read("a/msg/B", &[0xff]).unwrap_err().contains("UTF-8"));
        assert!(Definition::read("a/msg/B", &vec![b' '; MOST_BYTES + 1]).unwrap_err().contains("1048577 bytes"));
        let deep: String = (0..40).map(|i| format!("===\nMSG: a/T{i}\nT{} t\n", i + 1)).collect();
        assert!(of(&format!("T0 t\n{deep}===\nMSG: a/T40\n")).contains("32 types deep"));
    }
}
