//! In: a table of features. Out: the GenApi description (XML) of a module and the registers behind it, from the same
//! table: names, ranges and access rights cannot differ.
//!
//! Feature n has its register at `FIRST + n * ROOM`: 8 bytes for numbers (little endian), `TEXT` bytes for texts. The
//! description lies at `XML_AT`.

use crate::standard::error;
use crate::status::{Result, refuse};
use std::fmt::Write;

const FIRST: u64 = 0x1000;
const ROOM: u64 = 0x400;
const TEXT: usize = 0x400;
const NUMBER: usize = 8;
pub const XML_AT: u64 = 0x1000_0000;

/// A value of a feature. Choices, commands and booleans are integers.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Integer(i64),
    Float(f64),
    Text(String),
}

/// One value of a choice.
pub struct Choice {
    pub name: &'static str,
    pub value: i64,
    /// It is available only while this feature has this value.
    pub when: Option<(&'static str, i64)>,
}

pub enum Kind {
    /// Limits by value, or by another feature's.
    Integer {
        least: i64,
        most: Most,
    },
    /// Limits and unit of a float.
    Float {
        least: f64,
        most: f64,
        unit: &'static str,
    },
    Text,
    Choice(&'static [Choice]),
    Boolean,
    Command,
}

pub enum Most {
    Is(i64),
    Of(&'static str),
}

pub struct Feature {
    pub name: &'static str,
    pub about: &'static str,
    pub kind: Kind,
    pub writable: bool,
    /// Not writable while an acquisition runs.
    pub locked: bool,
    /// The features whose values belong to what is selected here.
    pub selects: &'static [&'static str],
}

pub struct Category {
    pub name: &'static str,
    pub features: Vec<Feature>,
}

/// The features of a module.
pub struct Table {
    pub module: &'static str,
    pub categories: Vec<Category>,
}

/// Where features have their values.
pub trait Values {
    fn get(&self, name: &str) -> Result<Value>;
    fn set(&self, name: &str, value: Value) -> Result<()>;
    /// The present upper limit of a feature that another one limits.
    fn most(&self, name: &str) -> Result<i64> {
        match self.get(name)? {
            Value::Integer(most) => Ok(most),
            other => refuse(error::ERROR, format!("{name} is {other:?}, not a limit")),
        }
    }
}

impl Feature {
    fn length(&self) -> usize {
        if matches!(self.kind, Kind::Text) { TEXT } else { NUMBER }
    }

    /// Whether a value is one of those that the feature may have.
    fn check(&self, value: &Value, values: &dyn Values) -> Result<()> {
        let out = |range: String| refuse(error::INVALID_VALUE, format!("{} is {value:?}, allowed {range}", self.name));
        match (&self.kind, value) {
            (Kind::Integer { least, most }, Value::Integer(x)) => {
                let most = match most {
                    Most::Is(most) => *most,
                    Most::Of(name) => values.most(name)?,
                };
                if (*least..=most).contains(x) { Ok(()) } else { out(format!("{least}..={most}")) }
            }
            (Kind::Float { least, most, .. }, Value::Float(x)) => {
                if (*least..=*most).contains(x) {
                    Ok(())
                } else {
                    out(format!("{least}..={most}"))
                }
            }
            (Kind::Choice(choices), Value::Integer(x)) => {
                let names = choices.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
                if choices.iter().any(|c| c.value == *x) { Ok(()) } else { out(names) }
            }
            (Kind::Boolean, Value::Integer(x)) if (0..=1).contains(x) => Ok(()),
            (Kind::Boolean, _) => out("0 or 1".into()),
            (Kind::Command, Value::Integer(1)) => Ok(()),
            (Kind::Command, _) => out("1".into()),
            _ => out("another type".into()),
        }
    }
}

impl Table {
    fn all(&self) -> impl Iterator<Item = &Feature> {
        self.categories.iter().flat_map(|c| &c.features)
    }

    fn address(&self, name: &str) -> u64 {
        FIRST + ROOM * self.all().position(|f| f.name == name).expect("a feature of the table") as u64
    }

    /// The feature whose register holds an address, and the offset in it.
    fn at(&self, address: u64) -> Result<(&Feature, usize)> {
        let n = address.checked_sub(FIRST).map(|a| ((a / ROOM) as usize, (a % ROOM) as usize));
        let found = n.and_then(|(n, offset)| Some((self.all().nth(n)?, offset)));
        match found.filter(|(f, offset)| *offset < f.length()) {
            Some(found) => Ok(found),
            None => refuse(error::INVALID_ADDRESS, format!("no register of {} is at {address:#x}", self.module)),
        }
    }

