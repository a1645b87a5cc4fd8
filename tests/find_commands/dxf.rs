//! In: DXF drawings written here, good ones and broken ones. Out: judgement on what is read of them: the edges of the
//! shipped recipes, units, blocks, and a refusal with its reason for everything else.
//! Frame and unit: part frame, mm.

use crate::common;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::fault::Fault;
use sheetlight::find::dxf::{DxfOptions, Imported, read};
use sheetlight::find::model::shape::Form;
use sheetlight::find::model::shape::Inside;
use sheetlight::find::{Drawing, Recipe};
use std::fmt::Write;

/// Groups of an entity, one a line as the file has them.
fn tags(pairs: &[(i32, String)]) -> String {
    pairs.iter().fold(String::new(), |mut s, (code, value)| {
        write!(s, "{code}\n{value}\n").unwrap();
        s
    })
}

macro_rules! entity {
    ($kind:expr, $($code:literal: $value:expr),* $(,)?) => {
        tags(&[(0, $kind.to_string()), $(($code, $value.to_string())),*])
    };
}

fn file(units: &str, blocks: &str, entities: &str) -> String {
    format!(
        "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1027\n{units}0\nENDSEC\n0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n\
         0\nLAYER\n2\noff\n70\n0\n62\n-7\n0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n\
         0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"
    )
}

const MM: &str = "9\n$INSUNITS\n70\n4\n";
const INCH: &str = "9\n$INSUNITS\n70\n1\n";

fn line(a: [f64; 2], b: [f64; 2]) -> String {
    entity!("LINE", 8: "0", 10: a[0], 20: a[1], 11: b[0], 21: b[1])
}

fn circle(layer: &str, x: f64, y: f64, r: f64) -> String {
    entity!("CIRCLE", 8: layer, 10: x, 20: y, 40: r)
}

fn imported(text: &str) -> Imported {
    read(text.as_bytes(), &DxfOptions { origin: Some([0.0; 2]), ..Default::default() })
        .unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str, options: &DxfOptions) -> Fault {
    let e = read(text.as_bytes(), options).expect_err("a refusal");
    assert!(!e.next.is_empty(), "no next step: {e}");
    e
}

/// Every edge of one drawing lies on an edge of the other, with the same side up, and the other way round.
fn same_edges(a: &Drawing, b: &Drawing, within: f64) {
    for (a, b) in [(a, b), (b, a)] {
        let other = b.samples(0.02);
        for s in a.samples(0.1) {
            let near = |o: &&sheetlight::find::model::drawn_edges::EdgeSample| {
                (o.x - s.x).hypot(o.y - s.y) < within + 0.011 && o.nx * s.nx + o.ny * s.ny > 0.95
            };
            assert!(other.iter().any(|o| near(&o) && o.z == s.z), "no edge at {:.3} {:.3}", s.x, s.y);
        }
    }
}

/// The oscillator socket as a person draws it: its outline of lines in any order and direction, a window as a light
/// polyline, a block of two contacts inserted as an array.
fn oscillator() -> String {
    let corners = [[-10.2, 6.4], [-10.2, -4.41], [-8.21, -6.4], [10.2, -6.4], [10.2, 6.4]];
    let side = |i: usize, back: bool| {
        let (a, b) = (corners[i], corners[(i + 1) % 5]);
        if back { line(b, a) } else { line(a, b) }
    };
    let outline: String = [(3, false), (0, true), (2, true), (4, false), (1, true)].map(|(i, b)| side(i, b)).concat();
    let window = entity!("LWPOLYLINE", 8: "window", 90: 4, 70: 1, 10: -5.2, 20: -2.2, 10: 5.2, 20: -2.2, 10: 5.2,
        20: 2.2,
        10: -5.2, 20: 2.2);
    let block = entity!("BLOCK", 8: "0", 2: "PINS", 70: 0, 10: 100.0, 20: 50.0, 30: 0.0)
        + &circle("pin", 100.0, 50.0, 0.72)
        + &entity!("ENDBLK", 8: "0");
    let pins = entity!("INSERT", 8: "0", 2: "PINS", 10: -7.62, 20: -3.81, 70: 2, 71: 2, 44: 15.24, 45: 7.62);
    let text = entity!("MTEXT", 8: "0", 10: 0.0, 20: 9.0, 40: 1.0, 1: "socket");
    let construction = circle("off", 0.0, 0.0, 50.0);
    file(MM, &block, &(outline + &window + &pins + &text + &construction))
}

