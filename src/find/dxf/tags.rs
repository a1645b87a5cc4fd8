//! In: the bytes of a DXF file (ASCII). Out: its unit, layers, blocks and entities, each entity as its group codes.
//! Frame and unit: none; values are the file's text, lines are counted from 1.

use crate::fault::{Fault, Result};
use std::collections::BTreeMap;

const DAMAGED: &str = "a damaged file";
const EXPORT: &str = "export the drawing again as ASCII DXF";

/// One group: a code and its value.
#[derive(Clone, Debug)]
pub struct Tag {
    pub code: i32,
    pub value: String,
    pub line: usize,
}

/// An entity: its kind and its groups up to the next entity.
#[derive(Clone, Debug)]
pub struct Entity {
    pub kind: String,
    pub line: usize,
    pub tags: Vec<Tag>,
}

/// The content of a file that is used.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// $INSUNITS; `None` where it is missing.
    pub units: Option<i64>,
    /// $MEASUREMENT: 0 inches and feet, 1 metric.
    pub measurement: Option<i64>,
    /// By `key`.
    pub layers: BTreeMap<String, Layer>,
    /// By `key`.
    pub blocks: BTreeMap<String, Block>,
    pub entities: Vec<Entity>,
    /// Number of inserted blocks that the drawing shows only in part.
    pub clipped: usize,
}

#[derive(Clone, Debug)]
pub struct Layer {
    pub off: bool,
    pub frozen: bool,
    pub linetype: String,
}

/// Lookup key of a name: names of layers, blocks and linetypes do not depend on case.
pub fn key(name: &str) -> String {
    name.trim().to_uppercase()
}

/// Entities that INSERT refers to, relative to their base point.
#[derive(Clone, Debug)]
pub struct Block {
    pub head: Entity,
    pub entities: Vec<Entity>,
}

impl Entity {
    pub fn fault(&self, what: impl std::fmt::Display) -> Fault {
        Fault::input(format!("{} at line {}: {what}", self.kind, self.line))
            .cause("a damaged file, or a slip in the drawing")
            .next("correct it in the drawing and export it again")
    }

    pub fn text(&self, code: i32) -> Option<&str> {
        self.tags.iter().find(|t| t.code == code).map(|t| t.value.as_str())
    }

    /// The number of a group; `missing` if there is no such group.
    pub fn number(&self, code: i32, missing: f64) -> Result<f64> {
        self.tags.iter().find(|t| t.code == code).map_or(Ok(missing), Tag::number)
    }

    pub fn needed(&self, code: i32) -> Result<f64> {
        let found = self.tags.iter().find(|t| t.code == code);
        let missing = || self.fault(format!("it has no group {code}")).cause(DAMAGED).next(EXPORT);
        found.ok_or_else(missing)?.number()
    }

    pub fn whole(&self, code: i32, missing: i64) -> Result<i64> {
        self.tags.iter().find(|t| t.code == code).map_or(Ok(missing), Tag::whole)
    }

    pub fn layer(&self) -> &str {
        self.text(8).map_or("0", str::trim)
    }
}

impl Tag {
    /// A length or an angle. Refuses a value that is not finite or not below 1e12.
    pub fn number(&self) -> Result<f64> {
        let value = self.value.trim().parse::<f64>().ok().filter(|v| v.is_finite() && v.abs() < 1e12);
        value.ok_or_else(|| {
            Fault::input(format!("line {}: '{}' is not a usable number (finite, below 1e12)", self.line, self.short()))
                .cause(DAMAGED)
                .next(EXPORT)
        })
    }

    pub fn whole(&self) -> Result<i64> {
        let value = self.value.trim().parse();
        value.map_err(|_| {
            Fault::input(format!("line {}: '{}' is not a whole number", self.line, self.short()))
                .cause(DAMAGED)
                .next(EXPORT)
        })
    }

    fn short(&self) -> String {
        self.value.chars().take(40).collect()
    }
}

/// Reads a file's groups; sections that are not needed are skipped.
pub fn read(bytes: &[u8]) -> Result<File> {
    const NEXT: &str = "save the drawing as ASCII DXF";
    if bytes.starts_with(b"AutoCAD Binary DXF") {
        return Err(Fault::input("is a binary DXF, which is not read").next(NEXT));
    }
    if bytes.starts_with(b"AC10") {
        return Err(Fault::input("is a DWG, which is not read").next(NEXT));
    }
    let tags = tags(&text(bytes))?;
    let mut file = File::default();
    let mut at = 0;
    while let Some(tag) = tags.get(at) {
        at += 1;
        match (tag.code, tag.value.trim()) {
            (0, "EOF") => return Ok(file),
            (0, "SECTION") => {
                let end = (at..tags.len()).find(|&i| tags[i].code == 0 && tags[i].value.trim() == "ENDSEC");
                let end = end.ok_or_else(|| cut(&tags))?;
                section(&tags[at..end], &mut file)?;
                at = end + 1;
            }
            // Comments, and what some programs write between sections.
            _ => {}
        }
    }
    Err(cut(&tags))
}

