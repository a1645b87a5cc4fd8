//! In: where each picture shows the bed's stripe, and its heights. Out: the name of a picture that is mirrored or
//! turned among the others; remarks on pictures that do not go together.
//! Frame and unit: pixels; heights above the bed, mm.

use super::plateau::spread;
use crate::fault::{Fault, Result};
use crate::scan::CloudPoint;

/// The bed's stripe of one picture: its column at row 0 and its slope.
pub type Line = (f64, f64);

/// Deviation from the neighbouring pictures that is noted, px at least. Camera and laser stand still, so only the
/// bed's unevenness remains.
const JUMP: f64 = 10.0;
/// A mirrored line is recognised if it lies this close to the other pictures' lines, px.
const CLOSE: f64 = 3.0;
/// Pictures on either side whose median a line is compared with. Up to four pictures in a row may be wrong.
const NEIGHBOURS: usize = 5;
/// Least number of points below the bed that are noted, and their depth, mm.
const BELOW: usize = 20;
const DEPTH: f64 = 1.0;

/// Refuses a picture whose stripe fits the others only when it is mirrored or turned by 180 degrees, and notes
/// pictures whose bed lies elsewhere. `rows` are the first and last row of the bed, `size` that of the pictures.
pub fn beds(lines: &[(String, Option<Line>)], rows: [f64; 2], size: [u32; 2]) -> Result<Option<String>> {
    let [width, height] = size.map(|s| f64::from(s) - 1.0);
    let ends = |(u0, slope): Line| rows.map(|v| u0 + slope * v);
    let seen: Vec<(&String, Line)> = lines.iter().filter_map(|(n, l)| Some((n, (*l)?))).collect();
    let usual = |i: usize| {
        let near = &seen[i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(seen.len())];
        [0, 1].map(|k| spread(&near.iter().map(|(_, l)| ends(*l)[k]).collect::<Vec<_>>()).0)
    };
    let off = |line: Line, usual: [f64; 2]| {
        let ends = ends(line);
        (ends[0] - usual[0]).abs().max((ends[1] - usual[1]).abs())
    };
    let mut moved = Vec::new();
    for (i, &(name, line)) in seen.iter().enumerate() {
        let (u0, slope) = line;
        let usual = usual(i);
        let far = off(line, usual);
        if seen.len() < 2 * NEIGHBOURS || far <= JUMP {
            continue;
        }
        let turned =
            [("mirrored", (width - u0, -slope)), ("turned by 180 degrees", (width - u0 - slope * height, slope))];
        if let Some((how, _)) = turned.into_iter().find(|(_, line)| off(*line, usual) < CLOSE) {
            return Err(Fault::input(format!(
                "{name}: shows the bed's stripe {far:.0} px from the pictures beside it, limit {JUMP}; {how} it would \
                 lie within {CLOSE} px"
            ))
            .cause("some pictures were turned or mirrored by a program, or by the camera's orientation sensor")
            .next("save all pictures as the camera took them"));
        }
        moved.push((name, far));
    }
    let most = moved.iter().fold(0.0, |m: f64, (_, far)| m.max(*far));
    Ok(moved.first().map(|(name, _)| {
        format!(
            "{} pictures show the bed's stripe up to {most:.0} px from the pictures beside them, the first is {name}: \
             the camera was moved, or they are pictures of another scan",
            moved.len()
        )
    }))
}

/// A remark on pictures that show more below the bed than above it. `off_bed` are the points outside the bed's rows.
pub fn below(off_bed: &[CloudPoint], names: &[String]) -> Option<String> {
    let mut counts = vec![[0usize; 2]; names.len()];
    let mut deepest = 0f64;
    for p in off_bed {
        let z = f64::from(p.position[2]);
        if z.abs() > DEPTH
            && let Some(count) = counts.get_mut(p.shot as usize)
        {
            count[usize::from(z > 0.0)] += 1;
            deepest = deepest.min(z);
        }
    }
    let low = |[below, above]: &[usize; 2]| *below >= BELOW && below > above;
    let first = counts.iter().position(low)?;
    Some(format!(
        "{} of {} pictures show more below the bed than above it (deepest {deepest:.1} mm), the first is {}: \
         --raises is the other side, or they are turned or mirrored; a hollow in the bed looks alike",
        counts.iter().filter(|c| low(c)).count(),
        names.len(),
        names[first]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(change: impl Fn(usize, Line) -> Line) -> Vec<(String, Option<Line>)> {
        let line = |i: usize| (240.0 - 0.4 * i as f64, 0.01);
        (0..20).map(|i| (format!("f{i}.png"), (i != 3).then(|| change(i, line(i))))).collect()
    }

    #[test]
    fn a_turned_picture_is_refused_and_a_moved_one_noted() {
        let judge = |lines: &[_]| beds(lines, [5.0, 290.0], [400, 300]);
        assert_eq!(judge(&lines(|_, l| l)).unwrap(), None);
        let odd = |i: usize| (7..10).contains(&i);
        let mirrored = lines(|i, (u, s)| if odd(i) { (399.0 - u, -s) } else { (u, s) });
        let fault = judge(&mirrored).unwrap_err();
        assert!(fault.what.contains("f7.png") && fault.what.contains("mirrored it would"), "{fault}");
        let turned = lines(|i, (u, s)| if odd(i) { (399.0 - u - s * 299.0, s) } else { (u, s) });
        assert!(judge(&turned).unwrap_err().what.contains("turned by 180 degrees it would"));
        let moved = lines(|i, (u, s)| if odd(i) { (u + 15.0, s) } else { (u, s) });
        let said = judge(&moved).unwrap().unwrap();
        assert!(said.contains("3 pictures") && said.contains("the first is f7.png"), "{said}");
    }

    #[test]
    fn pictures_below_the_bed_are_noted() {
        let point = |shot: u32, z: f32| CloudPoint { position: [0.0, 0.0, z].into(), shot, ..CloudPoint::default() };
        let names = ["a", "b"].map(str::to_owned);
        let mut points: Vec<_> = (0..30).map(|_| point(0, 4.0)).collect();
        points.extend((0..25).map(|_| point(0, -4.0)));
        assert_eq!(below(&points, &names), None);
        points.extend((0..25).map(|_| point(1, -3.5)));
        let said = below(&points, &names).unwrap();
        assert!(said.contains("1 of 2") && said.contains("the first is b"), "{said}");
    }
}
