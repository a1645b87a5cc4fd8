//! In: measured numbers. Out: SVG elements: coverage, residual arrows, bars, scatter, axes on a sphere.
//! Frame and unit: SVG user units; the data's own units are named in the labels.

use crate::geometry::{Vec2, Vec3};
use std::fmt::Write;

const INK: &str = "#1c2733";
const SOFT: &str = "#9aa7b2";
const BLUE: &str = "#1f6fb2";
const RED: &str = "#c0392b";

fn open(width: f64, height: f64) -> String {
    // With the namespace, a plot can be saved as a separate file. It is only a name; nothing is loaded.
    format!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" font-family=\"sans-serif\" font-size=\"11\">"
    )
}

/// Text escaped for SVG.
fn safe(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn text(out: &mut String, x: f64, y: f64, anchor: &str, s: &str) {
    let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{INK}\">{}</text>", safe(s));
}

fn line(out: &mut String, a: (f64, f64), b: (f64, f64), colour: &str, width: f64) {
    let _ = write!(
        out,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
        a.0, a.1, b.0, b.1
    );
}

/// A picture's outline scaled to a width of 640. Returns the SVG so far, the scale and the height.
fn frame(width: u32, height: u32) -> (String, f64, f64) {
    let s = 640.0 / f64::from(width.max(1));
    let h = f64::from(height) * s;
    let mut out = open(640.0, h + 22.0);
    let _ = write!(out, "<rect width=\"640\" height=\"{h:.1}\" fill=\"#fff\" stroke=\"{SOFT}\"/>");
    (out, s, h)
}

/// Positions of the features seen in pictures of `width` x `height`. Cells of an 8 x 6 grid without any feature are
/// shaded red.
pub fn coverage_map(width: u32, height: u32, seen: &[Vec2]) -> String {
    let (mut out, s, h) = frame(width, height);
    let (nx, ny) = (8usize, 6usize);
    let cell = |p: &Vec2| {
        let at = |v: f64, size: u32, n: usize| (((v + 0.5) / f64::from(size) * n as f64).max(0.0) as usize).min(n - 1);
        (at(p.x, width, nx), at(p.y, height, ny))
    };
    let mut counts = vec![0usize; nx * ny];
    seen.iter().for_each(|p| {
        let (i, j) = cell(p);
        counts[j * nx + i] += 1;
    });
    let (cw, ch) = (640.0 / nx as f64, h / ny as f64);
    for (k, _) in counts.iter().enumerate().filter(|(_, n)| **n == 0) {
        let (x, y) = ((k % nx) as f64 * cw, (k / nx) as f64 * ch);
        let _ = write!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{cw:.1}\" height=\"{ch:.1}\" fill=\"{RED}\" opacity=\"0.15\"/>"
        );
    }
    for p in seen {
        let _ = write!(
            out,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.6\" fill=\"{BLUE}\"/>",
            (p.x + 0.5) * s,
            (p.y + 0.5) * s
        );
    }
    let empty = counts.iter().filter(|n| **n == 0).count();
    text(&mut out, 4.0, h + 16.0, "start", &format!("{} features; {empty} of {} cells empty", seen.len(), nx * ny));
    out + "</svg>"
}

