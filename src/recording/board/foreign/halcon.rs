//! In: HALCON's description of a calibration plate (.descr, .cpd). Out: the board. Read are the plates with
//! rectangularly arranged marks (gen_caltab) and those with hexagonally arranged ones (create_caltab).
//! Frame and unit: metres in the file. HALCON's origin is the plate's middle, ours the first mark, beside the
//! triangle if there is one; the axes have the same directions.

use super::super::mark::OriginMark;
use super::super::spec::BoardSpec;
use super::values::{lacks, mm};
use crate::fault::{Fault, Result};
use std::collections::HashMap;

/// Places may differ from the described grid by this share of the pitch: files state few digits.
const OFF_GRID: f64 = 1e-3;

pub fn read(text: &str) -> Result<BoardSpec> {
    let (mut keys, mut marks, mut finders) = (HashMap::new(), Vec::new(), Vec::new());
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (key, rest) = match line.chars().next() {
            None => continue,
            Some(c) if c.is_ascii_alphabetic() => (Some(c), &line[1..]),
            Some(_) => (None, line),
        };
        let numbers = rest.split_whitespace().map(str::parse::<f64>).collect::<std::result::Result<Vec<f64>, _>>();
        let numbers = numbers.ok().filter(|n| n.iter().all(|v| v.is_finite()));
        match (key, numbers) {
            // The polarity is seen in the pictures.
            (Some('p'), _) => {}
            (Some(key), Some(numbers)) if "rczoitwf".contains(key) => {
                keys.insert(key, numbers);
            }
            (None, Some(numbers)) if numbers.len() == 3 => marks.push([numbers[0], numbers[1], numbers[2]]),
            (None, Some(numbers)) if numbers.len() == 2 && numbers.iter().all(|n| (0.0..1e3).contains(n)) => {
                finders.push([numbers[0] as u32, numbers[1] as u32]);
            }
            (Some(key), Some(_)) => return Err(unknown(&format!("line {}: the key '{key}'", i + 1))),
            _ => {
                return Err(Fault::input(format!("line {} is no line of a plate description", i + 1))
                    .cause("a damaged file, or one of another program")
                    .next("give the .descr file that belongs to the plate"));
            }
        }
    }
    board(&keys, &marks, finders)
}

fn board(keys: &HashMap<char, Vec<f64>>, marks: &[[f64; 3]], finders: Vec<[u32; 2]>) -> Result<BoardSpec> {
    let get = |key: char, name: &str, n: usize| match keys.get(&key) {
        Some(numbers) if numbers.len() == n => Ok(numbers),
        _ => Err(lacks(&format!("{key} ({name})"))),
    };
    let [rows, columns] = [get('r', "rows of marks", 1)?[0], get('c', "columns of marks", 1)?[0]];
    let whole = |n: f64| n.fract() == 0.0 && (2.0..=1000.0).contains(&n);
    if !whole(rows) || !whole(columns) || marks.len() as f64 != rows * columns {
        return Err(Fault::input(format!("{rows} rows and {columns} columns are stated, and {} marks", marks.len()))
            .cause("a file that is cut off")
            .next("give the .descr file that belongs to the plate"));
    }
    let (nx, ny) = (columns as usize, rows as usize);
    let [x0, y0, radius] = marks[0];
    let pitch = (marks[nx - 1][0] - x0) / (columns - 1.0);
    let hexagonal = keys.contains_key(&'f');
    let (rows_apart, shift) = if hexagonal { (0.75f64.sqrt() * pitch, 0.5 * pitch) } else { (pitch, 0.0) };
    let off = |k: usize, m: &[f64; 3]| {
        let (i, j) = (k % nx, k / nx);
        let at = [x0 + i as f64 * pitch - (j % 2) as f64 * shift, y0 + j as f64 * rows_apart];
        (m[0] - at[0]).abs().max((m[1] - at[1]).abs()).max((m[2] - radius).abs())
    };
    if pitch <= 0.0 || marks.iter().enumerate().any(|(k, m)| off(k, m) > OFF_GRID * pitch) {
        let grid = if hexagonal { "hexagonal grid whose second row begins to the left" } else { "square grid" };
        return Err(Fault::input(format!("the marks do not lie on a {grid}, row by row, all of one size"))
            .cause("a plate of another kind, or an edited file")
            .next("describe the plate with sheetlight board, if it is one of the kinds there"));
    }
    if hexagonal {
        if get('f', "finder patterns", 1)?[0] != finders.len() as f64 {
            return Err(lacks("the place of a finder pattern"));
        }
        return Ok(BoardSpec::Circles {
            dots: [nx as u32, ny as u32],
            pitch_mm: mm(pitch),
            diameter_mm: Some(mm(2.0 * radius)),
            asymmetric: false,
            origin: Some(OriginMark::FinderPatterns { at: finders }),
            border_mm: 0.0,
        });
    }
    let origin = keys.contains_key(&'t').then(|| {
        let (frame, corner) = (get('i', "outer border of the frame", 4)?, get('t', "triangular corner mark", 4)?);
        let bar = get('w', "width of the frame", 1)?[0];
        let far = [x0 + (nx - 1) as f64 * pitch, y0 + (ny - 1) as f64 * pitch];
        let gaps = [x0 - frame[0], frame[1] - far[1], frame[2] - far[0], y0 - frame[3]];
        // The triangle is stated by the two ends of its long side, on the frame's left and upper edges.
        let legs = [corner[1] - frame[3], corner[2] - frame[0]];
        let ends = [corner[0] - frame[0], corner[3] - frame[3]];
        let close = |a: f64, b: f64| (a - b).abs() <= OFF_GRID * pitch;
        let good = gaps.iter().all(|g| close(*g, gaps[0])) && close(legs[0], legs[1]);
        if !good || ends.iter().any(|e| !close(*e, 0.0)) {
            return Err(Fault::input("the frame or the triangle does not lie as on HALCON's plates")
                .cause("a plate whose frame is not equally far from the marks, or whose triangle is in another corner")
                .next("describe the plate with sheetlight board caltab, as it is seen with the triangle upper left"));
        }
        Ok(OriginMark::FrameCorner { frame_mm: mm(gaps[0]), bar_mm: mm(bar), corner_mm: mm(legs[0]) })
    });
    Ok(BoardSpec::Circles {
        dots: [nx as u32, ny as u32],
        pitch_mm: mm(pitch),
        diameter_mm: Some(mm(2.0 * radius)),
        asymmetric: false,
        origin: origin.transpose()?,
        border_mm: 0.0,
    })
}

