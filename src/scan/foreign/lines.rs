//! Converts a foreign file, with what its user states about it, into a cloud of lines, as if a scan had made a shot
//! of each line. Positions are in the file's own frame, mm. In a height picture x runs along the columns and z
//! points towards the sensor. y makes the frame right-handed: it runs against the rows of a picture that is seen
//! from the sensor.

use super::missing;
use super::raw::Raw;
use super::stated::Stated;
use crate::fault::{Fault, Result};
use crate::raster::{Kind, Says};
use crate::scan::CloudPoint;

/// The cloud, with remarks on its conversion.
#[derive(Clone, Debug)]
pub struct Lines {
    /// Points line by line; `shot` is the line's index, `u` the index within the line.
    pub points: Vec<CloudPoint>,
    /// Standard deviation that every point carries, mm.
    pub sigma_mm: f64,
    /// Number of lines, and of positions in the longest one.
    pub size: [usize; 2],
    /// What was done to the data, a sentence each.
    pub notes: Vec<String>,
}

/// Most positions of a line that `find` accepts.
const MOST_PLACES: usize = 1 << 17;
/// Largest coordinate, mm: beyond it f32 cannot resolve hundredths.
const FARTHEST_MM: f64 = 1e5;
/// Smallest and largest unit of a file, mm: a nanometre, a kilometre.
const UNITS_MM: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// With fewer neighbours the scatter of the heights cannot be estimated.
const NEEDED: usize = 30;

/// Makes lines of points. `light` holds brightness levels for a height picture of the same size.
///
/// # Errors
/// A value that must be stated and is not, numbers out of all proportion, no measured point.
pub fn lines(raw: &Raw, light: Option<&Raw>, stated: &Stated) -> Result<Lines> {
    let unit = stated.unit_mm.ok_or_else(|| {
        Fault::usage("the unit of the heights is not stated")
            .cause("files hold numbers, not millimetres")
            .next("give --unit-mm: mm in one level of a picture, or in one unit of a cloud (1 for mm, 1000 for m)")
    })?;
    if !UNITS_MM.contains(&unit) {
        return Err(Fault::usage(format!(
            "the unit is {unit} mm; allowed: {} to {}",
            UNITS_MM.start(),
            UNITS_MM.end()
        ))
        .next("correct --unit-mm"));
    }
    if let Some(wrong) = stated.spacing_mm.iter().flatten().find(|v| !UNITS_MM.contains(v)) {
        let (least, most) = (UNITS_MM.start(), UNITS_MM.end());
        return Err(
            Fault::usage(format!("a spacing of {wrong:e} mm; allowed: {least} to {most}")).next("correct --spacing-mm")
        );
    }
    if !(stated.offset_mm.abs() <= FARTHEST_MM) || stated.sigma_mm.is_some_and(|s| !(s > 0.0 && s < 100.0)) {
        return Err(Fault::usage("offset or sigma out of range")
            .cause("the offset is at most 100000 mm, sigma above 0 and below 100 mm")
            .next("correct --offset-mm or --sigma-mm"));
    }
    let mut notes = Vec::new();
    let placed = match raw {
        Raw::Picture { width, height, levels, kind, says } => {
            let pixels = Pixels { size: [*width, *height], levels, kind: *kind, says };
            picture(&pixels, light, unit, stated, &mut notes)?
        }
        Raw::Points { line, points, intensity, unit: said } => {
            for_pictures_only(light, stated)?;
            notes.extend(other_unit(said.as_ref(), unit, "coordinates"));
            let there = missing::of_cloud(stated, points, &mut notes);
            let heights = points.iter().filter(|p| there(p)).map(|p| p[2]);
            missing::suspects(stated, heights, "points", &mut notes);
            match line {
                Some(line) => {
                    if stated.spacing_mm.is_some() {
                        notes.push("the cloud has lines of its own: --spacing-mm was not needed".into());
                    }
                    organised(*line, points, intensity.as_deref(), unit, there)
                }
                None => scattered(points, intensity.as_deref(), unit, stated, &mut notes, there)?,
            }
        }
    };
    finish(placed, stated, notes)
}