#[test]
fn a_drawn_socket_has_the_edges_of_the_shipped_recipe() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/osc.toml");
    let recipe = Recipe::load(&path).unwrap().drawing();
    let drawn = imported(&oscillator());
    println!("{:?} {:?}", drawn.notes, drawn.warnings);
    same_edges(&drawn.drawing, &recipe, 1e-3);
    // The contacts are one array with its pitch, named by their layer, the window a rectangle.
    let pins = drawn.drawing.shape.iter().find(|s| s.name.as_deref() == Some("pin")).expect("named by its layer");
    let grid = pins.grid.expect("an array");
    assert_eq!((grid.count, grid.pitch, pins.inside), ([2, 2], [15.24, 7.62], Inside::Low));
    assert!(drawn.drawing.shape.iter().any(|s| s.kind == Form::Rectangle && s.size == Some([10.4, 4.4])));
    assert_eq!(drawn.drawing.shape[0].inside, Inside::High);
    assert!(drawn.warnings.is_empty() && drawn.notes.iter().any(|n| n.contains("MTEXT")), "{:?}", drawn.notes);
    // In inches, and about its own middle, it is the same part.
    let inch = file(INCH, "", &(circle("0", 4.0, 2.0, 1.0) + &circle("0", 4.0, 2.0, 0.5)));
    let ring = read(inch.as_bytes(), &DxfOptions::default()).unwrap();
    assert_eq!((ring.unit, ring.origin), ("inch", [4.0, 2.0]));
    let radii: Vec<f64> = ring.drawing.shape.iter().map(|s| s.radius.unwrap()).collect();
    assert_eq!((radii, ring.drawing.shape[1].inside), (vec![25.4, 12.7], Inside::Low));
}

#[test]
fn bulges_arcs_ellipses_and_both_polylines_draw_the_same_slot() {
    // 20 x 8 mm with round ends.
    let arcs = line([-6.0, -4.0], [6.0, -4.0])
        + &line([-6.0, 4.0], [6.0, 4.0])
        + &entity!("ARC", 8: "0", 10: 6, 20: 0, 40: 4, 50: 270, 51: 90)
        + &entity!("ARC", 8: "0", 10: -6, 20: 0, 40: 4, 50: 90, 51: 270);
    let light = entity!("LWPOLYLINE", 8: "0", 90: 4, 70: 1, 10: -6, 20: -4, 10: 6, 20: -4, 42: 1, 10: 6, 20: 4,
        10: -6, 20: 4, 42: 1);
    let vertex = |x: i32, y: i32, bulge: i32| entity!("VERTEX", 8: "0", 10: x, 20: y, 42: bulge);
    let old = entity!("POLYLINE", 8: "0", 66: 1, 70: 1)
        + &[(-6, -4, 0), (6, -4, 1), (6, 4, 0), (-6, 4, 1)].map(|(x, y, b)| vertex(x, y, b)).concat()
        + &entity!("SEQEND", 8: "0");
    let bows = line([-6.0, -4.0], [6.0, -4.0])
        + &line([-6.0, 4.0], [6.0, 4.0])
        + &entity!("ELLIPSE", 8: "0", 10: 6, 20: 0, 11: 4, 21: 0, 40: 1, 41: -std::f64::consts::FRAC_PI_2,
            42: std::f64::consts::FRAC_PI_2)
        // Seen from below: the x axis of an arc's plane points the other way.
        + &entity!("ARC", 8: "0", 10: 6, 20: 0, 40: 4, 50: 270, 51: 90, 230: -1);
    let wanted = imported(&file(MM, "", &arcs)).drawing;
    let p = wanted.shape[0].points.as_ref().unwrap();
    let turn = |i: usize| 0.5 * (p[i][0] * p[(i + 1) % p.len()][1] - p[(i + 1) % p.len()][0] * p[i][1]);
    let area = (0..p.len()).map(turn).sum::<f64>().abs();
    assert!((area - (96.0 + 16.0 * std::f64::consts::PI)).abs() < 0.1, "{area}");
    for other in [light, old, bows] {
        same_edges(&imported(&file(MM, "", &other)).drawing, &wanted, 5e-3);
    }
}

