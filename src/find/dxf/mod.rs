//! In: an ASCII DXF file (LINE, ARC, CIRCLE, ELLIPSE, SPLINE, LWPOLYLINE, POLYLINE, INSERT). Out: a drawing of the
//! part.
//! Frame and unit: part frame, x and y as drawn, z towards the viewer; mm, from the unit that the file or the user
//! states.

use super::dxf::flatten::FLAT;
use super::model::drawing::Drawing;
use super::model::outline::{area, bounds};
use super::model::shape::{Form, Inside};
use crate::fault::{Fault, Result};
mod curves;
mod entity;
mod flatten;
mod loops;
mod shapes;
mod spline;
mod tags;

use curves::{Curve, Form as Drawn};

/// A unit of length of a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// mm, inch, cm, m, um, mil or foot.
    pub name: &'static str,
    /// Its length, mm.
    pub mm: f64,
    /// Its code in $INSUNITS.
    code: i64,
}

const UNITS: &[Unit] = &[
    Unit { name: "mm", mm: 1.0, code: 4 },
    Unit { name: "inch", mm: 25.4, code: 1 },
    Unit { name: "cm", mm: 10.0, code: 5 },
    Unit { name: "m", mm: 1000.0, code: 6 },
    Unit { name: "um", mm: 1e-3, code: 13 },
    Unit { name: "mil", mm: 0.0254, code: 9 },
    Unit { name: "foot", mm: 304.8, code: 2 },
];

impl std::str::FromStr for Unit {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Unit, String> {
        let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
        UNITS.iter().copied().find(|u| u.name == s).ok_or(format!("wanted one of {}", names.join(", ")))
    }
}

/// Largest file that is read, bytes: a larger one is an assembly, not the drawing of a part.
pub const LARGEST: u64 = 64 << 20;

/// What the user states about a drawing.
#[derive(Clone, Debug, Default)]
pub struct DxfOptions {
    /// Required where the file names no unit. It overrides the file's unit: headers are often wrong.
    pub unit: Option<Unit>,
    /// Layers that hold the part's edges, whether switched off or not. Default: all visible layers.
    pub layers: Vec<String>,
    /// The part frame's origin in the drawing, in the drawing's unit. Default: the centre of the largest outline's
    /// bounding box.
    pub origin: Option<[f64; 2]>,
}

/// A drawing that was read.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The part's shapes; part frame, mm.
    pub drawing: Drawing,
    /// Name of the unit that the drawing is in, see [`Unit::name`].
    pub unit: &'static str,
    /// The part frame's origin in the drawing, in the drawing's unit.
    pub origin: [f64; 2],
    /// What was skipped or counted once, in words.
    pub notes: Vec<String>,
    /// What may be a mistake of the drawing, in words.
    pub warnings: Vec<String>,
}

