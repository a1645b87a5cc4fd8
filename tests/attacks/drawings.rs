//! In: recipes, DXF drawings and scenes that ask for more than there is: too many shapes, too large, too far, not
//! finite.
//! Out: an answer within seconds. Frame and unit: mm.

use crate::table::{Case, Good, Want::Says, case, check};
use sheetlight::fault::Fault;
use sheetlight::find::dxf::{self, DxfOptions};
use sheetlight::find::model::drawing::Drawing;
use sheetlight::find::model::edge_index::EdgeIndex;
use sheetlight::find::model::shape_model::{ModelOptions, ShapeModel};
use sheetlight::find::scene::{Kind, Layer, Scene};
use sheetlight::find::search::full::find;
use sheetlight::find::search::options::SearchOptions;
use std::fmt::Write;

/// Everything that `find` does with a drawing before it looks at points, and a search of a map of 60 x 40 mm with
/// nothing on it but a step.
fn used(text: &str) -> Result<(), Fault> {
    let drawing = Drawing::parse(text)?;
    let model = ShapeModel::from_drawing(&drawing, 0.4, Kind::Height, &ModelOptions::default())?;
    let edges = EdgeIndex::new(&drawing, 1.0);
    let faces = drawing.faces();
    let [x0, y0, x1, y1] = drawing.bounds();
    for i in 0..20_000 {
        let at = |low: f64, high: f64, k: usize| low + (high - low) * (i * k % 997) as f64 / 997.0;
        let (x, y) = (at(x0, x1, 13), at(y0, y1, 31));
        std::hint::black_box(faces.iter().filter(|f| f.material(x, y)).count());
        edges.nearest(x, y, 1.0, |_| true);
    }
    let step = (0..150 * 100).map(|i| if i % 150 < 75 { 0.0 } else { 3.0 }).collect();
    let scene = Scene::new(vec![Layer::new(Kind::Height, 150, 100, step)?], Some(0.4))?;
    find(&scene, &model, &SearchOptions::default()).map(drop)
}

fn drawn(name: &str, want: crate::table::Want, text: String) -> Case {
    case(name, want, move || used(&text))
}

fn rectangle(w: f64, h: f64) -> String {
    format!("[[shape]]\nkind = 'rectangle'\ncentre = [0, 0]\nsize = [{w:?}, {h:?}]\n")
}

fn circle(x: f64, y: f64, z: f64) -> String {
    format!("[[shape]]\nkind = 'circle'\ncentre = [{x:?}, {y:?}]\nradius = 0.4\ninside = 'low'\nz_mm = {z:?}\n")
}

/// A star of many corners, so that no two sides are alike.
fn star(corners: usize) -> Vec<[f64; 2]> {
    (0..corners)
        .map(|i| {
            let (s, c) = (std::f64::consts::TAU * i as f64 / corners as f64).sin_cos();
            let r = 10.0 + 0.5 * (i % 7) as f64 / 7.0;
            [r * c, r * s]
        })
        .collect()
}

