//! Reads the vertices of a PLY of any program: text, or binary in either byte order.

use super::fields::{Number, Points, Wanted, surplus};
use super::raw::{MOST_POINTS, Raw, unit_in};
use crate::fault::{Fault, Result};

/// Longest header, bytes.
const MOST_HEADER: usize = 64 << 10;

#[derive(Clone, Copy, PartialEq)]
enum Layout {
    Text,
    Binary { big_endian: bool },
}

/// What a property holds.
#[derive(Clone, Copy)]
enum Holds {
    One(Number),
    /// The number of items, then the items.
    List {
        count: Number,
        item: Number,
    },
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<(Holds, String)>,
}

impl Element {
    /// Bytes of a record; `None` if a list makes the length vary.
    fn size(&self) -> Option<usize> {
        self.properties.iter().map(|p| if let Holds::One(n) = p.0 { Some(n.bytes()) } else { None }).sum()
    }

    /// Writes into `offsets` where the properties of the record at the beginning of `bytes` start; returns the
    /// record's length.
    fn places(&self, bytes: &[u8], big_endian: bool, offsets: &mut Vec<usize>) -> Option<usize> {
        offsets.clear();
        let mut at = 0usize;
        for (holds, _) in &self.properties {
            offsets.push(at);
            at += match *holds {
                Holds::One(n) => n.bytes(),
                Holds::List { count, item } => {
                    let n = count.read(bytes.get(at..at + count.bytes())?, big_endian);
                    // A list must fit into the file.
                    let n = (n >= 0.0 && n <= bytes.len() as f64).then_some(n as usize)?;
                    count.bytes() + n * item.bytes()
                }
            };
        }
        (at <= bytes.len()).then_some(at)
    }

    /// Where the element's records end that begin at `at`; `None` if a list does not fit into the file.
    fn end(&self, body: &[u8], mut at: usize, big_endian: bool, offsets: &mut Vec<usize>) -> Option<usize> {
        if let Some(size) = self.size() {
            return Some(at.saturating_add(self.count.saturating_mul(size)));
        }
        for _ in 0..self.count {
            at += self.places(body.get(at..)?, big_endian, offsets)?;
        }
        Some(at)
    }

    /// As [`Element::places`], for a record of words: the index of each property's first word.
    fn words(&self, words: &[&str], offsets: &mut Vec<usize>) -> Option<()> {
        offsets.clear();
        let mut at = 0usize;
        for (holds, _) in &self.properties {
            offsets.push(at);
            at += match *holds {
                Holds::One(_) => 1,
                Holds::List { .. } => words.get(at)?.parse::<usize>().ok().filter(|n| *n <= words.len())? + 1,
            };
        }
        Some(())
    }
}