fn unknown(what: &str) -> Fault {
    Fault::input(format!("{what} belongs to a plate that is not read"))
        .cause("a plate of a kind that gen_caltab and create_caltab do not describe")
        .next("use a plate of a kind that docs/boards.md names")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A description as HALCON writes it, of 7 x `rows` marks.
    fn text(rows: usize, triangle: &str) -> String {
        let mut text = format!(
            "# Plate Description Version 2\n# HALCON Version 12.0\n\n# Number of marks (rows)\nr {rows}\n\
             \nc 7\n\nz 0\no -0.05125 0.05125 0.05125 -0.05125\ni -0.05 0.05 0.05 -0.05 \n{triangle}\n\nw 0.003125\n"
        );
        for k in 0..7 * rows {
            let at = |n: usize| (n as f64 - 3.0) * 0.0125;
            text += &format!("{} {} 0.003125\n", at(k % 7), at(k / 7));
        }
        text
    }

    #[test]
    fn the_classical_plate_is_read() {
        let plate = |origin| BoardSpec::Circles {
            dots: [7, 7],
            pitch_mm: 12.5,
            diameter_mm: Some(6.25),
            asymmetric: false,
            origin,
            border_mm: 0.0,
        };
        let corner = OriginMark::FrameCorner { frame_mm: 12.5, bar_mm: 3.125, corner_mm: 12.5 };
        assert_eq!(read(&text(7, "t -0.05 -0.0375 -0.0375 -0.05")).unwrap(), plate(Some(corner)));
        assert_eq!(read(&text(7, "")).unwrap(), plate(None), "the triangle is optional");
    }

    #[test]
    fn a_plate_with_finder_patterns_is_read() {
        let mut text = String::from(
            "# Plate Description Version 3\nr 5\nc 6\nz 0\no -0.02 0.02 0.02 -0.02\np light\nf 2\n2 1\n3 3\n",
        );
        for k in 0..30 {
            let (i, j) = (f64::from(k % 6), f64::from(k / 6));
            let x = (i - 2.5 - if k / 6 % 2 == 1 { 0.5 } else { 0.0 }) * 0.00516129;
            text += &format!("{x:.9} {:.9} 0.00129032\n", (j - 2.0) * 0.00516129 * 0.75f64.sqrt());
        }
        let board = read(&text).unwrap();
        assert_eq!(
            board,
            BoardSpec::Circles {
                dots: [6, 5],
                pitch_mm: 5.16129,
                diameter_mm: Some(2.58064),
                asymmetric: false,
                origin: Some(OriginMark::FinderPatterns { at: vec![[2, 1], [3, 3]] }),
                border_mm: 0.0,
            }
        );
        // The six marks with a hole of the first pattern: all but the right one of the hexagon.
        let holes = OriginMark::holes(&[[2, 1]]);
        assert_eq!(holes, [[1, 1], [1, 2], [1, 0], [2, 1], [2, 2], [2, 0]]);
        let e = read(&text.replace("f 2", "f 3")).unwrap_err();
        assert!(e.what.contains("place of a finder pattern"), "{e}");
    }

    #[test]
    fn other_plates_are_refused_in_words() {
        let good = text(7, "t -0.05 -0.0375 -0.0375 -0.05");
        for (bad, says) in [
            (good.replace("z 0", "q 3 2"), "'q'"),
            (good.replace("z 0", "f 1"), "hexagonal grid"),
            (good.replace("r 7", "r 8"), "8 rows and 7 columns are stated, and 49 marks"),
            (good.replace("r 7\n", ""), "r (rows of marks)"),
            (good.replace("w 0.003125", ""), "w (width of the frame)"),
            (good.replace("\n0 0 0.003125", "\n0.003 0 0.003125"), "square grid"),
            (good.replace("t -0.05 -0.0375 -0.0375 -0.05", "t 0.05 -0.0375 0.0375 -0.05"), "triangle"),
            (good.replace("z 0", "zero"), "line"),
            (text(6, "t -0.05 -0.0375 -0.0375 -0.05"), "frame or the triangle"),
        ] {
            let e = read(&bad).unwrap_err();
            assert!(e.what.contains(says) && !e.cause.is_empty() && !e.next.is_empty(), "{says}: {e}");
        }
    }
}