/// A point with the index of its line and its index in the line.
type Placed = (u32, u32, [f64; 3], f32);

/// A picture of heights.
struct Pixels<'a> {
    size: [usize; 2],
    levels: &'a [f64],
    kind: Kind,
    says: &'a Says,
}

/// Refuses options for pictures that would have no effect on a cloud.
fn for_pictures_only(light: Option<&Raw>, stated: &Stated) -> Result<()> {
    let option = match () {
        () if light.is_some() => "--light",
        () if stated.rows_up => "--rows-up",
        () if stated.offset_mm != 0.0 => "--offset-mm",
        () => return Ok(()),
    };
    Err(Fault::usage(format!("{option} is of a picture of heights, the file is a cloud"))
        .cause("the points of a cloud carry their own coordinates and intensity")
        .next(format!("leave {option} out")))
}

fn picture(
    pixels: &Pixels,
    light: Option<&Raw>,
    unit: f64,
    stated: &Stated,
    notes: &mut Vec<String>,
) -> Result<Vec<Placed>> {
    let Pixels { size: [width, height], levels, kind, says } = *pixels;
    let [dx, dy] = stated.spacing_mm.ok_or_else(|| {
        Fault::usage("the distance of columns and rows is not stated")
            .cause("a picture of heights does not say how large its pixels are")
            .next("give --spacing-mm X,Y")
    })?;
    said(says, [dx, dy], stated, notes);
    notes.extend(other_unit(says.unit.as_ref(), unit, "heights"));
    let missing = missing::of_picture(stated, says, kind, levels, notes)?;
    let light = light.map(|light| brightness(light, [width, height], notes)).transpose()?;
    let sign = if stated.rows_up { 1.0 } else { -1.0 };
    notes.push(format!(
        "frame 'map': origin at the first pixel, x along the columns, y {} the rows, z up",
        if stated.rows_up { "along" } else { "against" }
    ));
    let there = |v: f64| v.is_finite() && !missing.iter().any(|level| kind.same(v, *level));
    let seen = levels.iter().enumerate().filter(|(_, v)| there(**v));
    missing::suspects(stated, seen.clone().map(|(_, v)| *v), "pixels", notes);
    let [factor, offset] = says.scale.unwrap_or([1.0, 0.0]);
    let at = |i: usize, v: f64| {
        let (x, y) = (i % width, i / width);
        let place = [x as f64 * dx, sign * y as f64 * dy, stated.offset_mm + unit * (factor * v + offset)];
        (y as u32, x as u32, place, light.as_ref().map_or(1.0, |l| l[i]))
    };
    Ok(seen.map(|(i, v)| at(i, *v)).collect())
}

/// A note on a unit that the file states and that is not the one of --unit-mm.
fn other_unit(said: Option<&(f64, String)>, unit: f64, of: &str) -> Option<String> {
    let (mm, by) = said.filter(|(mm, _)| (mm / unit - 1.0).abs() > 0.01)?;
    Some(format!(
        "the file says that its {of} are in {by}, which is --unit-mm {mm}; --unit-mm {unit} is used, as stated"
    ))
}

/// Notes what the file states about itself, as far as it matters to the user.
fn said(says: &Says, [dx, dy]: [f64; 2], stated: &Stated, notes: &mut Vec<String>) {
    notes.extend(says.notes.iter().cloned());
    if says.white_is_zero {
        notes.push(
            "the file says that 0 is white (PhotometricInterpretation, tag 262), which is how to show it: the levels \
             were taken as heights as they are written"
                .into(),
        );
    }
    if says.orientation.is_some() && stated.rows_up {
        notes.push(
            "the file's orientation was applied, and --rows-up in addition: omit --rows-up if it was meant to apply \
             that orientation"
                .into(),
        );
    }
    let differs = |s: &&([f64; 2], String)| (s.0[0] / dx - 1.0).abs() > 0.01 || (s.0[1] / dy - 1.0).abs() > 0.01;
    if let Some(([x, y], by)) = says.spacing.as_ref().filter(differs) {
        notes.push(format!(
            "the file says that its pixels are {x} x {y} apart, in {by}; {dx} x {dy} mm are used, as stated"
        ));
    }
}

