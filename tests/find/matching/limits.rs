//! In: a drawn part in a picture. Out: judgement on ranges of turn and scale, and on regions: they limit the result,
//! not the start.
//! Frame and unit: pixels, degrees.

use super::scenes::{H, Picture, W, bracket, draw, taught};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use sheetlight::find::{
    Area, Kind, Layer, ModelOptions, Pose, Region, Scene, SearchOptions, ShapeModel, find, find_in,
};

#[test]
fn ranges_limit_what_is_returned() {
    let (model, at) = taught(bracket, 1.0);
    let mut rng = Pcg64::seed_from_u64(9);
    let found = |degrees: f64, size: f64, angles_deg: [f64; 2], scales: [f64; 2], rng: &mut Pcg64| {
        let pose = Pose { x: 150.3, y: 120.6, angle: at + degrees.to_radians(), scale: size };
        let parts = vec![(bracket as fn(f64, f64) -> f64, pose, 170.0)];
        let scene = draw(&Picture { parts, back: 60.0, under: vec![], over: vec![], noise: 3.0 }, rng);
        let options = SearchOptions { angles_deg, scales, ..SearchOptions::default() };
        find(&scene, &model, &options).unwrap().into_iter().next().map(|m| (m.pose.angle.to_degrees(), m.pose.scale))
    };
    let one = [1.0, 1.0];
    for degrees in [41.0, 7.0, -7.0] {
        assert_eq!(found(degrees, 1.0, [-5.0, 5.0], one, &mut rng), None, "{degrees} degrees are none of ±5");
    }
    for degrees in [-4.9, 0.0, 4.9] {
        let (a, _) = found(degrees, 1.0, [-5.0, 5.0], one, &mut rng).expect("within the range");
        assert!((a - degrees).abs() < 0.2, "{a} for {degrees}");
    }
    // A range over the seam, and one of one value: the turn is what it is said to be.
    let (a, _) = found(179.0, 1.0, [170.0, 190.0], one, &mut rng).expect("over the seam");
    assert!((a.rem_euclid(360.0) - 179.0).abs() < 0.2, "{a}");
    assert_eq!(found(0.2, 1.0, [0.0, 0.0], one, &mut rng).expect("held").0, 0.0);
    let (_, s) = found(20.0, 1.08, [-180.0, 180.0], [0.9, 1.1], &mut rng).expect("in the range of scales");
    assert!((s - 1.08).abs() < 0.005, "{s}");
    assert_eq!(found(20.0, 1.08, [-180.0, 180.0], [0.95, 1.03], &mut rng), None, "1.08 is none of 0.95 to 1.03");
}

/// Two layers that show the same edges are not independent: they state no smaller sigma than one of them, and a
/// finite one.
#[test]
fn a_second_layer_of_the_same_edges_halves_nothing() {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut seen = |noise: f64, x: f64| {
        let pose = Pose { x, y: 120.6, angle: 0.2, scale: 1.0 };
        let parts = vec![(bracket as fn(f64, f64) -> f64, pose, 170.0)];
        draw(&Picture { parts, back: 60.0, under: vec![], over: vec![], noise }, &mut rng).layers.remove(0).values
    };
    let (clean, noisy) = (seen(0.0, 150.3), seen(4.0, 158.8));
    let all = ModelOptions { max_points: 5000, ..ModelOptions::default() };
    let sigma = |kinds: &[Kind]| {
        let scene = |values: &[f32]| {
            let layer = |k: &Kind| Layer::new(*k, W, H, values.to_vec()).unwrap();
            Scene::new(kinds.iter().map(layer).collect(), None).unwrap()
        };
        let region = Region { x0: 98, y0: 68, x1: 203, y1: 173 };
        let model = ShapeModel::from_region(&scene(&clean), region, None, &all).unwrap();
        let found = find(&scene(&noisy), &model, &SearchOptions::default()).unwrap();
        let m = found.first().expect("in plain sight");
        [m.sigma_px[0], m.sigma_px[1], m.sigma_deg]
    };
    let (one, two) = (sigma(&[Kind::Intensity]), sigma(&[Kind::Intensity, Kind::Height]));
    assert!(one.iter().zip(&two).all(|(one, two)| (0.999 * one..1.2 * one).contains(two)), "{one:?} and {two:?}");
}

#[test]
fn a_region_gives_what_the_whole_picture_gives_there() {
    let (model, at) = taught(bracket, 0.8);
    let mut rng = Pcg64::seed_from_u64(2);
    let pose = |x: f64, y: f64, angle: f64| Pose { x, y, angle: at + angle, scale: 0.8 };
    let poses = [pose(60.2, 60.7, 0.3), pose(250.4, 190.1, 2.0)];
    let parts = poses.iter().map(|p| (bracket as fn(f64, f64) -> f64, *p, 170.0)).collect();
    let scene = draw(&Picture { parts, back: 60.0, under: vec![], over: vec![], noise: 3.0 }, &mut rng);
    let options = SearchOptions { max_matches: 10, ..SearchOptions::default() };
    assert_eq!(find(&scene, &model, &options).unwrap().len(), 2);
    let right = Area::rectangle([W as f64 / 2.0, 0.0, W as f64 / 2.0, H as f64]).unwrap();
    let found = find_in(&scene, &model, &options, Some(&right), None).unwrap();
    let off = (found[0].pose.x - poses[1].x).hypot(found[0].pose.y - poses[1].y);
    assert!(found.len() == 1 && off < 0.1, "{} found, {off:.3} px off", found.len());
    let empty = Area::polygon(vec![[150.0, 100.0], [170.0, 100.0], [160.0, 130.0]]).unwrap();
    assert!(find_in(&scene, &model, &options, Some(&empty), None).unwrap().is_empty());
}
