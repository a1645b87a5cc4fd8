//! In: text with sequences of numbers in brackets, as JSON, YAML and cv::FileStorage write vectors, or with one
//! profile per line. Out: profiles. Numbers in one row can alternate x and z or give all x first: the second order is
//! detected and refused.
//! Frame and unit: the sensor's own plane, mm.

use super::profile::Profile;
use crate::fault::{Fault, Result};

/// A bracket that contains no other bracket: the key before it, its enclosing bracket, its numbers.
struct Sequence {
    key: String,
    parent: usize,
    numbers: Vec<f64>,
}

/// Profiles from brackets: adjacent pairs `[x, z]` form one profile. A longer sequence is a separate profile in which
/// x and z alternate.
pub fn from_brackets(text: &str, stem: &str) -> Result<Vec<Profile>> {
    let mut out: Vec<Profile> = Vec::new();
    let mut open: Option<(usize, String)> = None;
    for s in sequences(text)? {
        let group = (s.parent, s.key.clone());
        let named = |n: usize| if s.key.is_empty() { format!("{stem} {n}") } else { format!("{stem} {} {n}", s.key) };
        if s.numbers.len() == 2 {
            if open.as_ref() != Some(&group) {
                out.push(Profile { name: named(out.len()), points: Vec::new() });
            }
            out.last_mut().expect("pushed above").points.push([s.numbers[0], s.numbers[1]]);
            open = Some(group);
        } else {
            out.push(Profile { name: named(out.len()), points: by_turns(&s.numbers, &named(out.len()))? });
            open = None;
        }
    }
    if out.is_empty() {
        return Err(Fault::input("holds no sequence of numbers in brackets")
            .cause("another kind of file")
            .next("write each profile as [x, z, x, z, ...] or [[x, z], [x, z], ...] in mm"));
    }
    Ok(out)
}

/// The profile of a row of numbers in which x and z alternate. Refused: an odd count, and numbers that form a smooth
/// curve only if all x come before all z.
pub fn by_turns(numbers: &[f64], name: &str) -> Result<Vec<[f64; 2]>> {
    let refuse = |what: String| {
        Fault::input(format!("{name}: {what}"))
            .cause("a plain sequence is read as x, z, x, z, ... in mm")
            .next("write x and z by turns, or as pairs [x, z], or with a header 'profile,x,z'")
    };
    if numbers.len() < 6 || !numbers.len().is_multiple_of(2) {
        return Err(refuse(format!("{} numbers in a row, an even count of 6 or more is a profile", numbers.len())));
    }
    let points: Vec<[f64; 2]> = numbers.chunks(2).map(|c| [c[0], c[1]]).collect();
    // Sum of the steps between neighbouring points: the correct reading is the smooth one.
    let jumps = |at: &dyn Fn(usize) -> [f64; 2]| -> f64 {
        let steps = (1..points.len()).map(|i| (at(i)[0] - at(i - 1)[0]).abs() + (at(i)[1] - at(i - 1)[1]).abs());
        steps.filter(|s| s.is_finite()).sum()
    };
    let apart = jumps(&|i| [numbers[i], numbers[points.len() + i]]);
    let turns = jumps(&|i| points[i]);
    if turns > 4.0 * apart {
        return Err(refuse(format!(
            "the numbers jump by {turns:.0} mm in all when read by turns, and by {apart:.0} mm with all x before all z"
        )));
    }
    Ok(points)
}

fn sequences(text: &str) -> Result<Vec<Sequence>> {
    let mut out = Vec::new();
    // Open brackets: their number, and whether they contain a bracket.
    let mut stack: Vec<(usize, bool)> = Vec::new();
    let (mut count, mut key, mut numbers) = (0, String::new(), Vec::new());
    for (at, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let bad = |what: &str| {
            Fault::input(format!("line {}: {what}", at + 1))
                .cause("not a list of numbers in brackets")
                .next("write each profile as [x, z, x, z, ...] or [[x, z], [x, z], ...] in mm")
        };
        let spaced = line.replace('[', " [ ").replace(']', " ] ").replace([',', '{', '}', '"', '\''], " ");
        for token in spaced.split_whitespace() {
            match token {
                "[" => {
                    if let Some(last) = stack.last_mut() {
                        last.1 = true;
                    }
                    count += 1;
                    stack.push((count, false));
                    numbers.clear();
                }
                "]" => {
                    let (_, nested) = stack.pop().ok_or_else(|| bad("a bracket closes that was never opened"))?;
                    if !nested && !numbers.is_empty() {
                        let parent = stack.last().map_or(0, |p| p.0);
                        out.push(Sequence { key: key.clone(), parent, numbers: std::mem::take(&mut numbers) });
                    }
                }
                word if stack.is_empty() => {
                    if word.len() > 1 && word.ends_with(':') {
                        key = word.trim_end_matches(':').to_owned();
                    }
                }
                number => numbers.push(value(number).ok_or_else(|| bad(&format!("'{number}' is not a number")))?),
            }
        }
    }
    if stack.is_empty() {
        Ok(out)
    } else {
        Err(Fault::input("ends inside a bracket").cause("a truncated file").next("export the profiles again"))
    }
}

/// A number in YAML or JSON notation; a missing measurement becomes a value that is not finite.
pub fn value(text: &str) -> Option<f64> {
    match text.trim_start_matches('+').to_lowercase().as_str() {
        ".nan" | "nan" | "null" => Some(f64::NAN),
        ".inf" | "-.inf" => Some(f64::INFINITY),
        other => other.trim_end_matches('.').parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_sequence_gives_the_same_points() {
        let want = vec![[1.0, 10.0], [2.0, 11.5], [3.0, 12.0]];
        for text in [
            "%YAML:1.0\n---\npoints: [ 1., 10., 2., 1.15e+01,\n    3., 12. ]\n",
            "points:\n   - [ 1., 10. ]\n   - [ 2., 11.5 ]\n   - [ 3., 12., ]\n",
            "[[1, 10], [2, 11.5], [null, 3], [3, 12]]",
            "{\"profiles\": [[1, 10, 2, 11.5, 3, 12]]}",
        ] {
            let p = from_brackets(text, "a").unwrap();
            let points: Vec<_> = p[0].points.iter().copied().filter(super::super::measured).collect();
            assert_eq!((p.len(), points), (1, want.clone()), "{text}");
            assert_eq!(p[0].points.len(), if text.contains("null") { 4 } else { 3 }, "{text}");
        }
        let two = "p0: [ [1, 10], [2, 11.5], [3, 12] ]\np1: [ [4, 5], [5, 6] ]";
        let p = from_brackets(two, "a").unwrap();
        assert_eq!((p.len(), &p[0].points, p[1].points[1]), (2, &want, [5.0, 6.0]));
        assert_eq!(p[1].name, "a p1 1");
        let nested = "[[[1, 10], [2, 11.5], [3, 12]], [[4, 5], [5, 6]]]";
        assert_eq!(from_brackets(nested, "a").unwrap().len(), 2);
    }

    #[test]
    fn what_is_no_row_of_points_is_refused() {
        let rows: Vec<f64> = (0..40).map(f64::from).chain((0..40).map(|k| 150.0 + 0.1 * f64::from(k))).collect();
        assert!(by_turns(&rows, "a").unwrap_err().what.contains("all x before all z"));
        assert!(by_turns(&rows[..7], "a").unwrap_err().what.contains("7 numbers"));
        assert!(from_brackets("a: [1, b]", "a").is_err() && from_brackets("a: [1, 2", "a").is_err());
        assert!(from_brackets("nothing: 3", "a").is_err());
    }
}
