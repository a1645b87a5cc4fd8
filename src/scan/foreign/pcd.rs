//! Reads a PCD (Point Cloud Library): text, binary or compressed. Its points come in lines if it is organised.

use super::fields::{Number, Points, Wanted, surplus};
use super::raw::{MOST_POINTS, Raw, unit_in};
use crate::fault::{Fault, Result};

/// Longest header, bytes.
const MOST_HEADER: usize = 16 << 10;

fn strange(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("is not a PCD that can be read: {what}"))
        .cause("a damaged file, or one without x, y and z")
        .next("write the cloud again with the Point Cloud Library, or export it as PLY")
}

/// Whether a file begins like a PCD, comments ignored.
pub(super) fn begins(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    let mut lines = head.split(|&b| b == b'\n').skip_while(|l| l.starts_with(b"#") || l.trim_ascii().is_empty());
    let key = |l: &[u8], key: &[u8]| l.get(..key.len()).is_some_and(|k| k.eq_ignore_ascii_case(key));
    lines.next().is_some_and(|l| key(l, b"VERSION") || key(l, b"FIELDS"))
}

#[derive(Default)]
struct Header {
    names: Vec<String>,
    /// Bytes of one number of each field.
    sizes: Vec<usize>,
    /// Number type of each field; `None` for types that are known by their size alone.
    numbers: Vec<Option<Number>>,
    counts: Vec<usize>,
    width: usize,
    height: usize,
    points: usize,
    data: String,
    /// mm in the unit that a comment states, and that comment.
    unit: Option<(f64, String)>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let (h, start) = header(bytes)?;
    let wanted = Wanted::among(h.names.iter().map(String::as_str)).map_err(strange)?;
    let body = &bytes[start..];
    let mut found = Points::default();
    if let Some(k) = wanted.xyz.into_iter().chain(wanted.light).find(|k| h.numbers[*k].is_none()) {
        return Err(strange(format!("its field {} is of {} bytes and no known type", h.names[k], h.sizes[k])));
    }
    if let Some(k) = wanted.xyz.into_iter().chain(wanted.light).find(|k| h.counts[*k] != 1) {
        return Err(strange(format!("its field {} has {} numbers a point (COUNT)", h.names[k], h.counts[k])));
    }
    let number = |k: usize, bytes: &[u8]| h.numbers[k].map_or(f64::NAN, |n| n.read(bytes, false));
    let each: Vec<usize> = h.sizes.iter().zip(&h.counts).map(|(n, c)| n * c).collect();
    let starts = |sizes: &[usize]| -> Vec<usize> {
        sizes.iter().scan(0usize, |at, n| Some(std::mem::replace(at, *at + n))).collect()
    };
    let record: usize = each.iter().sum();
    let whole = h.points.saturating_mul(record);
    match h.data.as_str() {
        "ascii" => {
            let text = std::str::from_utf8(body).map_err(strange)?;
            let columns = starts(&h.counts);
            let wanted = Wanted { xyz: wanted.xyz.map(|k| columns[k]), light: wanted.light.map(|k| columns[k]) };
            let mut records = text.lines().filter(|l| !l.trim().is_empty());
            let mut words = Vec::new();
            for k in 0..h.points {
                words.clear();
                words.extend(records.next().unwrap_or("").split_ascii_whitespace());
                if !found.take_text(&wanted, &words) {
                    return Err(strange(format!("point {k} of {} is missing or no numbers", h.points)));
                }
            }
            let more = records.count();
            if more > 0 {
                return Err(surplus(h.points + more, h.points));
            }
        }
        "binary" => {
            let offsets = starts(&each);
            let more = body.len().saturating_sub(whole) / record;
            if more > 0 {
                return Err(surplus(h.points + more, h.points));
            }
            let body = body.get(..whole).ok_or_else(|| strange(format!("it ends before its {} points", h.points)))?;
            for r in body.chunks_exact(record) {
                found.take(&wanted, |k| number(k, &r[offsets[k]..]));
            }
        }
        "binary_compressed" => {
            let length = |at: usize| body.get(at..at + 4).map(|b| Number::U32.read(b, false) as usize);
            let (Some(packed), Some(unpacked)) = (length(0), length(4)) else {
                return Err(strange("it ends in its header"));
            };
            let packed = body.get(8..packed.saturating_add(8)).ok_or_else(|| strange("it ends before its points"))?;
            if unpacked != whole {
                return Err(strange(format!("it unpacks to {unpacked} bytes, its points have {whole}")));
            }
            let body = unpack(packed, whole).ok_or_else(|| strange("its compressed points are damaged"))?;
            // Field by field: all x, then all y, ...
            let columns: Vec<usize> = starts(&each).iter().map(|s| s * h.points).collect();
            for i in 0..h.points {
                found.take(&wanted, |k| number(k, &body[columns[k] + i * each[k]..]));
            }
        }
        other => return Err(strange(format!("its data are '{other}'"))),
    }
    let (points, intensity) = found.intensity();
    Ok(Raw::Points { line: (h.height > 1).then_some(h.width), points, intensity, unit: h.unit })
}