#[test]
fn recipes() {
    let many = |n: usize, z: fn(usize) -> f64| {
        let holes = (0..n).map(|i| circle((i % 40) as f64 - 20.0, (i / 40) as f64 - 12.0, z(i)));
        rectangle(50.0, 30.0) + &holes.collect::<String>()
    };
    let corners: Vec<String> = star(20_000).iter().map(|p| format!("[{:.6}, {:.6}]", p[0], p[1])).collect();
    let polygon = format!("[[shape]]\nkind = 'polygon'\npoints = [{}]\n", corners.join(", "));
    let grid = |count: &str, pitch: &str| {
        rectangle(60.0, 40.0) + &circle(0.0, 0.0, 0.0) + &format!("grid = {{ count = {count}, pitch = {pitch} }}\n")
    };
    check(vec![
        drawn("1000 shapes", Good, many(1000, |_| 0.0)),
        drawn(
            "1000 shapes at 1000 heights",
            Says(&["1000 heights", "limit 100"]),
            many(999, |i| 0.01 * (i + 1) as f64),
        ),
        drawn("a polygon of 20,000 corners", Good, polygon.clone()),
        drawn(
            "100 polygons of 20,000 corners",
            Says(&["2000000 corners", "limit 1200000"]),
            polygon + "grid = { count = [100, 1], pitch = [30, 1] }\n",
        ),
        drawn("a grid of 100 x 100", Good, grid("[100, 100]", "[0.5, 0.3]")),
        drawn(
            "a grid of 65536 x 65536",
            Says(&["4294967296 elements", "limit 1 to 10000"]),
            grid("[65536, 65536]", "[1, 1]"),
        ),
        drawn("a grid of 4294967295 x 4294967295", Says(&["elements"]), grid("[4294967295, 4294967295]", "[1, 1]")),
        drawn("a grid of 0 x 5", Says(&["0 elements"]), grid("[0, 5]", "[1, 1]")),
        drawn("an infinite pitch", Says(&["grid below 100000 mm"]), grid("[3, 1]", "[inf, 1]")),
        drawn("an infinite pitch of one element", Says(&["grid below 100000 mm"]), grid("[1, 1]", "[inf, 1]")),
        drawn("a pitch of nan", Says(&["pitch above 0"]), grid("[3, 1]", "[nan, 1]")),
        drawn("a body of 30 m", Says(&["30000 mm from end to end", "limit 10000"]), rectangle(30_000.0, 20.0)),
        drawn("65.5 slipped to 6550", Says(&["limit 4 times"]), rectangle(6550.0, 20.0)),
        drawn("65.5 slipped to 65500", Says(&["131040 mm of edges", "limit 100000"]), rectangle(65_500.0, 20.0)),
        drawn("a plate of 9 x 9 m", Says(&["mm²", "limit 4000000"]), rectangle(9000.0, 9000.0)),
        drawn("a part of a nanometre", Says(&["edge places"]), rectangle(1e-6, 1e-6)),
        drawn("a hole 90 m away", Says(&["mm from end to end"]), rectangle(20.0, 10.0) + &circle(9e4, 0.0, 0.0)),
        drawn(
            "a part 5 m from its origin",
            Says(&["limit 4 times"]),
            "[[shape]]\nkind = 'rectangle'\ncentre = [5000, 0]\nsize = [20, 10]\n".into(),
        ),
        drawn("a turn of nan", Says(&["numbers below 100000"]), rectangle(20.0, 10.0) + "angle_deg = nan\n"),
        drawn(
            "an arc of 250 turns",
            Good,
            rectangle(20.0, 10.0) + "[[shape]]\nkind = 'arc'\ncentre = [0, 0]\nradius = 3\nspan_deg = [0, 90000]\n",
        ),
    ]);
}

/// A drawing of some entities, in mm.
fn dxf_of(entities: &str) -> Vec<u8> {
    format!(
        "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"
    )
    .into()
}

fn read(bytes: Vec<u8>) -> Result<(), Fault> {
    let read = dxf::read(&bytes, &DxfOptions::default())?;
    used(&toml::to_string(&read.drawing).expect("plain data"))
}

#[test]
fn dxf_drawings() {
    let corners = star(50_000);
    let mut line = format!("0\nLWPOLYLINE\n90\n{}\n70\n1\n", corners.len());
    let mut pieces = String::new();
    for p in &corners {
        writeln!(line, "10\n{:.9}\n20\n{:.9}", p[0], p[1]).unwrap();
    }
    for i in 0..50_000 {
        let [p, q] = [i, i + 1].map(|i| (std::f64::consts::TAU * f64::from(i % 50_000) / 5e4).sin_cos());
        let [a, b, c, d] = [p.1, p.0, q.1, q.0].map(|v| 600.0 * v);
        writeln!(pieces, "0\nLINE\n10\n{a:.9}\n20\n{b:.9}\n11\n{c:.9}\n21\n{d:.9}").unwrap();
    }
    let frame = "0\nLWPOLYLINE\n90\n4\n70\n1\n10\n-9\n20\n-9\n10\n120\n20\n-9\n10\n120\n20\n120\n10\n-9\n20\n120\n";
    let circles: String = (0..10_000)
        .map(|i| format!("0\nCIRCLE\n10\n{}\n20\n{}\n40\n{}\n", i % 100, i / 100, 0.2 + 0.00001 * i as f64))
        .collect();
    let block =
        "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nA\n10\n0\n20\n0\n0\nCIRCLE\n10\n0\n20\n0\n40\n1\n0\nENDBLK\n0\nENDSEC\n";
    let array = "0\nINSERT\n2\nA\n10\n0\n20\n0\n70\n30000\n71\n30000\n44\n3\n45\n3\n";
    let inserted = [block.as_bytes(), &dxf_of(array)].concat();
    let far = "0\nCIRCLE\n10\n1e11\n20\n0\n40\n1\n0\nCIRCLE\n10\n0\n20\n0\n40\n1\n";
    let tiny: String = (0..2000).map(|i| format!("10\n{}\n20\n{}\n", 1e11 + i as f64, i % 2)).collect();
    let tiny = format!("0\nLWPOLYLINE\n90\n2000\n70\n1\n{tiny}");
    check(vec![
        case("an outline of 50,000 vertices", Good, move || read(dxf_of(&line))),
        // Lines longer than the distance at which ends are joined: read in time, and too large for any map here.
        case("an outline of 50,000 lines", Says(&["reaches 600 mm"]), move || read(dxf_of(&pieces))),
        case("10,000 circles of as many radii", Good, move || read(dxf_of(&(circles + frame)))),
        case("an array of 900 million blocks", Says(&[]), move || read(inserted)),
        case("circles 100,000 km apart", Says(&[]), move || read(dxf_of(far))),
        case("an outline 100,000 km away", Says(&[]), move || read(dxf_of(&tiny))),
    ]);
}