#[test]
fn islands_forks_and_doubled_edges_are_told_apart() {
    let square = |h: f64| {
        let c = [[-h, -h], [h, -h], [h, h], [-h, h]];
        (0..4).map(|i| line(c[i], c[(i + 1) % 4])).collect::<String>()
    };
    // A frame with a post in its window, and a hole in the post.
    let text = file(MM, "", &(square(10.0) + &square(6.0) + &square(3.0) + &circle("0", 0.0, 0.0, 1.0)));
    let d = imported(&text).drawing;
    let face = &d.faces()[0];
    let solid = [(8.0, 0.0, true), (4.5, 0.0, false), (2.0, 0.0, true), (0.5, 0.0, false), (11.0, 0.0, false)];
    for (x, y, there) in solid {
        assert_eq!(face.material(x, y), there, "{x} {y}");
    }
    let length = d.samples(0.02).len() as f64 * 0.02;
    assert!((length - (80.0 + 48.0 + 24.0 + std::f64::consts::TAU)).abs() < 0.3, "{length}");
    let doubled = imported(&file(MM, "", &(square(10.0) + &square(10.0))));
    assert!(doubled.notes.iter().any(|n| n.starts_with("4 edges")) && doubled.drawing.shape.len() == 1);
    let fork =
        imported(&file(MM, "", &(square(10.0) + &circle("0", 30.0, 0.0, 2.0) + &line([-10.0, -10.0], [10.0, 10.0]))));
    assert!(fork.warnings.iter().any(|w| w.starts_with("at 2 places")), "{:?}", fork.warnings);
    assert!(fork.drawing.shape.iter().all(|s| s.kind != Form::Rectangle));
}

