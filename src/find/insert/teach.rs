//! In: one scan and a few numbers: where the body's outline, its windows and its holes lie in the map.
//! Out: a recipe with the dimensions that the points show, verified on the same scan.
//! Frame and unit: numbers in the height map's grid frame, mm; the recipe's drawing in the part frame.

use super::locate::{LocateOptions, Report, locate};
use super::recipe::{Gates, InsertionSpec, Recipe};
use crate::fault::{Fault, Result};
use crate::find::measure::construct::{Build, Construction, features};
use crate::find::measure::options::MeasureOptions;
use crate::find::measure::points::Ordered;
use crate::find::measure::pose::{Measured, measure};
use crate::find::model::drawing::Drawing;
use crate::find::model::shape::{Form, Inside, Shape};
use crate::geometry::{Base, Grid, Part, Rigid, Vec3};
use crate::scan::{CloudPoint, HeightMap, Shots};

/// The few numbers that a user states, for example by clicks.
#[derive(Clone, Debug)]
pub struct TeachOptions {
    /// Name of the recipe and its files.
    pub name: String,
    /// Two opposite corners of the body's outline: x0 y0 x1 y1 in the grid, mm. The part's origin is its
    /// centre, its x axis the grid's x turned by `angle_deg`.
    pub outline: [f64; 4],
    /// Turn of the outline about its centre, degrees.
    pub angle_deg: f64,
    /// Windows through which the board is seen, corners as above.
    pub windows: Vec<[f64; 4]>,
    /// Round holes: centre x y and radius.
    pub holes: Vec<[f64; 3]>,
    /// Where the tool goes, and the tolerances of the insertion; copied into the recipe.
    pub insertion: InsertionSpec,
}

/// Teaches from a cloud and its map. Refuses numbers that lie outside the map or show no part.
pub fn teach(cloud: &[CloudPoint], shots: &Shots, map: &HeightMap, options: &TeachOptions) -> Result<(Recipe, Report)> {
    let points = Ordered::new(cloud, shots)?;
    let [x0, y0, x1, y1] = options.outline;
    let (w, h) = (f64::from(map.width) * map.cell, f64::from(map.height) * map.cell);
    if !(x0 < x1 && y0 < y1 && x0 >= 0.0 && y0 >= 0.0 && x1 <= w && y1 <= h) {
        return Err(Fault::usage(format!(
            "the outline {x0} {y0} {x1} {y1} does not lie in the map of {w:.1} x {h:.1} mm"
        ))
        .cause("corners swapped, or cells given for millimetres")
        .next("give x0 y0 x1 y1 in mm from the map's corner, smaller numbers first"));
    }
    // A notch may extend beyond the outline.
    let spare = 0.5 * (x1 - x0).max(y1 - y0);
    let inside = |x: f64, y: f64| (x0 - spare..=x1 + spare).contains(&x) && (y0 - spare..=y1 + spare).contains(&y);
    let windows = options.windows.iter().flat_map(|w| [[w[0], w[1], 0.0], [w[2], w[3], 0.0]]);
    if let Some([x, y, _]) = options.holes.iter().copied().chain(windows).find(|p| !inside(p[0], p[1])) {
        return Err(Fault::usage(format!(
            "a hole or window lies at {x} {y}, more than {spare:.1} mm outside the outline {x0} {y0} {x1} {y1}"
        ))
        .cause("cells given for millimetres, or numbers from another corner than the map's")
        .next("give places in mm from the map's corner, inside the outline"));
    }
    let centre = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
    let place = Vec3::new(centre[0], centre[1], 0.0);
    let grid_from_part: Rigid<Grid, Part> =
        Rigid::from_vectors(&Vec3::new(0.0, 0.0, options.angle_deg.to_radians()), place);
    let mut drawing = drawn(options, &grid_from_part);
    drawing.check()?;
    let height = datum_height(map, &grid_from_part, &drawing)?;
    let lift: Rigid<Part, Part> = Rigid::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.0, height));
    let mut pose: Rigid<Base, Part> = map.base_from_grid * grid_from_part * lift;
    let gates = MeasureOptions { edge_gate_mm: 1.0, ..MeasureOptions::default() };
    // Each round measures with the dimensions of the previous one; three rounds reduce a click's error of 0.5 mm to the
    // noise.
    for _ in 0..3 {
        let measured = measure(&points, &drawing, pose, &gates)?;
        pose = measured.base_from_part;
        adjust(&mut drawing, &measured, &gates);
    }
    let recipe = recipe_of(options, drawing, map)?;
    let up = map.base_from_grid.direction(&Vec3::z());
    let proof = locate(cloud, shots, &recipe, None, &LocateOptions { up: Some(up), ..LocateOptions::default() })?;
    Ok((recipe, proof))
}