#[test]
fn scenes() {
    use sheetlight::simulate::{Scene, SceneSpec};
    let scene = |more: &str| {
        let text = format!(
            "name = 'a'\nregion_mm = [-10, -10, 10, 10]\n[[solid]]\nshape = {{ ball = {{ diameter_mm = 3 }} \
             }}\nat_mm = [0, 0, 0]\n{more}"
        );
        move || SceneSpec::parse(&text).and_then(Scene::new)
    };
    let cut = "[[solid.cut]]\nshape = { ball = { diameter_mm = 1 } }\n";
    check(vec![
        case("a ball", Good, scene("")),
        case(
            "repeat of 65536 x 65536",
            Says(&["4294967296 copies", "limit 1 to 10000"]),
            scene("repeat = [65536, 65536]\n"),
        ),
        case("repeat of 0", Says(&["0 copies"]), scene("repeat = [0, 2]\n")),
        case("cuts of 65536 x 65536", Says(&["4294967296 cuts"]), scene(&format!("{cut}repeat = [65536, 65536]\n"))),
        case(
            "cuts of 4294967295 x 4294967295",
            Says(&["cuts"]),
            scene(&format!("{cut}repeat = [4294967295, 4294967295]\n{cut}repeat = [4294967295, 4294967295]\n")),
        ),
        case(
            "100 x 100 solids with 100 x 100 cuts",
            Says(&["100010000 solids and cuts", "limit 100000"]),
            scene(&format!("repeat = [100, 100]\n{cut}repeat = [100, 100]\n")),
        ),
        case("a pitch of inf", Says(&["inf"]), scene("repeat = [2, 2]\npitch_mm = [inf, 1]\n")),
        case("a turn of nan", Says(&["NaN"]), scene("turn_deg = nan\n")),
    ]);
}

/// Files are called by a recipe's name, and lines of text by a rig's.
#[test]
fn names() {
    use sheetlight::find::Recipe;
    use sheetlight::simulate::RigSpec;
    let shipped = |file: &str| {
        std::fs::read_to_string(format!("{}/data/{file}", concat!(env!("CARGO_MANIFEST_DIR"), "/.."))).unwrap()
    };
    let (led, rig) = (shipped("recipes/led.toml"), shipped("rigs/paper.toml"));
    let mut cases = Vec::new();
    for (what, name, want) in [
        ("a plain name", "led 2", Good),
        ("a path", "../../led", Says(&["name is \"../../led\""])),
        ("an escape code", "\\u001b[31mled", Says(&["name is"])),
        ("a line of its own", "led\\nformat = 2", Says(&["name is"])),
        ("nothing", " ", Says(&["name is"])),
    ] {
        let text = led.replace("name = \"led\"", &format!("name = \"{name}\""));
        cases.push(case(format!("{what} of a recipe"), want, move || Recipe::parse(&text)));
    }
    let line = rig.lines().find(|l| l.starts_with("name = ")).unwrap().to_owned();
    let text = rig.replace(&line, "name = \"a\\n[gates]\\nmax_sigma_mm = 9\"");
    cases.push(case("lines in a rig's name", Says(&["name is"]), move || RigSpec::parse(&text)));
    check(cases);
}