fn header(bytes: &[u8]) -> Result<(Header, usize)> {
    let mut h = Header::default();
    let mut kinds = String::new();
    let mut at = 0;
    while h.data.is_empty() {
        let rest = &bytes[at..bytes.len().min(MOST_HEADER)];
        let end = rest.iter().position(|&b| b == b'\n').ok_or_else(|| strange("its header has no end"))?;
        let line = std::str::from_utf8(&rest[..end]).map_err(strange)?;
        at += end + 1;
        let mut words = line.split_ascii_whitespace();
        let key = words.next().unwrap_or("").to_ascii_uppercase();
        let count = |words: &mut std::str::SplitAsciiWhitespace| {
            let n = words.next().and_then(|w| w.parse().ok()).filter(|&n| n <= MOST_POINTS);
            n.ok_or_else(|| strange(format!("'{line}', limit {MOST_POINTS}")))
        };
        match key.as_str() {
            "FIELDS" => h.names = words.map(str::to_owned).collect(),
            "SIZE" => h.sizes = words.map(|w| w.parse().unwrap_or(0)).collect(),
            "TYPE" => kinds = words.collect::<String>().to_ascii_uppercase(),
            "VIEWPOINT" => viewed(&words.collect::<Vec<_>>())?,
            "COUNT" => h.counts = words.map(|w| w.parse().unwrap_or(0)).collect(),
            "WIDTH" => h.width = count(&mut words)?,
            "HEIGHT" => h.height = count(&mut words)?,
            "POINTS" => h.points = count(&mut words)?,
            "DATA" => h.data = words.next().unwrap_or("nothing").to_owned(),
            _ if key.starts_with('#') => h.unit = h.unit.or_else(|| unit_in(line.trim_start_matches(['#', ' ']))),
            _ => {}
        }
    }
    if h.counts.is_empty() {
        h.counts = vec![1; h.names.len()];
    }
    h.numbers = h.sizes.iter().zip(kinds.chars()).map(|(s, k)| number(k, *s)).collect();
    let n = h.names.len();
    let sound = |v: &[usize], most: usize| v.len() == n && v.iter().all(|c| (1..=most).contains(c));
    if kinds.len() != n || !sound(&h.sizes, 16) || !sound(&h.counts, 4096) {
        return Err(strange("FIELDS, SIZE, TYPE and COUNT do not go together"));
    }
    if h.width.saturating_mul(h.height) != h.points {
        return Err(strange(format!("it has {} points in {} lines of {}", h.points, h.height, h.width)));
    }
    Ok((h, at))
}

/// Checks the sensor's pose. Programs disagree on whether the points are already transformed by it, so it must be
/// the origin.
fn viewed(words: &[&str]) -> Result<()> {
    let numbers: Vec<f64> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let none = numbers.iter().all(|v| *v == 0.0);
    match numbers[..] {
        [x, y, z, w, i, j, k] if [x, y, z, i, j, k] == [0.0; 6] && (w.abs() == 1.0 || none) => Ok(()),
        _ => Err(Fault::input(format!("states the sensor's pose VIEWPOINT {}", words.join(" ")))
            .cause("some programs move the points there, others do not, and the file does not state which")
            .next("move the points and write the cloud with VIEWPOINT 0 0 0 1 0 0 0")),
    }
}

fn number(kind: char, size: usize) -> Option<Number> {
    Some(match (kind, size) {
        ('I', 1) => Number::I8,
        ('U', 1) => Number::U8,
        ('I', 2) => Number::I16,
        ('U', 2) => Number::U16,
        ('I', 4) => Number::I32,
        ('U', 4) => Number::U32,
        ('I', 8) => Number::I64,
        ('U', 8) => Number::U64,
        ('F', 4) => Number::F32,
        ('F', 8) => Number::F64,
        _ => return None,
    })
}

/// LZF: a control byte c below 32 is followed by c + 1 literal bytes. Other control bytes repeat earlier output:
/// length in the upper three bits (7: another byte adds to it), distance in the lower five bits and the byte after.
fn unpack(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(length.min(packed.len().saturating_mul(264)));
    let mut bytes = packed.iter().map(|&b| usize::from(b));
    while let Some(control) = bytes.next() {
        if control < 32 {
            for _ in 0..=control {
                out.push(bytes.next()? as u8);
            }
        } else {
            let more = if control >> 5 == 7 { bytes.next()? } else { 0 };
            let count = (control >> 5) + more + 2;
            let back = ((control & 31) << 8 | bytes.next()?) + 1;
            let from = out.len().checked_sub(back)?;
            for k in 0..count {
                out.push(out[from + k]);
            }
        }
        if out.len() > length {
            return None;
        }
    }
    (out.len() == length).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_unpacked_and_damage_is_refused() {
        // "abc" literally, then six bytes from three back: abcabcabc.
        let packed = [2, b'a', b'b', b'c', 4 << 5, 2];
        assert_eq!(unpack(&packed, 9).unwrap(), b"abcabcabc");
        // A long repeat: 7 + 3 + 2 bytes from one back.
        assert_eq!(unpack(&[0, b'z', 7 << 5, 3, 0], 13).unwrap(), [b'z'; 13]);
        for (bad, length) in [(&packed[..], 8), (&packed[..5], 9), (&[4 << 5, 2][..], 6)] {
            assert!(unpack(bad, length).is_none());
        }
    }
}