/// Outline, windows and holes at the stated positions.
fn drawn(options: &TeachOptions, grid_from_part: &Rigid<Grid, Part>) -> Drawing {
    let [x0, y0, x1, y1] = options.outline;
    let local = |x: f64, y: f64| grid_from_part.inverse().point(&Vec3::new(x, y, 0.0));
    let rectangle = |inside, c: [f64; 2], size: [f64; 2]| Shape {
        centre: Some(c),
        size: Some(size),
        ..Shape::new(Form::Rectangle, inside)
    };
    let mut shapes = vec![rectangle(Inside::High, [0.0, 0.0], [x1 - x0, y1 - y0])];
    for w in &options.windows {
        let c = local(0.5 * (w[0] + w[2]), 0.5 * (w[1] + w[3]));
        shapes.push(rectangle(Inside::Low, [c.x, c.y], [(w[2] - w[0]).abs(), (w[3] - w[1]).abs()]));
    }
    for (i, hole) in options.holes.iter().enumerate() {
        let c = local(hole[0], hole[1]);
        shapes.push(Shape {
            name: Some(format!("hole{}", i + 1)),
            centre: Some([c.x, c.y]),
            radius: Some(hole[2]),
            search: false,
            locates: false,
            ..Shape::new(Form::Circle, Inside::Low)
        });
    }
    Drawing { shape: shapes }
}

/// The most frequent height inside the outline and outside the windows, in bins of 0.1 mm.
fn datum_height(map: &HeightMap, grid_from_part: &Rigid<Grid, Part>, drawing: &Drawing) -> Result<f64> {
    const BIN: f64 = 0.1;
    let faces = drawing.faces();
    let part_from_grid = grid_from_part.inverse();
    let mut bins = std::collections::BTreeMap::<i64, usize>::new();
    for iy in 0..map.height {
        for ix in 0..map.width {
            let Some(p) = map.point(ix, iy) else { continue };
            let q = part_from_grid.point(&p);
            if faces[0].material(q.x, q.y) {
                *bins.entry((p.z / BIN).floor() as i64).or_default() += 1;
            }
        }
    }
    let best = bins.into_iter().max_by_key(|b| b.1).ok_or_else(|| {
        Fault::refused("nothing was measured inside the outline")
            .cause("the outline lies in a shadow, or beside the part")
            .next("look at the height map and give the outline again")
    })?;
    Ok((best.0 as f64 + 0.5) * BIN)
}

/// Moves sides and centres to where the points show them. Partly lit samples make a surface appear shorter than it is,
/// by about 0.05 mm a side; it is taught as it appears.
fn adjust(drawing: &mut Drawing, measured: &Measured, options: &MeasureOptions) {
    let holes = features(&measured.observations, measured.growth, options);
    for (i, s) in drawing.shape.iter_mut().enumerate() {
        let centre = s.centre.expect("rectangles and circles have one");
        if s.kind == Form::Circle {
            if let Some(f) = holes.get(&(i, 0)) {
                s.centre = Some([centre[0] + f.offset[0], centre[1] + f.offset[1]]);
            }
            continue;
        }
        let size = s.size.expect("a rectangle has one");
        // Median shift of each side along the axis, towards +.
        let side = |axis: usize, sign: f64| {
            let mut d: Vec<f64> = measured
                .observations
                .iter()
                .filter(|o| o.shape == i)
                .filter_map(|o| {
                    let (n, at) = if axis == 0 { (o.nx, o.x - centre[0]) } else { (o.ny, o.y - centre[1]) };
                    (n.abs() > 0.9 && at * sign > 0.0).then(|| o.residual * n.signum())
                })
                .collect();
            if d.len() < 8 {
                return 0.0;
            }
            let middle = d.len() / 2;
            *d.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        let moved: [[f64; 2]; 2] = std::array::from_fn(|axis| [side(axis, -1.0), side(axis, 1.0)]);
        s.size = Some(std::array::from_fn(|k| size[k] + moved[k][1] - moved[k][0]));
        s.centre = Some(std::array::from_fn(|k| centre[k] + 0.5 * (moved[k][0] + moved[k][1])));
    }
}

fn recipe_of(options: &TeachOptions, mut drawing: Drawing, map: &HeightMap) -> Result<Recipe> {
    // The origin is the measured centre of the body.
    let origin = drawing.shape[0].centre.expect("a rectangle has one");
    for s in &mut drawing.shape {
        let micrometre = |v: f64| (v * 1000.0).round() / 1000.0;
        s.centre = s.centre.map(|c| [micrometre(c[0] - origin[0]), micrometre(c[1] - origin[1])]);
        s.size = s.size.map(|v| v.map(micrometre));
    }
    let names: Vec<String> = drawing.shape.iter().filter_map(|s| s.name.clone()).collect();
    let mut construction = Vec::new();
    if names.len() >= 2 {
        construction.push(Construction {
            name: "middle of the holes".into(),
            kind: Build::Midpoint,
            of: names,
            by_mm: None,
            along: None,
        });
    }
    let cell_mm = (2.0 * map.cell).clamp(1e-4, 500.0);
    let plain = Recipe::new(&options.name, cell_mm, drawing.shape, options.insertion.clone());
    // A rectangle looks the same after half a turn, and the taught drawing has no notch that would distinguish the two.
    let gates = Gates { turn_must_be_told: false, min_margin: 0.0, ..Gates::default() };
    let recipe = Recipe { construction, gates, ..plain };
    recipe.check()?;
    Ok(recipe)
}