/// The levels of an intensity picture: larger is brighter, 0 where the intensity is unknown.
fn brightness(light: &Raw, [width, height]: [usize; 2], notes: &mut Vec<String>) -> Result<Vec<f32>> {
    let another = |is: String| {
        Err(Fault::input(format!("the picture of the light (--light) is {is}, the heights are {width}x{height}"))
            .cause("it belongs to another map")
            .next("give the picture that was taken with the heights"))
    };
    let (levels, kind, says) = match light {
        Raw::Picture { width: w, height: h, levels, kind, says } if (*w, *h) == (width, height) => (levels, kind, says),
        Raw::Picture { width, height, .. } => return another(format!("{width}x{height}")),
        Raw::Points { .. } => return another("a cloud".into()),
    };
    let most = match (says.white_is_zero, kind.most()) {
        (false, _) => None,
        (true, Some(most)) => Some(most),
        (true, None) => {
            return Err(Fault::input(
                "the picture of the light says that 0 is white (PhotometricInterpretation, tag 262)",
            )
            .cause("numbers with a sign or a point do not say which of them is black")
            .next("save it with 0 as black"));
        }
    };
    let known = |v: f64| !says.missing.is_some_and(|level| kind.same(v, level));
    let level = |v: &f64| if known(*v) { most.map_or(*v, |most| most - *v) as f32 } else { f32::NAN };
    let mut levels: Vec<f32> = levels.iter().map(level).collect();
    let unknown = levels.iter().filter(|v| !v.is_finite()).count();
    if unknown > 0 {
        notes.push(format!("{unknown} pixels of the picture of the light hold no level: theirs is taken as 0"));
        levels.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    }
    let below = levels.iter().filter(|v| **v < 0.0).count();
    if below > 0 {
        notes.push(format!("{below} pixels of the picture of the light are below 0: they count as black in the map"));
    }
    Ok(levels)
}

fn organised(
    line: usize,
    points: &[[f64; 3]],
    light: Option<&[f32]>,
    unit: f64,
    there: impl Fn(&[f64; 3]) -> bool,
) -> Vec<Placed> {
    let at = |(i, p): (usize, &[f64; 3])| {
        let level = light.map_or(1.0, |l| l[i]);
        ((i / line) as u32, (i % line) as u32, p.map(|v| unit * v), level)
    };
    points.iter().enumerate().filter(|(_, p)| there(p)).map(at).collect()
}

fn scattered(
    points: &[[f64; 3]],
    light: Option<&[f32]>,
    unit: f64,
    stated: &Stated,
    notes: &mut Vec<String>,
    there: impl Fn(&[f64; 3]) -> bool,
) -> Result<Vec<Placed>> {
    let [dx, dy] = stated.spacing_mm.ok_or_else(|| {
        Fault::usage("the distance of the points is not stated")
            .cause("the file has points in no order; they are put in lines along x, one every Y mm")
            .next("give --spacing-mm X,Y: the distance along a line, and of the lines")
    })?;
    let seen = points.iter().enumerate().filter(|(_, p)| there(p));
    let low = seen.clone().fold([f64::MAX; 2], |m, (_, p)| [m[0].min(unit * p[0]), m[1].min(unit * p[1])]);
    notes.push(format!("points in no order were put in lines along x, {dy} mm apart, {dx} mm from point to point"));
    let mut out = Vec::with_capacity(points.len());
    for (i, p) in seen {
        let p = p.map(|v| unit * v);
        let (column, line) = (((p[0] - low[0]) / dx).round(), ((p[1] - low[1]) / dy).round());
        if column.max(line) >= MOST_PLACES as f64 {
            return Err(Fault::refused(format!(
                "the points reach over more than {MOST_PLACES} places of {dx} x {dy} mm"
            ))
            .cause("a wrong unit or spacing, or a stray point")
            .next("correct --unit-mm or --spacing-mm, or take stray points out"));
        }
        out.push((line as u32, column as u32, p, light.map_or(1.0, |l| l[i])));
    }
    Ok(out)
}