fn cut(tags: &[Tag]) -> Fault {
    let line = tags.last().map_or(0, |t| t.line);
    Fault::input(format!("ends at line {line} without ENDSEC and EOF"))
        .cause("the file was cut off, or is not a DXF")
        .next("export the drawing again as ASCII DXF")
}

/// Text is UTF-8 since 2007, before that in the code page of the writer's Windows. Only names are text here, and they
/// need only differ where the file's bytes differ. So each byte becomes one character, which is correct for the western
/// code page.
fn text(bytes: &[u8]) -> String {
    let plain = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    };
    // A character that the code page lacks is written as \U+ and four digits.
    let mut parts = plain.split("\\U+");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let code = part.get(..4).and_then(|digits| u32::from_str_radix(digits, 16).ok()).and_then(char::from_u32);
        match code.filter(|c| !c.is_control()) {
            Some(c) => out.extend([c.to_string().as_str(), &part[4..]]),
            None => out.extend(["\\U+", part]),
        }
    }
    out
}

fn tags(text: &str) -> Result<Vec<Tag>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut out = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((i, code)) = lines.next() {
        // Some programs write empty lines, a Ctrl-Z or remains of an older file after the end.
        if out.last().is_some_and(|t: &Tag| t.code == 0 && t.value.trim() == "EOF") {
            break;
        }
        let Ok(number) = code.trim().parse() else {
            let short: String = code.chars().take(40).collect();
            return Err(Fault::input(format!("line {}: '{short}' is not a group code", i + 1))
                .cause("the file is not a DXF, or is damaged")
                .next("export the drawing again as ASCII DXF"));
        };
        let Some((_, value)) = lines.next() else { break };
        out.push(Tag { code: number, value: value.to_owned(), line: i + 2 });
    }
    Ok(out)
}

fn section(tags: &[Tag], file: &mut File) -> Result<()> {
    let Some(name) = tags.first().filter(|t| t.code == 2) else { return Ok(()) };
    match name.value.trim() {
        "HEADER" => {
            let value = |name: &str| {
                let at = tags.iter().position(|t| t.code == 9 && t.value.trim() == name);
                at.and_then(|i| tags.get(i + 1)).filter(|t| t.code == 70).map(Tag::whole).transpose()
            };
            (file.units, file.measurement) = (value("$INSUNITS")?, value("$MEASUREMENT")?);
        }
        "TABLES" => {
            for layer in entities(&tags[1..]).iter().filter(|e| e.kind == "LAYER") {
                let (frozen, off) = (layer.whole(70, 0)? & 1 != 0, layer.whole(62, 7)? < 0);
                let linetype = layer.text(6).unwrap_or_default().to_owned();
                file.layers.insert(key(layer.text(2).unwrap_or_default()), Layer { off, frozen, linetype });
            }
        }
        "BLOCKS" => {
            let mut open: Option<Block> = None;
            for e in entities(&tags[1..]) {
                match (e.kind.as_str(), &mut open) {
                    ("BLOCK", _) => open = Some(Block { head: e, entities: vec![] }),
                    ("ENDBLK", _) => {
                        if let Some(block) = open.take() {
                            file.blocks.insert(key(block.head.text(2).unwrap_or_default()), block);
                        }
                    }
                    (_, Some(block)) => block.entities.push(e),
                    _ => {}
                }
            }
        }
        "ENTITIES" => file.entities.extend(entities(&tags[1..])),
        "OBJECTS" => file.clipped = tags.iter().filter(|t| t.code == 0 && t.value.trim() == "SPATIAL_FILTER").count(),
        _ => {}
    }
    Ok(())
}

fn entities(tags: &[Tag]) -> Vec<Entity> {
    let mut out: Vec<Entity> = Vec::new();
    for t in tags {
        if t.code == 0 {
            out.push(Entity { kind: t.value.trim().to_owned(), line: t.line, tags: vec![] });
        } else if let Some(e) = out.last_mut() {
            e.tags.push(t.clone());
        }
    }
    out
}