#[test]
fn what_cannot_be_read_is_refused_with_its_reason() {
    let ring = circle("0", 0.0, 0.0, 5.0);
    let none = DxfOptions::default();
    let unit = |u: &str| DxfOptions { unit: Some(u.parse().unwrap()), ..Default::default() };
    for text in [file("", "", &ring), file("9\n$INSUNITS\n70\n0\n", "", &ring)] {
        assert!(refused(&text, &none).what.contains("no unit"));
        assert_eq!(read(text.as_bytes(), &unit("cm")).unwrap().drawing.shape[0].radius, Some(50.0));
    }
    // A person overrules the header, and a header that contradicts itself is doubted.
    for (header, wanted, taken, word) in [
        (MM, Some("inch"), "inch", "drawn in mm; --unit inch overrules it"),
        (INCH, Some("mm"), "mm", "drawn in inch; --unit mm overrules it"),
        ("9\n$INSUNITS\n70\n12\n", Some("mm"), "mm", "$INSUNITS 12; --unit mm overrules it"),
        ("9\n$INSUNITS\n70\n1\n9\n$MEASUREMENT\n70\n1\n", None, "inch", "$MEASUREMENT 1"),
        ("9\n$MEASUREMENT\n70\n1\n9\n$INSUNITS\n70\n1\n", None, "inch", "$MEASUREMENT 1"),
        ("9\n$INSUNITS\n70\n2\n", Some("mm"), "mm", "drawn in foot; --unit mm overrules it"),
        ("9\n$INSUNITS\n70\n9\n9\n$MEASUREMENT\n70\n1\n", None, "mil", "--unit mm"),
        ("9\n$INSUNITS\n70\n1\n9\n$MEASUREMENT\n70\n1\n", Some("inch"), "inch", ""),
        ("9\n$INSUNITS\n70\n1\n9\n$MEASUREMENT\n70\n0\n", None, "inch", ""),
        ("9\n$INSUNITS\n70\n4\n9\n$MEASUREMENT\n70\n0\n", None, "mm", ""),
        ("9\n$INSUNITS\n70\n4\n9\n$MEASUREMENT\n70\n1\n", None, "mm", ""),
        ("9\n$MEASUREMENT\n70\n1\n", Some("cm"), "cm", ""),
    ] {
        let options = wanted.map_or(none.clone(), unit);
        let part = read(file(header, "", &ring).as_bytes(), &options).unwrap();
        assert_eq!(part.unit, taken, "{header}");
        let said = part.warnings.join("; ");
        assert!(said.contains(word) && said.is_empty() == word.is_empty(), "{header}: {said}");
    }
    assert!(refused(&file("9\n$INSUNITS\n70\n12\n", "", &ring), &none).what.contains("12"));
    let insert = |name: &str| entity!("INSERT", 8: "0", 2: name, 10: 0, 20: 0);
    let selfish = entity!("BLOCK", 8: "0", 2: "A", 10: 0, 20: 0) + &insert("A") + &entity!("ENDBLK", 8: "0");
    // Points that the curve passes, and no more.
    let spline = entity!("SPLINE", 8: "free", 70: 8, 71: 3, 74: 2, 11: 0, 21: 0, 11: 5, 21: 5);
    let knots = |last: i32| {
        entity!("SPLINE", 8: "0", 70: 8, 71: 1, 72: 4, 73: 2, 40: 0, 40: 0, 40: 1, 40: last,
        10: 0, 20: 0, 10: 5, 20: 5)
    };
    let elsewhere = entity!("BLOCK", 8: "0", 2: "X", 70: 4, 10: 0, 20: 0, 1: "other.dwg") + &entity!("ENDBLK", 8: "0");
    let plain = entity!("BLOCK", 8: "0", 2: "P", 70: 0, 10: 0, 20: 0) + &ring + &entity!("ENDBLK", 8: "0");
    let cases = [
        (file(MM, &selfish, &insert("A")), "in itself"),
        (file(MM, "", &insert("B")), "not a block"),
        (file(MM, "", &(ring.clone() + &spline)), "1 SPLINE of fit points"),
        (file(MM, "", &knots(0)), "do not rise"),
        (file(MM, "", &knots(1).replacen("40\n0\n", "", 1)), "3 knots; allowed: above 1 points and 4 knots"),
        (file(MM, "", &(ring.clone() + &entity!("SOLID", 8: "0", 10: 0, 20: 0))), "1 SOLID"),
        (file(MM, &elsewhere, &insert("X")), "another file"),
        (file(MM, &plain, &(insert("P") + "41\n0\n")), "scaled by 0"),
        (file(MM, "", &line([0.0, 0.0], [5.0, 0.0])), "no closed outline"),
        (file(MM, "", &entity!("CIRCLE", 8: "0", 10: 0, 20: 0, 40: -1)), "above 0"),
        (file(MM, "", &entity!("CIRCLE", 8: "0", 10: 0, 20: 0, 40: 5, 210: 0.6, 230: 0.8)), "normal"),
        (file(MM, "", &entity!("LINE", 8: "0", 10: 0, 20: 0, 30: 0, 11: 1, 21: 0, 31: 7)), "rises"),
        (file(MM, "", &entity!("CIRCLE", 8: "0", 10: "nan", 20: 0, 40: 5)), "not a usable number"),
        (file(MM, "", &entity!("INSERT", 8: "0", 2: "A", 10: 0, 20: 0, 70: 30000, 71: 30000)), "not a block"),
        (file(MM, "", &entity!("LWPOLYLINE", 8: "0", 90: 9, 70: 1, 10: 0, 20: 0)), "9 are announced"),
        (file(MM, "", &ring).replace("0\nEOF\n", ""), "cut off"),
        (file(MM, "", &ring)[..200].to_owned(), "cut off"),
        ("solid part\nfacet normal 0 0 1\n".into(), "group code"),
        ("AutoCAD Binary DXF\r\n\u{1a}\0".into(), "binary"),
        ("AC1032\0\0".into(), "DWG"),
        (String::new(), "EOF"),
    ];
    for (text, word) in cases {
        let e = refused(&text, &none);
        assert!(format!("{e}").contains(word), "wanted {word}: {e}");
    }
    // The free-form curve on a layer that is not asked for does no harm.
    let only = DxfOptions { layers: vec!["0".into()], ..Default::default() };
    assert!(read(file(MM, "", &(ring + &spline)).as_bytes(), &only).is_ok());
}

