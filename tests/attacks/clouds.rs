//! In: clouds, calibration listings and options with numbers out of all reach. Out: a fault that names them.
//! Frame and unit: mm, px.

use crate::table::{Good, Want::Says, case, check};
use sheetlight::fault::Fault;
use sheetlight::find::insert::recipe::InsertionSpec;
use sheetlight::find::insert::teach::{TeachOptions, teach};
use sheetlight::find::measure::points::Ordered;
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::scan::grid;
use sheetlight::scan::{Along, CloudPoint, GridOptions, Shots};

/// A plate of 40 x 24 mm, 5 mm high, on a table; a shot every 0.2 mm.
fn plate() -> Vec<CloudPoint> {
    let mut out = Vec::new();
    for shot in 0..200u32 {
        for i in 0..300u32 {
            let (x, y) = (0.2 * f64::from(i) - 30.0, 0.2 * f64::from(shot) - 20.0);
            let z = if x.abs() < 20.0 && y.abs() < 12.0 { 5.0 } else { 0.0 };
            let position = [x, y, z].map(|v| v as f32);
            out.push(CloudPoint {
                position: position.into(),
                sigma_mm: 0.02,
                intensity: 100.0,
                quality: 1.0,
                shot,
                u: i as f32,
                v: 200.0,
            });
        }
    }
    out
}

fn with(edit: impl Fn(&mut CloudPoint)) -> Result<Ordered, Fault> {
    let mut cloud = plate();
    edit(&mut cloud[777]);
    Ordered::new(&cloud, &Shots::unplaced(Along::U))
}

#[test]
fn points() {
    check(vec![
        case("a good cloud", Good, || with(|_| {})),
        case("u of 1e30", Says(&["shot 2", "pixels below"]), || with(|p| p.u = 1e30)),
        case("v of 1e30", Says(&["shot 2", "pixels below"]), || with(|p| p.v = 1e30)),
        case("u of nan", Says(&["NaN"]), || with(|p| p.u = f32::NAN)),
        case("v of -inf", Says(&["inf"]), || with(|p| p.v = f32::NEG_INFINITY)),
        case("z of inf", Says(&["inf"]), || with(|p| p.position[2] = f32::INFINITY)),
        case("u of 100,000", Says(&["columns"]), || with(|p| p.u = 1e5)),
        case("a shot of 4 billion", Good, || with(|p| p.shot = u32::MAX)),
        case("a shot that is not listed", Says(&["shot 3, which is not listed"]), || {
            let listed = (0..3).map(|shot| (shot, Rigid::identity()));
            Ordered::new(&plate(), &Shots::new(Along::U, listed))
        }),
        case("499 points", Says(&["499 points", "at least 500"]), || {
            Ordered::new(&plate()[..499], &Shots::unplaced(Along::U))
        }),
    ]);
}

#[test]
fn teaching() {
    let taught = |holes: Vec<[f64; 3]>, windows: Vec<[f64; 4]>, angle_deg: f64| {
        move || {
            let cloud = plate();
            let map = grid(&cloud, &GridOptions::default())?;
            let insertion = InsertionSpec::at_the_part((0.2, 0.5), 20.0, 20.0);
            teach(
                &cloud,
                &Shots::unplaced(Along::U),
                &map,
                &TeachOptions {
                    name: "plate".into(),
                    outline: [10.0, 8.0, 50.0, 32.0],
                    angle_deg,
                    windows,
                    holes,
                    insertion,
                },
            )
        }
    };

    check(vec![
        case("a plate", Good, taught(vec![], vec![], 0.0)),
        case("a hole far away", Says(&["9000", "outside the outline"]), taught(vec![[9000.0, 20.0, 2.0]], vec![], 0.0)),
        case("a hole of 9 m", Says(&["limit"]), taught(vec![[30.0, 20.0, 9000.0]], vec![], 0.0)),
        case("a hole at nan", Says(&["NaN"]), taught(vec![[f64::NAN, 20.0, 2.0]], vec![], 0.0)),
        case(
            "a window far away",
            Says(&["outside the outline"]),
            taught(vec![], vec![[20.0, 10.0, 2000.0, 20.0]], 0.0),
        ),
        case("a turn of inf", Says(&[]), taught(vec![], vec![[20.0, 10.0, 30.0, 20.0]], f64::INFINITY)),
    ]);
}

#[test]
fn robots() {
    let listing = |x: &str, w: &str| {
        let text = format!(
            "/PROG A\n/POS\nP[1]{{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = 0 mm, Z = 0 \
             mm,\n W = {w} deg, P = 10 deg, R = 0 deg\n}};\n/END\n"
        );
        move || {
            sheetlight::robot::fanuc_tp::read::<Base, Flange>(&text).map(|p| {
                // What reads positions goes on with them.
                p.iter().map(|p| p.pose.rotation_vector().norm()).sum::<f64>()
            })
        }
    };
    check(vec![
        case("a listing", Good, listing("1.0", "180.0")),
        case("an angle of 1e308", Says(&[]), listing("1.0", "1e308")),
        case("an angle of 1e160", Says(&[]), listing("1.0", "1e160")),
        case("a length of 1e308", Says(&[]), listing("1e308", "1.0")),
        case("an angle of nan", Says(&["not finite"]), listing("1.0", "nan")),
    ]);
}

#[test]
fn simulations() {
    use sheetlight::simulate::{SimulateOptions, simulate};
    let noisy = |noise: f64| {
        move || {
            let dir = tempfile::tempdir().expect("a folder");
            let options = SimulateOptions { width: 64, height: 64, shots: 2, ..SimulateOptions::default() };
            simulate(dir.path(), &options.with_noise(noise), &|_, _| {}).map(drop)
        }
    };
    check(vec![
        case("noise of 1e-308", Good, noisy(1e-308)),
        case("noise of 1e-30", Good, noisy(1e-30)),
        case("noise of 0", Good, noisy(0.0)),
        case("noise of 1e308", Says(&["read_noise_e"]), noisy(1e308)),
        case("noise of nan", Says(&[]), noisy(f64::NAN)),
        case("noise of -1", Says(&[]), noisy(-1.0)),
    ]);
}
