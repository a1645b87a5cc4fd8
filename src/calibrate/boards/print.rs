//! In: a board's description. Out: the board for printing at true scale, as SVG and PDF.
//! Frame and unit: millimetres on the sheet, x to the right, y down.

use crate::fault::{Fault, Result};
use crate::recording::{BoardSpec, MarkerLayout, Markers, OriginMark};
use std::fmt::Write;

/// Black shapes on a white sheet.
#[derive(Clone, Debug, Default)]
pub struct Sheet {
    /// Width of the sheet, mm: the board with its border.
    pub width: f64,
    /// Height of the sheet, mm: the board with its border, and 12 mm for label and rule.
    pub height: f64,
    /// Black rectangles: x, y, width, height, mm.
    pub rectangles: Vec<[f64; 4]>,
    /// Black discs: centre x, y, radius, mm.
    pub discs: Vec<[f64; 3]>,
    /// White discs on black ones: centre x, y, radius, mm.
    pub holes: Vec<[f64; 3]>,
    /// Black triangles: three corners each, mm.
    pub triangles: Vec<[[f64; 2]; 3]>,
    /// Text under the board, outside its border.
    pub label: String,
}

/// Space under the board for the label and a 100 mm rule that shows the printer's scale, mm.
const FOOT: f64 = 12.0;

/// Draws a board.
///
/// # Errors
/// Sizes that cannot be printed, unknown dictionaries, more markers than the dictionary has.
pub fn sheet(board: &BoardSpec) -> Result<Sheet> {
    check(board)?;
    let [x0, y0, x1, y1] = board.outline();
    let mut sheet = Sheet { width: x1 - x0, height: y1 - y0 + FOOT, label: label(board), ..Sheet::default() };
    match board {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, first_square, .. } => {
            let odd = u32::from(first_square == "white");
            squares(&mut sheet, *nx + 1, *ny + 1, *s, -s - x0, -s - y0, odd);
        }
        BoardSpec::Charuco { squares: [nx, ny], square_mm: s, .. } => {
            squares(&mut sheet, *nx, *ny, *s, -x0, -y0, u32::from(board.begins_white()));
            let all = Markers::of(board)?.expect("a ChArUco board has markers");
            markers(&mut sheet, &all, [-x0, -y0]);
        }
        BoardSpec::MarkerGrid { .. } => {
            let all = Markers::of(board)?.expect("a marker grid has markers");
            markers(&mut sheet, &all, [-x0, -y0]);
            sheet.rectangles.extend(all.corner_squares().iter().map(|[x, y, side]| [x - x0, y - y0, *side, *side]));
        }
        BoardSpec::Circles { origin, border_mm, .. } => {
            let r = board.drawn_diameter().expect("a circle grid has dots") / 2.0;
            let discs = board.features().into_iter().map(|c| [c.x - x0, c.y - y0, r]);
            sheet.discs.extend(discs);
            if let Some(first) = board.drawn_first_diameter() {
                sheet.discs[0][2] = first / 2.0;
            }
            for (k, diameter) in board.drawn_holes() {
                let [x, y, _] = sheet.discs[k];
                sheet.holes.push([x, y, diameter / 2.0]);
            }
            if let Some(OriginMark::FrameCorner { bar_mm: bar, corner_mm, .. }) = origin {
                frame(&mut sheet, *border_mm, [x1 - x0 - border_mm, y1 - y0 - border_mm], *bar, *corner_mm);
            }
        }
    }
    let rule = sheet.width.min(100.0).floor();
    sheet.rectangles.push([(sheet.width - rule) / 2.0, sheet.height - 6.0, rule, 0.3]);
    for end in [0.0, rule - 0.3] {
        sheet.rectangles.push([(sheet.width - rule) / 2.0 + end, sheet.height - 7.5, 0.3, 3.0]);
    }
    Ok(sheet)
}