    /// The bytes at an address: the description, or a part of one register.
    pub fn read(&self, xml: &[u8], values: &dyn Values, address: u64, length: usize) -> Result<Vec<u8>> {
        let outside = |room: usize| {
            refuse(error::INVALID_ADDRESS, format!("{length} bytes from {address:#x} on: only {room} are there"))
        };
        if let Some(offset) = address.checked_sub(XML_AT).and_then(|o| usize::try_from(o).ok()) {
            let rest = xml.get(offset..).unwrap_or(&[]);
            return rest.get(..length).map_or_else(|| outside(rest.len()), |bytes| Ok(bytes.to_vec()));
        }
        let (feature, offset) = self.at(address)?;
        let mut bytes = match feature.kind {
            // A command is done when its register reads 0; it is done when it was written.
            Kind::Command => vec![0; NUMBER],
            _ => match values.get(feature.name)? {
                Value::Integer(x) => x.to_le_bytes().to_vec(),
                Value::Float(x) => x.to_le_bytes().to_vec(),
                Value::Text(text) => {
                    // The last byte stays 0.
                    let mut end = text.len().min(TEXT - 1);
                    while !text.is_char_boundary(end) {
                        end -= 1;
                    }
                    text.as_bytes()[..end].to_vec()
                }
            },
        };
        bytes.resize(feature.length(), 0);
        bytes[offset..].get(..length).map_or_else(|| outside(bytes.len() - offset), |b| Ok(b.to_vec()))
    }

    /// Writes a whole register.
    pub fn write(&self, values: &dyn Values, address: u64, bytes: &[u8]) -> Result<()> {
        if address >= XML_AT {
            return refuse(error::ACCESS_DENIED, "the description cannot be written");
        }
        let (feature, offset) = self.at(address)?;
        if !feature.writable {
            return refuse(error::ACCESS_DENIED, format!("{} is read only", feature.name));
        }
        let Ok(bytes) =
            <[u8; NUMBER]>::try_from(bytes).map_err(|_| ()).and_then(|b| if offset == 0 { Ok(b) } else { Err(()) })
        else {
            let what = format!("{}: {} bytes at offset {offset}; {NUMBER} at 0 are written", feature.name, bytes.len());
            return refuse(error::INVALID_ADDRESS, what);
        };
        let value = match feature.kind {
            Kind::Float { .. } => Value::Float(f64::from_le_bytes(bytes)),
            _ => Value::Integer(i64::from_le_bytes(bytes)),
        };
        if feature.locked && values.get("TLParamsLocked")? != Value::Integer(0) {
            return refuse(error::ACCESS_DENIED, format!("{} stays as it is while TLParamsLocked is 1", feature.name));
        }
        feature.check(&value, values)?;
        values.set(feature.name, value)
    }

    /// The GenApi description.
    pub fn xml(&self) -> String {
        let mut x = format!(
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RegisterDescription ModelName=\"{}\" \
             VendorName=\"Sheetlight\" ToolTip=\"Sheetlight {}\" StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" \
             SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" \
             SubMinorVersion=\"0\" ProductGuid=\"53686565-746c-6967-6874-0000000000{:02x}\" \
             VersionGuid=\"53686565-746c-6967-6874-0000000001{:02x}\" \
             xmlns=\"http://www.genicam.org/GenApi/Version_1_1\" \
             xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
             xsi:schemaLocation=\"http://www.genicam.org/GenApi/Version_1_1 \
             http://www.genicam.org/GenApi/GenApiSchema_Version_1_1.xsd\">\n",
            self.module,
            self.module,
            self.module.len(),
            self.module.len()
        );
        let mut put = |line: std::fmt::Arguments| writeln!(x, "{line}").expect("a text grows");
        put(format_args!("<Category Name=\"Root\">"));
        self.categories.iter().for_each(|c| put(format_args!("  <pFeature>{}</pFeature>", c.name)));
        put(format_args!("</Category>"));
        for category in &self.categories {
            put(format_args!("<Category Name=\"{}\">", category.name));
            category.features.iter().for_each(|f| put(format_args!("  <pFeature>{}</pFeature>", f.name)));
            put(format_args!("</Category>"));
        }
        for feature in self.all() {
            self.describe(feature, &mut put);
        }
        put(format_args!("<Port Name=\"Device\"/>\n</RegisterDescription>"));
        x
    }