fn finish(mut placed: Vec<Placed>, stated: &Stated, mut notes: Vec<String>) -> Result<Lines> {
    if placed.is_empty() {
        return Err(Fault::refused("no point was measured anywhere in the file")
            .cause("an empty map, or every level is the missing one")
            .next("look at the file, and at --missing"));
    }
    if let Some(p) = placed.iter().map(|p| p.2).find(|p| p.iter().any(|v| !(v.abs() <= FARTHEST_MM))) {
        return Err(Fault::refused(format!(
            "a point lies at {:.0}, {:.0}, {:.0} mm, limit {FARTHEST_MM}",
            p[0], p[1], p[2]
        ))
        .cause("a wrong unit, or coordinates of a map of the land")
        .next("correct --unit-mm, or move the points near their origin"));
    }
    if placed.iter().any(|p| p.1 as usize >= MOST_PLACES) {
        return Err(Fault::refused(format!("a line has more than {MOST_PLACES} places"))
            .cause("no sensor is so wide")
            .next("cut out the part that is to be searched"));
    }
    // Lines ascend, and indices ascend in them. If two points fall on one index, both stay in the cloud.
    placed.sort_by_key(|p| (p.0, p.1));
    let sigma_mm = match stated.sigma_mm {
        Some(s) => s,
        None => {
            let s = scatter(&placed)?;
            notes.push(format!("sigma of a height measured from neighbours in a line: {s:.4} mm"));
            s
        }
    };
    let size = [0, 1].map(|k| placed.iter().map(|p| if k == 0 { p.0 } else { p.1 }).max().unwrap_or(0) as usize + 1);
    let point = |&(line, place, p, light): &Placed| CloudPoint {
        position: glam::DVec3::from_array(p).as_vec3(),
        sigma_mm: sigma_mm as f32,
        intensity: if light.is_finite() { light } else { 0.0 },
        quality: 1.0,
        shot: line,
        u: place as f32,
        v: 0.0,
    };
    Ok(Lines { points: placed.iter().map(point).collect(), sigma_mm, size, notes })
}

/// Robust standard deviation of one height. Of three neighbours in a line, the middle one deviates from the mean of
/// the others by sqrt(3/2) sigma; slopes cancel.
fn scatter(placed: &[Placed]) -> Result<f64> {
    let neighbours = |w: &&[Placed]| w[0].0 == w[2].0 && w[1].1 == w[0].1 + 1 && w[2].1 == w[0].1 + 2;
    let bend = |w: &[Placed]| (w[1].2[2] - 0.5 * (w[0].2[2] + w[2].2[2])).abs();
    let mut bends: Vec<f64> = placed.windows(3).filter(neighbours).map(bend).collect();
    if bends.len() < NEEDED {
        return Err(Fault::refused(format!(
            "{} places have neighbours on both sides, {NEEDED} are needed",
            bends.len()
        ))
        .cause("a spacing that is finer than the points lie, or next to nothing measured")
        .next("correct --spacing-mm, or state --sigma-mm"));
    }
    let middle = bends.len() / 2;
    let median = *bends.select_nth_unstable_by(middle, f64::total_cmp).1;
    // Never finer than 0.1 µm, the resolution to which heights are stored.
    Ok((1.4826 * median / 1.5f64.sqrt()).max(1e-4))
}