fn check(board: &BoardSpec) -> Result<()> {
    let (n, of, cell, name, border) = match board {
        BoardSpec::Chessboard { inner_corners, square_mm, border_mm, .. } => {
            (*inner_corners, "inner corners", *square_mm, "squares", *border_mm)
        }
        BoardSpec::Charuco { squares, square_mm, border_mm, .. } => {
            (*squares, "squares", *square_mm, "squares", *border_mm)
        }
        BoardSpec::MarkerGrid { markers, marker_mm, border_mm, .. } => {
            (*markers, "markers", *marker_mm, "markers", *border_mm)
        }
        BoardSpec::Circles { dots, pitch_mm, border_mm, .. } => (*dots, "dots", *pitch_mm, "a pitch", *border_mm),
    };
    let least = if matches!(board, BoardSpec::MarkerGrid { .. }) { 1 } else { 3 };
    if n.iter().any(|n| !(least..=100).contains(n)) {
        return bad(
            format!("a board of {}x{} {of} cannot be drawn, only {least} to 100 each way", n[0], n[1]),
            "give COLUMNSxROWS within that, e.g. 9x6",
        );
    }
    if !(0.5..=500.0).contains(&cell) {
        return bad(
            format!("a board with {name} of {cell} mm cannot be drawn, only of 0.5 to 500 mm"),
            "give --square-mm in millimetres",
        );
    }
    if !(0.0..=500.0).contains(&border) {
        return bad(
            format!("a board with a border of {border} mm cannot be drawn, only of 0 to 500 mm"),
            "give --border-mm in millimetres, or leave it out",
        );
    }
    fits(board)
}

fn bad(what: String, next: &str) -> Result<()> {
    Err(Fault::usage(what).cause("a slip of typing, or another unit than mm").next(next))
}

/// Checks that markers fit in their squares with white around them, and dots in their pitch.
fn fits(board: &BoardSpec) -> Result<()> {
    match board {
        BoardSpec::Charuco { square_mm, marker_mm, .. } if !(*marker_mm > 0.0 && *marker_mm < 0.95 * square_mm) => bad(
            format!(
                "markers of {marker_mm} mm do not fit in squares of {square_mm} mm: above 0 and below {} mm",
                0.95 * square_mm
            ),
            "choose markers of 0.5 to 0.8 of the square",
        ),
        // Without a white margin of about a cell the marker's edges are not visible.
        BoardSpec::MarkerGrid { markers, marker_mm, gap_mm, border_mm, .. }
            if (markers != &[1, 1] && *gap_mm < 0.15 * marker_mm)
                || border_mm + board.corner_squares_mm().unwrap_or(0.0) < 0.15 * marker_mm =>
        {
            let least = 0.15 * marker_mm;
            bad(
                format!(
                    "gaps of {gap_mm} mm and a border of {border_mm} mm leave too little white round markers of \
                     {marker_mm} mm: at least {least} mm"
                ),
                "choose gaps and a border of a fifth to half of the marker",
            )
        }
        BoardSpec::Circles { pitch_mm, .. }
            if !board.drawn_diameter().is_some_and(|d| d > 0.0 && d < 0.9 * pitch_mm) =>
        {
            let (most, drawn) = (0.9 * pitch_mm, board.drawn_diameter().unwrap_or(0.0));
            bad(
                format!("dots of {drawn} mm do not fit a pitch of {pitch_mm} mm: above 0 and below {most} mm"),
                "choose dots of half the pitch",
            )
        }
        BoardSpec::Circles { pitch_mm, origin: Some(OriginMark::LargerDot { .. }), .. } => {
            let (small, first) = (board.drawn_diameter().unwrap_or(0.0), board.drawn_first_diameter().unwrap_or(0.0));
            let most = 1.9 * pitch_mm - small;
            if first < most {
                return Ok(());
            }
            bad(
                format!(
                    "a first dot of {first} mm beside dots of {small} mm does not fit a pitch of {pitch_mm} mm: below \
                     {most} mm"
                ),
                "choose dots of 0.4 of the pitch, and a first one twice as large",
            )
        }
        _ => Ok(()),
    }
}

fn squares(sheet: &mut Sheet, nx: u32, ny: u32, s: f64, x0: f64, y0: f64, odd: u32) {
    let black = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).filter(|(i, j)| (i + j) % 2 == odd);
    sheet.rectangles.extend(black.map(|(i, j)| [x0 + f64::from(i) * s, y0 + f64::from(j) * s, s, s]));
}

/// Four bars from (`low`, `low`) to `high`, and the triangle in the upper left corner.
fn frame(sheet: &mut Sheet, low: f64, high: [f64; 2], bar: f64, corner: f64) {
    let (w, h) = (high[0] - low, high[1] - low);
    for at in [[low, low, w, bar], [low, high[1] - bar, w, bar], [low, low, bar, h], [high[0] - bar, low, bar, h]] {
        sheet.rectangles.push(at);
    }
    sheet.triangles.push([[low, low], [low + corner, low], [low, low + corner]]);
}