/// A rational quadratic spline of four pieces: a circle, as programs without circles write it.
fn spline_circle(x: f64, y: f64, r: f64) -> String {
    let mut groups: Vec<(i32, String)> =
        [(0, "SPLINE"), (8, "0"), (70, "11"), (71, "2"), (72, "12"), (73, "9")].map(|(c, v)| (c, v.to_owned())).into();
    groups.extend([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4].map(|k| (40, k.to_string())));
    let around = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    for (i, [u, v]) in around.into_iter().enumerate() {
        let weight = if i % 2 == 0 { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
        let groups_of = [(10, x + r * f64::from(u)), (20, y + r * f64::from(v)), (30, 0.0), (41, weight)];
        groups.extend(groups_of.map(|(c, v)| (c, v.to_string())));
    }
    tags(&groups)
}

#[test]
fn splines_are_read_within_two_micrometres() {
    // A cubic Bezier curve as a cap on a rectangle, with a knot inserted in its middle.
    let cap = entity!("SPLINE", 8: "0", 210: 0, 220: 0, 230: 1, 70: 8, 71: 3, 72: 9, 73: 5, 40: 0, 40: 0, 40: 0, 40: 0,
        40: 0.5, 40: 1, 40: 1, 40: 1, 40: 1, 10: 10, 20: 0, 10: 10, 20: 6, 10: 0, 20: 12, 10: -10, 20: 6, 10: -10,
            20: 0);
    let sides =
        line([-10.0, 0.0], [-10.0, -5.0]) + &line([-10.0, -5.0], [10.0, -5.0]) + &line([10.0, -5.0], [10.0, 0.0]);
    let drawing = imported(&file(MM, "", &(cap + &sides))).drawing;
    let points = drawing.shape[0].points.clone().expect("a polygon");
    // The control points with the knot in the middle are those of the Bezier curve (10,0) (10,12) (-10,12) (-10,0).
    let bezier = |t: f64| {
        let (u, t3, u3) = (1.0 - t, t * t * t, (1.0 - t).powi(3));
        [10.0 * u3 + 30.0 * u * u * t - 30.0 * u * t * t - 10.0 * t3, 36.0 * u * u * t + 36.0 * u * t * t]
    };
    let curve: Vec<[f64; 2]> = (0..=20_000).map(|i| bezier(f64::from(i) / 20_000.0)).collect();
    let off = |p: [f64; 2]| curve.iter().map(|q| (p[0] - q[0]).hypot(p[1] - q[1])).fold(f64::MAX, f64::min);
    let bow: Vec<[f64; 2]> = points.iter().copied().filter(|p| p[1] > 0.01).collect();
    assert!(bow.len() > 30 && bow.iter().map(|p| p[1]).fold(0.0, f64::max) > 8.99, "{}", bow.len());
    for w in bow.windows(2) {
        let middle = [0.5 * (w[0][0] + w[1][0]), 0.5 * (w[0][1] + w[1][1])];
        // Corners are rounded to a micrometre, and the comparison's own points lie a micrometre apart.
        assert!(off(w[0]) < 0.0015 && off(middle) < 0.0045, "{w:?} {} {}", off(w[0]), off(middle));
    }
    // A circle drawn as a spline, as an arc of a whole turn, or as two bulges is a circle, and an array of them a grid.
    let arc = entity!("ARC", 8: "0", 10: 10, 20: 0, 40: 2, 50: 0, 51: 360);
    let bulges = entity!("LWPOLYLINE", 8: "0", 90: 2, 70: 1, 10: 18, 20: 0, 42: 1, 10: 22, 20: 0, 42: 1);
    let ring = circle("0", 10.0, 0.0, 30.0);
    let drawing = imported(&file(MM, "", &(ring + &spline_circle(0.0, 0.0, 2.0) + &arc + &bulges))).drawing;
    let grid = drawing.shape[1].grid.expect("three equal circles in a row");
    assert_eq!((drawing.shape.len(), grid.count, grid.pitch), (2, [3, 1], [10.0, 0.0]));
    assert_eq!(drawing.shape[1].radius, Some(2.0));
    // A polygon of 36 sides is none.
    let corner = |i: i32| f64::from(i).to_radians().sin_cos();
    let sides = (0..36).map(|i| (corner(10 * i), corner(10 * i + 10)));
    let gear: String = sides.map(|((s, c), (s1, c1))| line([20.0 * c, 20.0 * s], [20.0 * c1, 20.0 * s1])).collect();
    assert_eq!(imported(&file(MM, "", &gear)).drawing.shape[0].kind, Form::Polygon);
}

#[test]
fn a_large_arc_is_as_exact_as_a_small_one() {
    // A lens of two bows of 150 mm radius, in metres.
    let half = (40.0f64 / 150.0).asin();
    let bulge = (half / 2.0).tan();
    let lens = entity!("LWPOLYLINE", 8: "0", 90: 2, 70: 1, 10: -0.04, 20: 0, 42: bulge, 10: 0.04, 20: 0, 42: bulge);
    let drawing = imported(&file("9\n$INSUNITS\n70\n6\n", "", &lens)).drawing;
    let points = drawing.shape[0].points.as_ref().expect("a polygon");
    let depth = 150.0 * half.cos();
    for (i, p) in points.iter().enumerate() {
        let q = points[(i + 1) % points.len()];
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let off = 150.0 - middle[0].hypot(middle[1].abs() + depth);
        assert!((-0.001..0.003).contains(&off), "{middle:?} {off}");
    }
}

#[test]
fn an_edge_without_area_is_an_edge() {
    // A bow tie, and a closed polyline of two corners, in a plate.
    let tie = [[0.0, 0.0], [10.0, 5.0], [10.0, 0.0], [0.0, 5.0]];
    let tie: String = (0..4).map(|i| line(tie[i], tie[(i + 1) % 4])).collect();
    let stroke = entity!("LWPOLYLINE", 8: "0", 90: 2, 70: 1, 10: -9, 20: -9, 10: -9, 20: 9);
    let read = imported(&file(MM, "", &(circle("0", 0.0, 0.0, 20.0) + &tie + &stroke)));
    let lines: Vec<_> = read.drawing.shape.iter().filter(|s| s.kind == Form::Line).collect();
    let length = |p: &[[f64; 2]]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
    let total: f64 = lines.iter().map(|s| length(s.points.as_ref().unwrap())).sum();
    assert!(lines.len() == 5 && (total - (10.0 + 2.0 * 125f64.sqrt() + 18.0)).abs() < 2e-3, "{} {total}", lines.len());
    assert!(read.warnings.iter().any(|w| w.starts_with("5 lines")), "{:?}", read.warnings);
}

#[test]
fn what_is_not_shown_is_passed_over_with_its_reason() {
    let layers = "0\nLAYER\n2\nIce\n70\n1\n62\n7\n0\nLAYER\n2\nmid\n70\n0\n62\n3\n6\nCENTER\n0\nENDTAB\n";
    let block = entity!("BLOCK", 8: "0", 2: "pin", 70: 0, 10: 0, 20: 0)
        + &circle("hole", 0.0, 0.0, 1.0)
        + &circle("0", 0.0, 0.0, 0.5)
        + &entity!("ENDBLK", 8: "0");
    let insert = |layer: &str, x: f64| entity!("INSERT", 8: layer, 2: "PIN", 10: x, 20: 0);
    let hidden = |code: i32| circle("0", 0.0, 0.0, 7.0) + &tags(&[(code, "1".into())]);
    let entities = circle("part", 0.0, 0.0, 20.0)
        + &hidden(67)
        + &hidden(60)
        + &circle("ICE", 0.0, 0.0, 8.0)
        + &circle("Defpoints", 0.0, 0.0, 9.0)
        + &entity!("ARC", 8: "0", 10: 0, 20: 0, 40: 0, 50: 0, 51: 90)
        + &line([-5.0, 3.0], [5.0, 3.0]).replace("8\n0\n", "8\nmid\n")
        + &insert("ice", -5.0)
        + &insert("OFF", 5.0)
        // A line's normal says only along what it is extruded.
        + &(line([-5.0, -3.0], [5.0, -3.0]) + "210\n1\n220\n0\n230\n0\n")
        + &entity!("LWPOLYLINE", 8: "0", 90: 2, 43: 0.5, 10: -5, 20: 6, 10: 5, 20: 6);
    let mut text = file(MM, &block, &entities).replace("0\nENDTAB\n", layers);
    text = text.replace("0\nEOF\n", "0\nSECTION\n2\nOBJECTS\n0\nSPATIAL_FILTER\n0\nENDSEC\n0\nEOF\n");
    let read = imported(&text);
    let radii = |r: &Imported| r.drawing.shape.iter().filter_map(|s| s.radius).collect::<Vec<f64>>();
    // A block on a layer that is off still shows what it holds on others.
    assert_eq!(radii(&read), [20.0, 1.0]);
    for (count, words) in [
        (1, "CIRCLE in paper space"),
        (1, "CIRCLE, invisible"),
        (1, "CIRCLE on layer ICE, which is frozen"),
        (1, "INSERT on layer ice, which is frozen"),
        (1, "CIRCLE on layer OFF, which is off"),
        (1, "CIRCLE on layer Defpoints, which is never plotted"),
        (1, "ARC of radius 0"),
    ] {
        assert!(read.notes.contains(&format!("skipped: {count} {words}")), "{words}: {:?}", read.notes);
    }
    for words in
        ["1 edges are drawn as CENTER", "1 polylines have a width", "1 inserted blocks are shown in part", "3 lines"]
    {
        assert!(read.warnings.iter().any(|w| w.starts_with(words)), "{words}: {:?}", read.warnings);
    }
    // A layer that a person names is read, hidden or not, in any case of letters; one that is not there is named.
    let on = |layers: &[&str]| DxfOptions {
        layers: layers.iter().map(|l| (*l).to_owned()).collect(),
        origin: Some([0.0; 2]),
        ..Default::default()
    };
    let named = sheetlight::find::dxf::read(text.as_bytes(), &on(&["ICE"])).unwrap();
    assert_eq!(radii(&named), [8.0, 0.5]);
    let e = refused(&text, &on(&["part", "pars"]));
    assert!(
        e.exit_code() == 2 && e.what.contains("pars") && e.next.contains("Defpoints") && e.next.contains("hole"),
        "{e}"
    );
}

#[test]
fn files_of_other_systems_are_the_same_drawing() {
    let plain = file(MM, "", &(circle("rand", 0.0, 0.0, 9.0) + &circle("\u{d6}l", 0.0, 0.0, 4.0)));
    let only = |layer: &str| DxfOptions { layers: vec![layer.into()], ..Default::default() };
    let oil =
        |bytes: &[u8], layer: &str| read(bytes, &only(layer)).unwrap_or_else(|e| panic!("{e}")).drawing.shape[0].radius;
    assert_eq!(oil(plain.as_bytes(), "\u{f6}l"), Some(4.0));
    // Before 2007 names were bytes of a code page, or escapes where the page lacked the character.
    let latin: Vec<u8> = plain.chars().map(|c| c as u8).collect();
    assert!(std::str::from_utf8(&latin).is_err());
    assert_eq!(oil(&latin, "\u{d6}l"), Some(4.0));
    assert_eq!(oil(plain.replace('\u{d6}', "\\U+00D6").as_bytes(), "\u{d6}l"), Some(4.0));
    // Other line ends, a comment first, codes set right, remains of an older file behind the end.
    let mut windows: String = "999\r\nby hand\r\n".into();
    for (i, l) in plain.lines().enumerate() {
        windows += &if i % 2 == 0 { format!("{l:>3}\r\n") } else { format!("{l}\r\n") };
    }
    assert_eq!(oil((windows + "\u{1a}\r\nSECTION\r\n").as_bytes(), "\u{d6}l"), Some(4.0));
}

#[test]
fn blocks_are_turned_mirrored_and_arrayed_in_one_another() {
    let block = |name: &str, x: f64, inside: &str| {
        entity!("BLOCK", 8: "0", 2: name, 70: 0, 10: x, 20: 0) + inside + &entity!("ENDBLK", 8: "0")
    };
    // A hole 1 right and 2 up of the base point; in an array turned by 90 degrees and scaled by 2 and -2; in a block
    // seen from below.
    let array =
        entity!("INSERT", 8: "0", 2: "HOLE", 10: 10, 20: 20, 41: 2, 42: -2, 43: 0, 50: 90, 70: 2, 71: 1, 44: 30);
    let blocks = block("HOLE", 7.0, &circle("0", 8.0, 2.0, 0.25)) + &block("ROW", 0.0, &array);
    let from_below = entity!("INSERT", 8: "0", 2: "ROW", 10: 5, 20: 0, 230: -1);
    let drawing = imported(&file(MM, &blocks, &(circle("0", 0.0, 0.0, 99.0) + &from_below))).drawing;
    // (1, 2) scaled: (2, -4); turned: (4, 2); at (10, 20) and 30 further along the turned x: (14, 22), (14, 52).
    // Placed at x 5 and seen from below: x = -(5 + 14).
    let holes = &drawing.shape[1];
    let grid = holes.grid.expect("two holes");
    assert_eq!(
        (holes.radius, holes.centre, grid.count, grid.pitch),
        (Some(0.5), Some([-19.0, 37.0]), [1, 2], [0.0, 30.0])
    );
}

#[test]
fn no_broken_file_makes_the_reader_panic_or_hang() {
    let seeds = [
        oscillator(),
        file(MM, "", &spline_circle(0.0, 0.0, 3.0)),
        file(MM, "", &(line([0.0, 0.0], [1e9, 1e9]) + &circle("0", 0.0, 0.0, 1.0))),
    ];
    let mut rng = Pcg64::seed_from_u64(77);
    let words = [
        "0",
        "-1",
        "1e999",
        "nan",
        "9223372036854775807",
        "",
        "EOF",
        "ENDSEC",
        "\u{e9}",
        "1e11",
        "INSERT",
        "PINS",
        "70",
        "3",
    ];
    let (mut good, mut bad) = (0, 0);
    for _ in 0..4000 {
        let mut lines: Vec<String> = seeds[rng.random_range(0..3)].lines().map(str::to_owned).collect();
        for _ in 0..rng.random_range(1..4) {
            let (k, j) = (rng.random_range(0..lines.len()), rng.random_range(0..lines.len()));
            match rng.random_range(0..5) {
                0 => drop(lines.remove(k)),
                1 => lines[k] = words[rng.random_range(0..words.len())].to_owned(),
                2 => lines.swap(k, j),
                3 => lines.insert(k, lines[j].clone()),
                _ => lines[k & !1] = rng.random_range(0..100).to_string(),
            }
        }
        match read(lines.join("\n").as_bytes(), &DxfOptions::default()) {
            Ok(r) => {
                good += 1;
                r.drawing.check().unwrap();
            }
            Err(e) => {
                bad += 1;
                assert!(!e.what.is_empty());
            }
        }
    }
    println!("{good} read, {bad} refused");
    // Most wounds shift codes against values; enough files must get past that to reach the geometry.
    assert!(good > 100 && bad > 400, "{good} {bad}");
}

#[test]
fn the_program_writes_a_recipe_that_find_accepts() {
    let work = tempfile::tempdir().unwrap();
    let path = |name: &str| work.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("osc.dxf"), oscillator()).unwrap();
    let said = common::sheetlight(&[
        "model",
        &path("osc.dxf"),
        "--name",
        "osc",
        "--alike-turns",
        "2",
        "--out",
        &path("osc.toml"),
    ]);
    let recipe = Recipe::load(&work.path().join("osc.toml")).unwrap();
    assert!(said.contains("name = \"osc\"") && recipe.alike_turns == 2);
    assert!(recipe.construction.iter().any(|c| c.name == "all pin"), "the contacts' lattice");
    let plain = oscillator().replace("70\n4\n", "70\n0\n");
    std::fs::write(path("plain.dxf"), plain).unwrap();
    let (code, talk) =
        common::sheetlight_fails(&["model", &path("plain.dxf"), "--name", "osc", "--out", &path("x.toml")]);
    assert!(code == 1 && talk.contains("--unit") && talk.contains("plain.dxf"), "{talk}");
    assert!(!work.path().join("x.toml").exists());
    let wrong = ["model", &path("plain.dxf"), "--name", "osc", "--unit", "parsec", "--out", &path("x.toml")];
    assert_eq!(common::sheetlight_fails(&wrong).0, 2);
    // The places that the help shows.
    let at = |place: &'static str| {
        ["model", &path("osc.dxf"), "--name", "osc", "--origin", place, "--out", &path("at.toml")].map(str::to_owned)
    };
    for (place, x) in [("0,0", 0.0), ("-1,2.5", 1.0)] {
        common::sheetlight(&at(place).each_ref().map(String::as_str));
        let window = Recipe::load(&work.path().join("at.toml")).unwrap().drawing();
        let window = window.shape.iter().find(|s| s.name.as_deref() == Some("window")).unwrap().centre;
        assert_eq!(window.map(|c| c[0]), Some(x), "{place}");
    }
    for place in ["0", "0,0,0", "0,inf"] {
        let (code, talk) = common::sheetlight_fails(&at(place).each_ref().map(String::as_str));
        assert!(code == 2 && talk.contains("wanted 2 numbers"), "{talk}");
    }
}
