//! In: a PLY of any program: text, or binary in either byte order. Out: its vertices.
//! Frame and unit: the file's own.

use super::fields::{Number, Points, Wanted};
use super::raw::{MOST_POINTS, Raw};
use crate::fault::{Fault, Result};

/// Longest header, bytes.
const MOST_HEADER: usize = 64 << 10;

#[derive(Clone, Copy, PartialEq)]
enum Layout {
    Text,
    Binary { big_endian: bool },
}

struct Element {
    name: String,
    count: usize,
    /// Its scalar properties.
    properties: Vec<(Number, String)>,
    /// Whether it has a list, whose length only its own records tell.
    lists: bool,
}

fn strange(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("is not a PLY that can be read: {what}"))
        .cause("a damaged file, or one whose points are not vertices with x, y and z")
        .next("export the points as PLY with x, y, z for each vertex, or as PCD")
}

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let (layout, elements, start) = header(bytes)?;
    let vertex = elements.iter().position(|e| e.name == "vertex").ok_or_else(|| strange("it has no vertices"))?;
    let before = &elements[..vertex];
    if elements[..=vertex].iter().any(|e| e.lists) {
        return Err(strange("a list stands in or before its vertices"));
    }
    let e = &elements[vertex];
    let wanted =
        Wanted::among(e.properties.iter().map(|p| p.1.as_str())).ok_or_else(|| strange("x, y or z is missing"))?;
    let body = &bytes[start..];
    let mut found = Points::default();
    match layout {
        Layout::Text => {
            let text = std::str::from_utf8(body).map_err(strange)?;
            let skip: usize = before.iter().map(|e| e.count).sum();
            let mut records = text.lines().filter(|l| !l.trim().is_empty()).skip(skip);
            let mut words = Vec::new();
            for k in 0..e.count {
                words.clear();
                words.extend(records.next().unwrap_or("").split_ascii_whitespace());
                if !found.take_text(&wanted, &words) {
                    return Err(strange(format!("vertex {k} of {} is missing or no numbers", e.count)));
                }
            }
        }
        Layout::Binary { big_endian } => {
            let size = |e: &Element| e.properties.iter().map(|p| p.0.bytes()).sum::<usize>();
            let skip: usize = before.iter().map(|e| e.count.saturating_mul(size(e))).fold(0, usize::saturating_add);
            let record = size(e);
            let end = e.count.saturating_mul(record).saturating_add(skip);
            let body =
                body.get(skip..end).ok_or_else(|| strange(format!("it ends before its {} vertices", e.count)))?;
            let mut offsets = Vec::with_capacity(e.properties.len());
            let mut at = 0;
            for p in &e.properties {
                offsets.push(at);
                at += p.0.bytes();
            }
            for r in body.chunks_exact(record) {
                found.take(&wanted, |k| e.properties[k].0.read(&r[offsets[k]..], big_endian));
            }
        }
    }
    let (points, intensity) = found.intensity();
    Ok(Raw::Points { line: None, points, intensity })
}

fn header(bytes: &[u8]) -> Result<(Layout, Vec<Element>, usize)> {
    const END: &[u8] = b"end_header";
    let head = &bytes[..bytes.len().min(MOST_HEADER)];
    let end = head.windows(END.len()).position(|w| w == END).ok_or_else(|| strange("its header has no end"))?;
    let line = head[end..].iter().position(|&b| b == b'\n').ok_or_else(|| strange("its header has no end"))?;
    let text = std::str::from_utf8(&head[..end]).map_err(strange)?;
    let (mut layout, mut elements) = (None, Vec::<Element>::new());
    for l in text.lines() {
        let words: Vec<&str> = l.split_ascii_whitespace().collect();
        match words[..] {
            ["format", kind, "1.0"] => {
                layout = match kind {
                    "ascii" => Some(Layout::Text),
                    "binary_little_endian" => Some(Layout::Binary { big_endian: false }),
                    "binary_big_endian" => Some(Layout::Binary { big_endian: true }),
                    _ => return Err(strange(format!("its format is '{kind}'"))),
                }
            }
            ["element", name, count] => {
                let count = count.parse().ok().filter(|&n| n <= MOST_POINTS);
                let count = count.ok_or_else(|| strange(format!("'{l}', limit {MOST_POINTS}")))?;
                elements.push(Element { name: name.into(), count, properties: vec![], lists: false });
            }
            ["property", "list", ..] => elements.last_mut().ok_or_else(|| strange(l))?.lists = true,
            ["property", kind, name] => {
                let kind = number(kind).ok_or_else(|| strange(format!("'{l}'")))?;
                elements.last_mut().ok_or_else(|| strange(l))?.properties.push((kind, name.into()));
            }
            _ => {}
        }
    }
    Ok((layout.ok_or_else(|| strange("its format is not stated"))?, elements, end + line + 1))
}

fn number(name: &str) -> Option<Number> {
    Some(match name {
        "char" | "int8" => Number::I8,
        "uchar" | "uint8" => Number::U8,
        "short" | "int16" => Number::I16,
        "ushort" | "uint16" => Number::U16,
        "int" | "int32" => Number::I32,
        "uint" | "uint32" => Number::U32,
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