/// Runs of black cells become one rectangle, so that the print has no hairlines between cells.
fn markers(sheet: &mut Sheet, all: &Markers, [x0, y0]: [f64; 2]) {
    let cell = all.cell_mm();
    for (i, j, k) in all.places() {
        let [left, top] = all.corner(i, j);
        for row in 0..all.cells() {
            let mut column = 0;
            while column < all.cells() {
                let start = column;
                while column < all.cells() && all.black(k, column, row) {
                    column += 1;
                }
                if column > start {
                    let (x, w) = (x0 + left + start as f64 * cell, (column - start) as f64 * cell);
                    sheet.rectangles.push([x, y0 + top + row as f64 * cell, w, cell]);
                }
                column += 1;
            }
        }
    }
}

fn label(board: &BoardSpec) -> String {
    match board {
        BoardSpec::Chessboard { inner_corners: [a, b], square_mm, .. } => {
            format!("chessboard, {a}x{b} inner corners, squares {square_mm} mm")
        }
        BoardSpec::Charuco { squares: [a, b], square_mm, marker_mm, dictionary, .. } => {
            format!("ChArUco, {a}x{b} squares of {square_mm} mm, markers {marker_mm} mm, {dictionary}")
        }
        BoardSpec::MarkerGrid { markers: [a, b], marker_mm, gap_mm, dictionary, first_id, layout, .. } => {
            let kind = if *layout == MarkerLayout::Kalibr { "AprilGrid, " } else { "" };
            format!("{kind}{a}x{b} markers of {marker_mm} mm, gaps {gap_mm} mm, {dictionary} from {first_id}")
        }
        BoardSpec::Circles { dots: [a, b], pitch_mm, asymmetric, origin, .. } => {
            let diameter_mm = board.drawn_diameter().unwrap_or(0.0);
            let kind = match (asymmetric, origin) {
                (true, _) => "asymmetric circles",
                (false, None) => "symmetric circles",
                (false, Some(OriginMark::LargerDot { .. })) => "circles with a larger first one",
                (false, Some(OriginMark::FrameCorner { .. })) => "circles in a frame",
                (false, Some(OriginMark::FinderPatterns { .. })) => "circles with finder patterns",
            };
            format!("{kind}, {a}x{b}, pitch {pitch_mm} mm, diameter {diameter_mm} mm")
        }
    }
}