fn strange(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("is not a PLY that can be read: {what}"))
        .cause("a damaged file, or one whose points are not vertices with x, y and z")
        .next("export the points as PLY with x, y, z for each vertex, or as PCD")
}

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let (layout, elements, start, unit) = header(bytes)?;
    let vertex = elements.iter().position(|e| e.name == "vertex").ok_or_else(|| strange("it has no vertices"))?;
    let before = &elements[..vertex];
    let e = &elements[vertex];
    let after = &elements[vertex + 1..];
    let wanted = Wanted::among(e.properties.iter().map(|p| p.1.as_str())).map_err(strange)?;
    let kinds: Vec<Option<Number>> =
        e.properties.iter().map(|p| if let Holds::One(n) = p.0 { Some(n) } else { None }).collect();
    if wanted.xyz.into_iter().chain(wanted.light).any(|k| kinds[k].is_none()) {
        return Err(strange("x, y, z or intensity is a list"));
    }
    let body = &bytes[start..];
    let mut found = Points::default();
    let mut offsets = Vec::with_capacity(e.properties.len());
    match layout {
        Layout::Text => {
            let text = std::str::from_utf8(body).map_err(strange)?;
            let skip: usize = before.iter().map(|e| e.count).sum();
            let mut records = text.lines().filter(|l| !l.trim().is_empty()).skip(skip);
            let mut words = Vec::new();
            for k in 0..e.count {
                words.clear();
                words.extend(records.next().unwrap_or("").split_ascii_whitespace());
                let placed = e.words(&words, &mut offsets).is_some();
                let wanted = Wanted { xyz: wanted.xyz.map(|k| offsets[k]), light: wanted.light.map(|k| offsets[k]) };
                if !placed || !found.take_text(&wanted, &words) {
                    return Err(strange(format!("vertex {k} of {} is missing or no numbers", e.count)));
                }
            }
            let more = records.count().saturating_sub(after.iter().map(|e| e.count).sum());
            if more > 0 {
                return Err(surplus(e.count + more, e.count));
            }
        }
        Layout::Binary { big_endian } => {
            let ends = || strange(format!("it ends before its {} vertices", e.count));
            let mut at = 0usize;
            for b in before {
                at = b.end(body, at, big_endian, &mut offsets).ok_or_else(ends)?;
            }
            let size = e.size();
            if size.is_some_and(|size| at.saturating_add(e.count.saturating_mul(size)) > body.len()) {
                return Err(ends());
            }
            for k in 0..e.count {
                let record = body.get(at..).ok_or_else(ends)?;
                if k == 0 || size.is_none() {
                    e.places(record, big_endian, &mut offsets).ok_or_else(ends)?;
                }
                found.take(&wanted, |k| kinds[k].map_or(f64::NAN, |n| n.read(&record[offsets[k]..], big_endian)));
                at += match size {
                    Some(size) => size,
                    None => e.places(record, big_endian, &mut offsets).ok_or_else(ends)?,
                };
            }
            // What ends inside later elements, faces, still has all points.
            let end = after.iter().try_fold(at, |at, e| e.end(body, at, big_endian, &mut offsets));
            let least = e.size().unwrap_or(usize::MAX).max(1);
            let more = end.map_or(0, |end| body.len().saturating_sub(end) / least);
            if more > 0 {
                return Err(surplus(e.count + more, e.count));
            }
        }
    }
    let (points, intensity) = found.intensity();
    Ok(Raw::Points { line: None, points, intensity, unit })
}

/// Layout, elements, start of the records, and the unit that a comment states.
fn header(bytes: &[u8]) -> Result<(Layout, Vec<Element>, usize, Option<(f64, String)>)> {
    const END: &[u8] = b"\nend_header";
    let head = &bytes[..bytes.len().min(MOST_HEADER)];
    let end = head.windows(END.len()).position(|w| w == END).ok_or_else(|| strange("its header has no end"))?;
    let end = end + 1;
    let line = head[end..].iter().position(|&b| b == b'\n').ok_or_else(|| strange("its header has no end"))?;
    let text = std::str::from_utf8(&head[..end]).map_err(strange)?;
    let (mut layout, mut elements, mut unit) = (None, Vec::<Element>::new(), None);
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
                elements.push(Element { name: name.into(), count, properties: vec![] });
            }
            ["property", ref kind @ .., name] => {
                let holds = match kind {
                    ["list", count, item] => {
                        number(count).zip(number(item)).map(|(count, item)| Holds::List { count, item })
                    }
                    [kind] => number(kind).map(Holds::One),
                    _ => None,
                };
                let holds = holds.ok_or_else(|| strange(format!("'{l}'")))?;
                elements.last_mut().ok_or_else(|| strange(l))?.properties.push((holds, name.into()));
            }
            ["comment" | "obj_info", ..] => unit = unit.or_else(|| unit_in(l.trim_start().split_once(' ')?.1)),
            _ => {}
        }
    }
    Ok((layout.ok_or_else(|| strange("its format is not stated"))?, elements, end + line + 1, unit))
}

fn number(name: &str) -> Option<Number> {
    Some(match name.to_ascii_lowercase().as_str() {
        "char" | "int8" => Number::I8,
        "uchar" | "uint8" => Number::U8,
        "short" | "int16" => Number::I16,
        "ushort" | "uint16" => Number::U16,
        "int" | "int32" => Number::I32,
        "uint" | "uint32" => Number::U32,
        "int64" => Number::I64,
        "uint64" => Number::U64,
        "float" | "float32" => Number::F32,
        "double" | "float64" => Number::F64,
        _ => return None,
    })
}