/// Reads a drawing. Refuses a file that is damaged, names no usable unit or has no closed outline.
pub fn read(bytes: &[u8], options: &DxfOptions) -> Result<Imported> {
    let file = tags::read(bytes)?;
    let (unit, doubt) = unit(&file, options.unit)?;
    let read = curves::curves(&file, &options.layers, FLAT / unit.mm)?;
    let mut notes: Vec<String> = read.passed_over.iter().map(|(what, n)| format!("skipped: {n} {what}")).collect();
    let scaled: Vec<Curve> = read.curves.iter().map(|c| moved(c, [0.0; 2], unit.mm)).collect();
    let largest = loops::join(&scaled).loops.into_iter().max_by(|a, b| {
        let size = |l: &loops::Loop| area(&l.points).abs();
        size(a).total_cmp(&size(b))
    });
    let Some(largest) = largest else {
        let chosen = if options.layers.is_empty() { String::new() } else { " on the chosen layers".into() };
        return Err(Fault::input(format!("has no closed outline{chosen}, {} edges were read", read.curves.len()))
            .cause("edges that do not meet within 0.01 mm, the wrong layers, or the wrong unit")
            .next("join the outline's edges in the drawing, or name its layer with --layer"));
    };
    let origin = options.origin.unwrap_or_else(|| match largest.circle {
        Some((centre, _)) => centre.map(|c| c / unit.mm),
        None => {
            let [x0, y0, x1, y1] = bounds(&largest.points);
            [0.5 * (x0 + x1) / unit.mm, 0.5 * (y0 + y1) / unit.mm]
        }
    });
    let placed: Vec<Curve> = read.curves.iter().map(|c| moved(c, origin, unit.mm)).collect();
    let joined = loops::join(&placed);
    if joined.duplicates > 0 {
        notes.push(format!("{} edges are drawn twice and count once", joined.duplicates));
    }
    let mut warnings: Vec<String> = doubt.into_iter().collect();
    if joined.forks > 0 {
        warnings.push(format!("at {} places more than two edges meet: the edges there close no outline", joined.forks));
    }
    for (linetype, n) in &read.broken {
        warnings.push(format!(
            "{n} edges are drawn as {linetype}: centre lines and hidden edges are no edges of the part's top"
        ));
    }
    if read.wide > 0 {
        warnings.push(format!("{} polylines have a width: their middle line was read, not their rims", read.wide));
    }
    if file.clipped > 0 {
        warnings.push(format!("{} inserted blocks are shown in part: they were read whole", file.clipped));
    }
    let shape = shapes::shapes(joined.loops, &joined.open);
    let lines = shape.iter().filter(|s| s.kind == Form::Line && s.inside == Inside::Either).count();
    if lines > 0 {
        warnings.push(format!("{lines} lines close no outline: they are searched, not measured"));
    }
    let drawing = Drawing { shape };
    drawing.check()?;
    Ok(Imported { drawing, unit: unit.name, origin, notes, warnings })
}

/// The drawing's unit, and the reason to doubt it.
fn unit(file: &tags::File, wanted: Option<Unit>) -> Result<(Unit, Option<String>)> {
    let named = file.units.filter(|&code| code != 0);
    let known = named.map(|code| (code, UNITS.iter().copied().find(|u| u.code == code)));
    let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
    match (known, wanted) {
        (Some((_, Some(file))), Some(person)) if file == person => Ok((person, None)),
        (Some((code, file)), Some(person)) => {
            let said = file.map_or_else(|| format!("$INSUNITS {code}"), |u| u.name.to_owned());
            Ok((person, Some(format!("the file says that it is drawn in {said}; --unit {} overrules it", person.name))))
        }
        (Some((_, Some(unit))), None) => Ok((unit, contradicted(unit, file.measurement))),
        (Some((code, None)), None) => {
            Err(Fault::input(format!("its unit is $INSUNITS {code}; known are {}", names.join(", ")))
                .cause("a drawing of something other than a part, or a wrong header")
                .next("scale the drawing to millimetres, or state its unit with --unit"))
        }
        (None, Some(unit)) => Ok((unit, None)),
        (None, None) => Err(Fault::input("names no unit ($INSUNITS is missing or 0)")
            .cause("many programs do not write it, and no unit is guessed")
            .next(format!("state it with --unit, one of {}", names.join(", ")))),
    }
}

/// A warning where an imperial unit meets $MEASUREMENT 1, which is metric. The opposite, 0 with millimetres, is no sign
/// of a mistake: templates leave it in correct drawings.
fn contradicted(unit: Unit, measurement: Option<i64>) -> Option<String> {
    let imperial = ["inch", "mil", "foot"].contains(&unit.name);
    (imperial && measurement == Some(1)).then(|| {
        format!(
            "the file says that it is drawn in {0} ($INSUNITS) and that it is metric ($MEASUREMENT 1): one of them is \
             wrong; {0} was taken, --unit mm overrules it",
            unit.name
        )
    })
}

fn moved(c: &Curve, origin: [f64; 2], mm: f64) -> Curve {
    let at = |p: &[f64; 2]| [(p[0] - origin[0]) * mm, (p[1] - origin[1]) * mm];
    let form = match &c.form {
        Drawn::Circle { centre, radius } => Drawn::Circle { centre: at(centre), radius: radius * mm },
        Drawn::Path { points, closed } => Drawn::Path { points: points.iter().map(at).collect(), closed: *closed },
    };
    Curve { layer: c.layer.clone(), z: c.z * mm, form }
}