impl Sheet {
    /// SVG whose user unit is a millimetre.
    pub fn svg(&self) -> String {
        let (w, h) = (self.width, self.height);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}mm\" height=\"{h}mm\" viewBox=\"0 0 {w} {h}\">\
             <rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>"
        );
        // One path: adjacent rectangles leave no seam between them.
        out.push_str("<path d=\"");
        for [x, y, w, h] in &self.rectangles {
            let _ = write!(out, "M{x:.5} {y:.5}h{w:.5}v{h:.5}h{:.5}z", -w);
        }
        for [a, b, c] in &self.triangles {
            let _ = write!(out, "M{:.5} {:.5}L{:.5} {:.5}L{:.5} {:.5}z", a[0], a[1], b[0], b[1], c[0], c[1]);
        }
        out.push_str("\"/>");
        for [x, y, r] in &self.discs {
            let _ = write!(out, "<circle cx=\"{x:.5}\" cy=\"{y:.5}\" r=\"{r:.5}\"/>");
        }
        for [x, y, r] in &self.holes {
            let _ = write!(out, "<circle cx=\"{x:.5}\" cy=\"{y:.5}\" r=\"{r:.5}\" fill=\"#fff\"/>");
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.2}\" y=\"{:.2}\" text-anchor=\"middle\" font-family=\"sans-serif\" \
             font-size=\"2.6\">{}</text></svg>",
            w / 2.0,
            h - 8.5,
            self.label
        );
        out
    }

    /// PDF 1.4 with one page of the sheet's size; a unit is 1/72 inch.
    pub fn pdf(&self) -> Vec<u8> {
        let k = 72.0 / 25.4;
        let flip = |y: f64| (self.height - y) * k;
        let mut draw = String::from("0 g\n");
        for [x, y, w, h] in &self.rectangles {
            let _ = writeln!(draw, "{:.4} {:.4} {:.4} {:.4} re", x * k, flip(y + h), w * k, h * k);
        }
        for corners in &self.triangles {
            for ([x, y], draws) in corners.iter().zip(["m", "l", "l h"]) {
                let _ = writeln!(draw, "{:.4} {:.4} {draws}", x * k, flip(*y));
            }
        }
        draw.push_str("f\n");
        for [x, y, r] in &self.discs {
            disc(&mut draw, x * k, flip(*y), r * k);
        }
        if !self.holes.is_empty() {
            draw.push_str("1 g\n");
            for [x, y, r] in &self.holes {
                disc(&mut draw, x * k, flip(*y), r * k);
            }
            draw.push_str("0 g\n");
        }
        // Characters of Helvetica are about half as wide as high.
        let left = (self.width / 2.0 - self.label.len() as f64 * 2.6 * 0.25) * k;
        let _ = writeln!(
            draw,
            "BT /F1 {:.2} Tf {:.2} {:.2} Td ({}) Tj ET",
            2.6 * k,
            left.max(0.0),
            flip(self.height - 8.5),
            self.label
        );
        let objects = [
            "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_string(),
            "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".into(),
            format!(
                "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4} {:.4}] /Contents 4 0 R /Resources << /Font << /F1 \
                 5 0 R >> >> >>",
                self.width * k,
                self.height * k
            ),
            format!("<< /Length {} >>\nstream\n{draw}endstream", draw.len()),
            "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".into(),
        ];
        let mut out = String::from("%PDF-1.4\n");
        let mut places = Vec::new();
        for (i, object) in objects.iter().enumerate() {
            places.push(out.len());
            let _ = write!(out, "{} 0 obj\n{object}\nendobj\n", i + 1);
        }
        let start = out.len();
        let _ = write!(out, "xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
        for place in places {
            let _ = writeln!(out, "{place:010} 00000 n ");
        }
        let _ = write!(out, "trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{start}\n%%EOF\n", objects.len() + 1);
        out.into_bytes()
    }
}

/// A disc of four Bezier arcs; off by at most 0.03 % of the radius.
fn disc(out: &mut String, x: f64, y: f64, r: f64) {
    let c = 0.552_285 * r;
    let _ = writeln!(out, "{:.4} {y:.4} m", x + r);
    for (sx, sy, quarter) in [(1.0, 1.0, 0), (-1.0, 1.0, 1), (-1.0, -1.0, 0), (1.0, -1.0, 1)] {
        let p = if quarter == 0 {
            [x + sx * r, y + sy * c, x + sx * c, y + sy * r, x, y + sy * r]
        } else {
            [x + sx * c, y + sy * r, x + sx * r, y + sy * c, x + sx * r, y]
        };
        let _ = writeln!(out, "{:.4} {:.4} {:.4} {:.4} {:.4} {:.4} c", p[0], p[1], p[2], p[3], p[4], p[5]);
    }
    out.push_str("f\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_cannot_be_drawn_is_refused_with_the_limit() {
        let squares = |n: [u32; 2], square_mm: f64, border_mm: f64| BoardSpec::Chessboard {
            inner_corners: n,
            square_mm,
            border_mm,
            first_square: "black".into(),
        };
        let dots = BoardSpec::Circles {
            dots: [7, 5],
            pitch_mm: 10.0,
            diameter_mm: Some(9.5),
            asymmetric: false,
            origin: None,
            border_mm: 6.0,
        };
        for (board, words) in [
            (squares([1, 6], 10.0, 6.0), ["board of 1x6 inner corners", "3 to 100"]),
            (squares([9, 101], 10.0, 6.0), ["board of 9x101 inner corners", "3 to 100"]),
            (squares([9, 6], 0.01, 6.0), ["squares of 0.01 mm", "0.5 to 500 mm"]),
            (squares([9, 6], 10.0, -1.0), ["border of -1 mm", "0 to 500 mm"]),
            (dots, ["dots of 9.5 mm", "below 9 mm"]),
        ] {
            let e = check(&board).unwrap_err();
            assert!(words.iter().all(|w| e.what.contains(w)), "{e}");
            assert!(!e.cause.is_empty() && !e.next.is_empty() && e.exit_code() == 2, "{e}");
        }
        assert!(check(&squares([9, 6], 10.0, 6.0)).is_ok());
    }
}