/// Residuals (second, px) at their positions (first, px), scaled to a readable length. Flagged ones are red.
pub fn residual_arrows(width: u32, height: u32, residuals: &[(Vec2, Vec2, bool)]) -> String {
    let (mut out, s, h) = frame(width, height);
    let mut lengths: Vec<f64> = residuals.iter().map(|r| r.1.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let typical = lengths.get(lengths.len() * 9 / 10).copied().unwrap_or(1.0).max(1e-9);
    // A residual of the 90 % quantile becomes 20 units long.
    let gain = 20.0 / typical;
    for (at, r, flagged) in residuals {
        let a = ((at.x + 0.5) * s, (at.y + 0.5) * s);
        line(&mut out, a, (a.0 + r.x * gain, a.1 + r.y * gain), if *flagged { RED } else { BLUE }, 1.0);
    }
    let unit = 10f64.powf(typical.log10().floor());
    line(&mut out, (4.0, h + 12.0), (4.0 + unit * gain, h + 12.0), INK, 2.0);
    text(&mut out, 10.0 + unit * gain, h + 16.0, "start", &format!("{unit} px"));
    out + "</svg>"
}

/// One horizontal bar per entry. `limit` is drawn as a line, and bars beyond it are red.
pub fn bars(entries: &[(String, f64)], unit: &str, limit: Option<f64>) -> String {
    let largest = entries.iter().map(|e| e.1).chain(limit).filter(|v| v.is_finite()).fold(1e-12, f64::max);
    let (left, span, row) = (190.0, 380.0, 16.0);
    let height = entries.len() as f64 * row + 10.0;
    let mut out = open(640.0, height);
    for (k, (name, value)) in entries.iter().enumerate() {
        let y = 5.0 + k as f64 * row;
        text(&mut out, left - 6.0, y + 11.0, "end", name);
        let w = (value / largest * span).clamp(0.0, span);
        let colour = if limit.is_some_and(|l| *value > l) { RED } else { BLUE };
        let _ =
            write!(out, "<rect x=\"{left}\" y=\"{:.1}\" width=\"{w:.1}\" height=\"11\" fill=\"{colour}\"/>", y + 1.0);
        text(&mut out, left + w + 4.0, y + 11.0, "start", &format!("{value:.4} {unit}"));
    }
    if let Some(l) = limit {
        let x = left + l / largest * span;
        line(&mut out, (x, 0.0), (x, height), RED, 1.0);
    }
    out + "</svg>"
}

/// Points (x, y) with labelled axes. The axes span the range of the data.
pub fn scatter(points: &[(f64, f64)], x_label: &str, y_label: &str) -> String {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low < high { (low, high) } else { (low.min(0.0) - 1.0, high.max(0.0) + 1.0) }
    };
    let (x0, x1) = range(&mut points.iter().map(|p| p.0));
    let (y0, y1) = range(&mut points.iter().map(|p| p.1));
    let mut out = open(640.0, 320.0);
    let at = |p: &(f64, f64)| (60.0 + (p.0 - x0) / (x1 - x0) * 560.0, 280.0 - (p.1 - y0) / (y1 - y0) * 260.0);
    line(&mut out, (60.0, 280.0), (620.0, 280.0), SOFT, 1.0);
    line(&mut out, (60.0, 280.0), (60.0, 20.0), SOFT, 1.0);
    if y0 < 0.0 && y1 > 0.0 {
        line(&mut out, at(&(x0, 0.0)), at(&(x1, 0.0)), SOFT, 0.5);
    }
    for p in points.iter().filter(|p| p.0.is_finite() && p.1.is_finite()) {
        let (x, y) = at(p);
        let _ = write!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"{BLUE}\"/>");
    }
    text(&mut out, 60.0, 296.0, "start", &format!("{x0:.4}"));
    text(&mut out, 620.0, 296.0, "end", &format!("{x1:.4}"));
    text(&mut out, 340.0, 312.0, "middle", x_label);
    text(&mut out, 56.0, 280.0, "end", &format!("{y0:.4}"));
    text(&mut out, 56.0, 28.0, "end", &format!("{y1:.4}"));
    text(&mut out, 64.0, 14.0, "start", y_label);
    out + "</svg>"
}

/// Directions on the unit sphere seen along -z, for rotation axes and board normals. The centre is +z or -z (an
/// axis has no sign); the rim is perpendicular to it. A good set fills the disc.
pub fn axis_sphere(axes: &[(Vec3, String)]) -> String {
    let (centre, radius) = (170.0, 150.0);
    let mut out = open(340.0, 340.0);
    for share in [1.0, 0.866, 0.5] {
        let _ = write!(
            out,
            "<circle cx=\"{centre}\" cy=\"{centre}\" r=\"{:.1}\" fill=\"none\" stroke=\"{SOFT}\"/>",
            radius * share
        );
    }
    for (axis, name) in axes.iter().filter(|a| a.0.norm() > 0.0) {
        let n = axis.normalize() * if axis.z < 0.0 { -1.0 } else { 1.0 };
        let (x, y) = (centre + n.x * radius, centre + n.y * radius);
        let _ = write!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{BLUE}\"/>");
        text(&mut out, x + 4.0, y - 3.0, "start", name);
    }
    text(&mut out, centre + radius + 4.0, centre + 4.0, "start", "x");
    text(&mut out, centre, centre + radius + 14.0, "middle", "y");
    out + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_counts_cells_and_corners_of_the_picture_are_inside() {
        let seen = [Vec2::new(-0.5, -0.5), Vec2::new(639.4, 479.4), Vec2::new(320.0, 240.0)];
        assert!(coverage_map(640, 480, &seen).contains("3 features; 45 of 48 cells empty"));
    }

    #[test]
    fn odd_data_draws_without_nan() {
        let plots = [
            bars(&[], "px", None),
            bars(&[("a".into(), 0.0)], "px", Some(0.0)),
            scatter(&[(1.0, 2.0)], "x", "y"),
            scatter(&[(f64::NAN, 2.0), (1.0, 1.0), (2.0, 3.0)], "x", "y"),
            residual_arrows(640, 480, &[(Vec2::zeros(), Vec2::zeros(), false)]),
            axis_sphere(&[(Vec3::zeros(), "a".into()), (Vec3::new(0.0, 1.0, -1.0), "b".into())]),
        ];
        for p in plots {
            assert!(p.starts_with("<svg") && p.ends_with("</svg>") && !p.contains("NaN") && !p.contains("inf"), "{p}");
        }
    }
}