    fn describe(&self, f: &Feature, put: &mut dyn FnMut(std::fmt::Arguments)) {
        let Feature { name, about, .. } = f;
        let node = match f.kind {
            Kind::Integer { .. } => "Integer",
            Kind::Float { .. } => "Float",
            Kind::Text => "StringReg",
            Kind::Choice(_) => "Enumeration",
            Kind::Boolean => "Boolean",
            Kind::Command => "Command",
        };
        put(format_args!("<{node} Name=\"{name}\" NameSpace=\"{}\">", namespace(name)));
        put(format_args!("  <ToolTip>{about}</ToolTip>"));
        if f.locked {
            put(format_args!("  <pIsLocked>TLParamsLocked</pIsLocked>"));
        }
        let (access, at) = (if f.writable { "RW" } else { "RO" }, self.address(name));
        let access = format!("<AccessMode>{access}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>");
        let place = format!("<Address>{at:#x}</Address><Length>{}</Length>{access}", f.length());
        match &f.kind {
            Kind::Text => {
                put(format_args!("  {place}\n</StringReg>"));
                return;
            }
            Kind::Choice(choices) => {
                for c in *choices {
                    put(format_args!("  <EnumEntry Name=\"{}\" NameSpace=\"{}\">", c.name, namespace(c.name)));
                    if c.when.is_some() {
                        put(format_args!("    <pIsAvailable>{name}_{}_Available</pIsAvailable>", c.name));
                    }
                    put(format_args!("    <Value>{}</Value>\n  </EnumEntry>", c.value));
                }
            }
            _ => {}
        }
        put(format_args!("  <pValue>{name}_Reg</pValue>"));
        match &f.kind {
            Kind::Integer { least, most } => {
                put(format_args!("  <Min>{least}</Min>"));
                match most {
                    Most::Is(most) => put(format_args!("  <Max>{most}</Max>")),
                    Most::Of(limit) => put(format_args!("  <pMax>{limit}</pMax>")),
                }
                put(format_args!("  <Inc>1</Inc>"));
            }
            Kind::Float { least, most, unit } => {
                put(format_args!("  <Min>{least:e}</Min><Max>{most:e}</Max>"));
                if !unit.is_empty() {
                    put(format_args!("  <Unit>{unit}</Unit>"));
                }
            }
            Kind::Boolean => put(format_args!("  <OnValue>1</OnValue><OffValue>0</OffValue>")),
            Kind::Command => put(format_args!("  <CommandValue>1</CommandValue>")),
            Kind::Text | Kind::Choice(_) => {}
        }
        f.selects.iter().for_each(|s| put(format_args!("  <pSelected>{s}</pSelected>")));
        put(format_args!("</{node}>"));
        match f.kind {
            Kind::Float { .. } => {
                put(format_args!("<FloatReg Name=\"{name}_Reg\">{place}<Endianess>LittleEndian</Endianess></FloatReg>"))
            }
            _ => put(format_args!(
                "<IntReg Name=\"{name}_Reg\">{place}<Sign>Signed</Sign><Endianess>LittleEndian</Endianess></IntReg>"
            )),
        }
        let Kind::Choice(choices) = &f.kind else { return };
        for c in *choices {
            if let Some((other, value)) = c.when {
                put(format_args!(
                    "<IntSwissKnife Name=\"{name}_{}_Available\"><pVariable Name=\"X\">{other}_Reg</pVariable>\
                     <Formula>X={value}</Formula></IntSwissKnife>",
                    c.name
                ));
            }
        }
    }
}

/// Names of the standard, and ours.
fn namespace(name: &str) -> &'static str {
    if name.starts_with("Sheetlight") || name == "NewScan" { "Custom" } else { "Standard" }
}

/// A feature that is only read.
pub fn shown(name: &'static str, about: &'static str, kind: Kind) -> Feature {
    Feature { name, about, kind, writable: false, locked: false, selects: &[] }
}

/// A feature that is written at any time.
pub fn free(name: &'static str, about: &'static str, kind: Kind) -> Feature {
    Feature { writable: true, ..shown(name, about, kind) }
}

/// A feature that is written while no acquisition runs.
pub fn set(name: &'static str, about: &'static str, kind: Kind) -> Feature {
    Feature { locked: true, ..free(name, about, kind) }
}

impl Feature {
    pub fn selecting(self, selects: &'static [&'static str]) -> Feature {
        Feature { selects, ..self }
    }
}

/// An integer without narrower limits.
pub const COUNT: Kind = Kind::Integer { least: 0, most: Most::Is(i64::MAX) };
